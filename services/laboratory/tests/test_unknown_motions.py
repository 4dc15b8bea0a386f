"""Motion that is no part of a task: random, as large as it says, and joined without a jump."""

import numpy as np
import pytest

from hmcs.motion.lasa import shapes
from hmcs.motion.steps import steps_of
from hmcs_laboratory.data.unknown_motions import (
    Reaches,
    Smooth,
    after,
    other_drawings,
    random_reaches,
    smooth_motion,
)


def test_smooth_motion_bends_as_its_process_says():
    smooth = Smooth(curvature_per_m=20.0, correlation_m=0.01, sample_m=0.001)
    points = smooth_motion(smooth, 40.0, np.random.default_rng(0))
    assert not points[:, 2].any()
    moves = np.diff(points[:, :2], axis=0)
    np.testing.assert_allclose(np.linalg.norm(moves, axis=1), smooth.sample_m)
    heading = np.unwrap(np.arctan2(moves[:, 1], moves[:, 0]))
    curvature = np.diff(heading) / smooth.sample_m
    assert curvature.std() == pytest.approx(20.0, rel=0.05)
    later = np.corrcoef(curvature[:-10], curvature[10:])[0, 1]
    assert later == pytest.approx(np.exp(-1.0), abs=0.05)


def test_reaches_begin_and_end_at_rest_and_are_as_long_as_they_say():
    reaches = Reaches(length_m=(0.02, 0.06), tremor_m=0.0)
    points = random_reaches(reaches, 1.0, np.random.default_rng(1))
    each = points.reshape(-1, reaches.samples, 3)
    lengths = np.linalg.norm(each[:, -1] - each[:, 0], axis=1)
    assert ((lengths >= 0.02) & (lengths <= 0.06)).all()
    assert 1.0 <= lengths.sum() <= 1.06
    np.testing.assert_allclose(each[1:, 0], each[:-1, -1], atol=1e-12)
    speeds = np.linalg.norm(np.diff(each, axis=1), axis=2)
    assert (speeds[:, [0, -1]] < 0.01 * speeds.max(axis=1, keepdims=True)).all()


def test_other_drawings_show_none_of_the_known_shapes():
    names = [name for name in shapes() if not name.startswith("Multi_Models")]
    only = other_drawings(names[1:], 1, np.random.default_rng(2))
    assert only.shape[1] == 3
    assert len(only) > 100
    with pytest.raises(ValueError, match="1 to 1"):
        other_drawings(names[1:], 2, np.random.default_rng(2))


def test_steps_made_after_others_begin_where_these_end():
    path = smooth_motion(Smooth(), 0.2, np.random.default_rng(3))
    first, second = steps_of(path, 0.01), steps_of(path[::-1], 0.01)
    whole = (*first, *after(first, second))
    assert [step.index for step in whole] == list(range(len(first) + len(second)))
    ends = [step.position + step.displacement for step in whole]
    np.testing.assert_allclose(ends[:-1], [step.position for step in whole[1:]], atol=1e-12)
