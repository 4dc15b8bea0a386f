"""Demonstrations of one gesteme are parted where they are different motions, and only there."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hmcs.recognition.segment_filter.variants import VariantSettings, split_into_variants

STEPS = np.arange(20.0)[:, None]


def walked(*ways):
    """Straight motions of nineteen steps, m, shape (20, D) each."""
    return [0.01 * STEPS * np.array(way) for way in ways]


def apart_m(one, other):
    return float(np.sqrt(((one - other) ** 2).sum(axis=1).mean()))


@given(st.integers(0, 2**32 - 1), st.integers(2, 9), st.sampled_from([1.0, 1.5, 4.0]))
def test_no_two_of_a_variant_are_too_far_apart_and_no_two_variants_are_near(seed, count, apart):
    rng = np.random.default_rng(seed)
    motions = [walked(*rng.normal(size=(count, 2))), walked(*(10.0 * rng.normal(size=(2, 2))))]
    far = [[[apart_m(a, b) for b in own] for a in own] for own in motions]
    between = [far[g][a][b] for g in (0, 1) for b in range(len(far[g])) for a in range(b)]
    limit = apart * np.median(between)
    for g, groups in enumerate(split_into_variants(motions, VariantSettings(apart))):
        assert sorted(k for group in groups for k in group) == list(range(len(motions[g])))
        for k, group in enumerate(groups):
            assert max(far[g][a][b] for a in group for b in group) <= limit * (1 + 1e-9)
            for other in groups[:k]:
                assert max(far[g][a][b] for a in group for b in other) > limit * (1 - 1e-9)


def test_ways_round_that_begin_and_end_alike_are_two():
    share = np.linspace(0, 1, 40)
    over = [np.stack([share, (1 + 0.01 * k) * share * (1 - share)], axis=1) for k in range(3)]
    under = [way * [1.0, -1.0] for way in over]
    assert split_into_variants([[*over, *under]], VariantSettings(0.5)) == [[[0, 1, 2], [3, 4, 5]]]


def test_the_same_motion_however_often_is_one_way():
    assert split_into_variants([walked([1, 0], [1, 0], [1, 0])]) == [[[0, 1, 2]]]
    assert split_into_variants([walked([1, 0]), walked([0, 1])]) == [[[0]], [[0]]]


def test_ways_more_than_four_times_as_far_apart_as_most_are_two():
    most = walked([1, 0.0], [1, 0.1], [1, 0.0], [1, 0.1])
    for farther, count in ((0.35, 1), (0.45, 2)):
        split = split_into_variants([most, walked([1, 0.0], [1, farther])])
        assert [len(groups) for groups in split] == [1, count]
