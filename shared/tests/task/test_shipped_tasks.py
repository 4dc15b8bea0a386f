"""The tasks that come along are right, and hold together with their drawings and workspaces."""

from __future__ import annotations

import numpy as np
import pytest

from hmcs.motion.demonstrations import read_csv
from hmcs.task import check_task, find_task, load_task, shipped_tasks


def test_both_shipped_tasks_are_right_and_found_by_name() -> None:
    assert shipped_tasks() == ("human-shapes", "lines-through-obstacles", "object-3d", "surface-2d")
    for name in shipped_tasks():
        assert check_task(name) == []
        assert load_task(name).name == name
        assert load_task(find_task(name)) == load_task(name)


def test_human_shapes_is_a_ring_of_five_shapes_that_fits_its_workspace() -> None:
    task = load_task("human-shapes")
    assert [g.name for g in task.gestemes] == ["GShape", "NShape", "PShape", "JShape", "Snake"]
    state, ring = next(iter(task.start)), []
    for _ in task.states:
        ring.append(task.state(state).gestemes)
        (state,) = task.state(state).next
    assert state == next(iter(task.start))
    assert ring == [("GShape",), ("NShape",), ("PShape",), ("JShape",), ("Snake",)]
    assert task.drawings is not None
    # The chain's extent as drawn, from where it begins: left, right, low, high.
    drawn_m = np.array([[-33.9, -40.6], [75.1, 72.5]]) * 1e-3 * task.drawings.scale
    y = task.robot.tool_start_m[1] - drawn_m[:, 0]
    z = task.robot.tool_start_m[2] + drawn_m[:, 1]
    assert y.mean() == pytest.approx(0, abs=2e-3)
    assert np.ptp(z) == pytest.approx(0.4, abs=2e-3)
    for corner in ((0.6, a, b) for a in y for b in z):
        assert task.workspace.excess_m(corner) == {}


def test_the_lines_through_obstacles_keep_clear_of_them() -> None:
    task = load_task("lines-through-obstacles")
    lines = read_csv(find_task("lines-through-obstacles").with_suffix(".csv"))
    np.testing.assert_allclose(lines.positions[0], task.robot.tool_start_m)
    assert list(dict.fromkeys(lines.states)) == [state.name for state in task.states]
    for begin, end in zip(lines.positions[:-1], lines.positions[1:], strict=True):
        for point in np.linspace(begin, end, 50):
            assert task.workspace.excess_m(tuple(point)) == {}
            for box in task.workspace.obstacles:
                assert box.size_m is not None
                outside = np.abs(point - box.position_m) - np.array(box.size_m) / 2
                assert np.linalg.norm(np.maximum(outside, 0)) > 0.1
