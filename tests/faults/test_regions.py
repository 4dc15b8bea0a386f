"""A robot keeps its tool out of forbidden regions, whatever becomes of the fixture."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from support.region_faults import INSIDE_M, WAYS, Descent, How, Shape, write_task
from support.stack import Stack


@pytest.mark.parametrize(
    ("shape", "ways"), [("plane", WAYS[:2]), ("box", WAYS[2:3]), ("mesh", WAYS[3:])]
)
def test_beside_a_fixture_that_is_killed_hung_flooded_or_replaced_the_tool_stays_out(
    tmp_path: Path, shape: Shape, ways: tuple[How, ...]
) -> None:
    with Stack(tmp_path / "logs") as stack:
        descent = Descent(stack, tmp_path, shape, np.random.default_rng(11))
        try:
            for how in ways:
                trial = descent.trial(how)
                assert trial.nearest_m > -INSIDE_M, trial
        finally:
            descent.close()


def test_a_second_robot_in_the_cell_is_refused_and_its_pose_opens_no_region(tmp_path: Path) -> None:
    with Stack(tmp_path / "logs") as stack:
        descent = Descent(stack, tmp_path, "plane", np.random.default_rng(5))
        try:
            elsewhere = tmp_path / "elsewhere.yaml"
            text = write_task("plane", tmp_path).read_text()
            elsewhere.write_text(text.replace("- 0.5\n", "- 0.6\n", 1))
            second = stack.bring_up("robot", "second", "--task", elsewhere)
            refused = stack.until(
                lambda: stack.health(descent.fixture).refused.get("robot_state", 0) > 50
            )
            assert refused
            first = [r for r in descent.watcher.robot if r.envelope.source.instance == "robot"]
            assert min(map(descent.distance_m, first)) > -INSIDE_M
            stack.until(lambda: stack.health(second).detail == "standing: not_paired")
            assert json.dumps(stack.health(descent.fixture).healthy) == "true"
        finally:
            descent.close()
