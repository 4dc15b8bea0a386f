"""Motion directions of tasks of lines: parts against brute force, the whole on simulated hands."""

from itertools import combinations, pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.motion.operators import Operator, follow, joined
from hmcs.motion.references import References, random_gestemes
from hmcs_baselines.chords import Chords, cut, lay
from hmcs_baselines.directions import (
    DirectionError,
    DirectionSettings,
    distinct_directions,
    elbow_directions,
    find_directions,
    pooled_directions,
)

LINES = References(kind="line", dimensions=3)


def task(seed, noise, lines=5, demonstrations=6):
    """True directions, and positions of simulated hands."""
    rng = np.random.default_rng(seed)
    gestemes = random_gestemes(LINES, lines, rng)
    reference, owners = joined(gestemes, 0.025)
    hand = Operator(step_m=0.05, noise=noise, look_ahead_m=0.15)
    traces = [follow(reference, hand, rng, owners) for _ in range(demonstrations)]
    truth = np.array([g[-1] / np.linalg.norm(g[-1]) for g in gestemes])
    return truth, [t.positions for t in traces], [t.segments for t in traces]


def corner(angle_rad=np.pi / 2, steps=15):
    """Two straight lines without any noise."""
    turn = np.array([np.cos(angle_rad), np.sin(angle_rad)])
    first = np.arange(steps + 1)[:, None] * [0.05, 0.0]
    return np.concatenate([first, first[-1] + np.arange(1, steps + 1)[:, None] * 0.05 * turn])


def stretch_cost(positions, direction, correlation, weight):
    """The cost in the docstring of `chords`, term by term."""
    across = np.eye(len(direction)) - np.outer(direction, direction)
    error = (positions - positions.mean(axis=0)) @ across
    steps = np.diff(positions, axis=0)
    pace = steps @ direction
    return (
        (1 - correlation) ** 2 * (error**2).sum()
        + correlation * ((steps @ across) ** 2).sum()
        + weight * ((pace - pace.mean()) ** 2).sum()
    )


@settings(max_examples=20)
@given(
    seed=st.integers(0, 10**6),
    axes=st.integers(2, 3),
    correlation=st.floats(0, 0.9),
    weight=st.floats(0, 1),
)
def test_costs_are_what_their_definition_says(seed, axes, correlation, weight):
    rng = np.random.default_rng(seed)
    positions = np.cumsum(rng.normal(size=(9, axes)), axis=0)
    directions = rng.normal(size=(3, axes))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    chords = Chords(positions, correlation)
    chords.weigh_pace(weight)
    costs, least = chords.costs(directions), chords.least_costs()
    for first, last in combinations(range(9), 2):
        stretch = positions[first : last + 1]
        for k, direction in enumerate(directions):
            if (stretch[-1] - stretch[0]) @ direction > 0:
                wanted = stretch_cost(stretch, direction, correlation, weight)
                assert costs[k, last, first] == pytest.approx(wanted, abs=1e-9)
        best = stretch_cost(stretch, chords.direction(first, last), correlation, weight)
        assert least[last, first] == pytest.approx(best, abs=1e-9)
        assert (costs[:, last, first] >= least[last, first] - 1e-9).all()


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6), penalty=st.floats(0, 2), least_steps=st.integers(1, 3))
def test_a_cut_is_the_best_of_all(seed, penalty, least_steps):
    costs = np.random.default_rng(seed).uniform(size=(9, 9))
    pieces = cut(costs, penalty, least_steps)
    assert (pieces[0].first, pieces[-1].last) == (0, 8)

    def total(knots):
        return sum(costs[b, a] + penalty for a, b in pairwise(knots))

    every = [
        total((0, *inner, 8))
        for count in range(8)
        for inner in combinations(range(1, 8), count)
        if min(np.diff((0, *inner, 8))) >= least_steps
    ]
    assert sum(costs[p.last, p.first] + penalty for p in pieces) == pytest.approx(min(every))


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6), penalty=st.floats(0, 1), least_steps=st.integers(1, 3))
def test_lines_are_laid_in_the_best_of_all_ways(seed, penalty, least_steps):
    lines, count = 3, 8
    costs = np.random.default_rng(seed).uniform(size=(lines, count, count))

    def best(allowed):
        """Every choice of lines used, in order, and of knots between them."""
        totals = []
        for used in product([False, True], repeat=len(allowed)):
            chosen = [k for k, u in zip(allowed, used, strict=True) if u]
            skipped = penalty * (len(allowed) - len(chosen))
            if not chosen:
                continue
            for inner in combinations(range(1, count - 1), len(chosen) - 1):
                knots = (0, *inner, count - 1)
                if min(np.diff(knots)) >= least_steps:
                    own = zip(chosen, knots, knots[1:], strict=False)
                    totals.append(skipped + sum(costs[k, b, a] for k, a, b in own))
        return min(totals)

    fitted = lay(costs, penalty, least_steps)
    everything = list(range(lines))
    assert fitted.cost == pytest.approx(best(everything))
    own = sum(costs[p.line, p.last, p.first] for p in fitted.pieces)
    assert own + penalty * (lines - len(fitted.pieces)) == pytest.approx(fitted.cost)
    for k in everything:
        without = best([other for other in everything if other != k])
        assert fitted.cost_without[k] == pytest.approx(without)


@pytest.mark.parametrize("find", [find_directions, pooled_directions])
@pytest.mark.parametrize("angle_deg", [40, 90, 150, 180])
def test_a_noiseless_corner_has_two_directions_and_its_labels_change_there(find, angle_deg):
    found = find([corner(np.radians(angle_deg))] * 2)
    turned = [np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))]
    np.testing.assert_allclose(found.directions, [[1, 0], turned], atol=1e-6)
    assert found.support.tolist() == [1, 1]
    for labels in found.labels:
        assert labels.tolist() == [0] * 15 + [1] * 15


def test_the_number_of_directions_is_found_under_noise():
    """The study measures how often; here it has to be right far more often than not."""
    right, close = [], []
    for seed in range(6):
        truth, positions, segments = task([11, seed], 0.2)
        angle = DirectionSettings().merge_angle_rad
        found = find_directions(positions)
        right.append(len(found.directions) == len(distinct_directions(truth, angle)))
        shown = found.directions[np.concatenate(found.labels)]
        own = truth[np.concatenate([s[1:] for s in segments])]
        close.append(np.median(np.degrees(np.arccos(np.clip((shown * own).sum(axis=1), -1, 1)))))
    assert sum(right) >= 5
    assert np.median(close) < 5


def test_a_line_that_comes_back_is_one_direction():
    square = np.array([[0.0, 0], [1, 0], [1, 1], [2, 1]])
    reference, _ = joined([[[*a, 0], [*b, 0]] for a, b in pairwise(square)], 0.025)
    rng = np.random.default_rng(0)
    hands = [follow(reference, Operator(), rng).positions for _ in range(4)]
    found = find_directions(hands)
    assert len(found.directions) == 2
    assert [k for k, _ in zip(*np.unique(found.labels[0], return_counts=True), strict=True)] == [
        0,
        1,
    ]


def test_a_demonstration_may_leave_out_a_line():
    whole = np.concatenate([corner(), corner()[-1] + corner(np.pi / 3)[1:16]])
    found = find_directions([whole, whole, whole, corner()])
    assert len(found.directions) == 2
    assert [set(labels.tolist()) for labels in found.labels] == [{0, 1}] * 4


def test_orders_do_not_matter_to_pooled_directions():
    there = corner()
    back = there[::-1].copy()
    found = pooled_directions([there, back, there, back])
    assert len(found.directions) == 4
    assert found.support.tolist() == [0.5] * 4


def test_every_step_of_every_demonstration_is_labeled():
    _, positions, _ = task(5, 0.3, lines=4, demonstrations=3)
    rng = np.random.default_rng(0)
    for found in (
        find_directions(positions),
        pooled_directions(positions),
        elbow_directions(positions, rng, restarts=2),
    ):
        assert [len(labels) for labels in found.labels] == [len(p) - 1 for p in positions]
        assert all(
            np.isin(labels, np.arange(len(found.directions))).all() for labels in found.labels
        )
        np.testing.assert_allclose(np.linalg.norm(found.directions, axis=1), 1)
        everything = np.concatenate(found.labels)
        firsts = [int((everything == k).argmax()) for k in np.unique(everything)]
        assert firsts == sorted(firsts)


def test_where_and_how_large_a_task_is_makes_no_difference():
    _, positions, _ = task(7, 0.15, lines=4, demonstrations=3)
    here = find_directions(positions)
    there = find_directions([100.0 * p + [3.0, -2.0, 5.0] for p in positions])
    np.testing.assert_allclose(here.directions, there.directions, atol=1e-6)
    assert all((a == b).all() for a, b in zip(here.labels, there.labels, strict=True))


def test_the_elbow_finds_clear_directions():
    rng = np.random.default_rng(0)
    hands = [corner() + rng.normal(0, 0.002, (31, 2)) for _ in range(4)]
    found = elbow_directions(hands, rng)
    assert len(found.directions) == 2
    assert found.labels[0].tolist() == [0] * 15 + [1] * 15


def test_distinct_directions_are_farther_apart_than_the_angle():
    fan = np.radians([0, 5, 40, 90, 93])
    directions = np.stack([np.cos(fan), np.sin(fan)], axis=1)
    distinct = distinct_directions(directions, np.radians(10))
    angles = np.degrees(np.arctan2(distinct[:, 1], distinct[:, 0]))
    np.testing.assert_allclose(angles, [2.5, 40, 91.5])
    assert len(distinct_directions(directions, np.radians(4))) == 4


@pytest.mark.parametrize(
    ("demonstrations", "says"),
    [
        ([], "no demonstrations"),
        ([np.zeros((0, 3))], "0 positions"),
        ([np.ones((1, 3))], "1 positions"),
        ([corner(), corner()[:5]], "demonstration 1 has 5 positions"),
        ([np.ones((20, 3))], "no motion"),
        ([corner(), np.ones((20, 3))], r"\(T, 2\)"),
        ([np.arange(20.0)], "shape"),
        ([np.where(np.arange(31)[:, None] == 4, np.nan, corner())], "position 4"),
    ],
)
def test_demonstrations_without_directions_are_refused(demonstrations, says):
    for find in (find_directions, pooled_directions):
        with pytest.raises(DirectionError, match=says):
            find(demonstrations)


def test_too_short_chords_are_refused():
    with pytest.raises(ValueError, match="least_steps"):
        find_directions([corner()], DirectionSettings(least_steps=3))


def test_a_stretch_that_leads_backward_is_not_along_a_direction():
    out = np.linspace([0.0, 0, 0], [0.1, 0, 0], 11)
    chords = Chords(np.vstack([out, out[-2::-1]]), 0.0)
    (along,) = chords.costs(np.array([[1.0, 0.0, 0.0]]))
    # Out along the line it costs nothing; back it costs all that its points scatter.
    assert along[10, 0] == pytest.approx(0.0, abs=1e-12)
    back = out[::-1] - out.mean(axis=0)
    assert along[20, 10] == pytest.approx((back**2).sum())
    assert chords.least_costs()[20, 10] == pytest.approx(0.0, abs=1e-12)
