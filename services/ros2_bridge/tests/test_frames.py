"""Where transforms of ROS have the tool; messages as tf2_msgs has them."""

from __future__ import annotations

import importlib.util
import logging
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from hmcs.errors import UserError
from hmcs.task import load_task
from hmcs_ros2_bridge.arm_state import ArmReports
from hmcs_ros2_bridge.frames import MOST_FRAMES, Frames
from hmcs_ros2_bridge.robot_settings import RosRobotSettings
from hmcs_ros2_bridge.ros_arm import RosArm
from hmcs_ros2_bridge.tool_limits import fence_of, tool_limits_of

HALF = 0.5**0.5
QUARTER = (0.0, 0.0, HALF, HALF)
"""A quarter of a turn about z."""
UNTURNED = (0.0, 0.0, 0.0, 1.0)


def transform(
    parent: str, child: str, at: Any, turned: Any = UNTURNED, stamp_s: float = 1.0
) -> Any:
    seconds = int(stamp_s)
    stamp = SimpleNamespace(sec=seconds, nanosec=round((stamp_s - seconds) * 1e9))
    return SimpleNamespace(
        header=SimpleNamespace(frame_id=parent, stamp=stamp),
        child_frame_id=child,
        transform=SimpleNamespace(
            translation=SimpleNamespace(**dict(zip("xyz", at, strict=True))),
            rotation=SimpleNamespace(**dict(zip("xyzw", turned, strict=True))),
        ),
    )


def message(*transforms: Any) -> Any:
    return SimpleNamespace(transforms=list(transforms))


def test_a_frame_is_where_the_transforms_on_its_way_put_it() -> None:
    frames = Frames()
    frames.take(message(transform("tip", "tool", (0.1, 0.0, 0.0))), stays=True)
    assert frames.pose("tool", "base_link") is None
    frames.take(
        message(
            transform("/base_link", "/arm", (1.0, 2.0, 3.0), QUARTER, 5.25),
            transform("arm", "tip", (0.5, 0.0, 0.0), QUARTER, 4.5),
        ),
        stays=False,
    )
    found = frames.pose("tool", "base_link")
    assert found is not None
    pose, stamp_s = found
    # A quarter, then half a turn: along y, then back along x.
    np.testing.assert_allclose(pose.position, [0.9, 2.5, 3.0], atol=1e-12)
    np.testing.assert_allclose(np.abs(pose.orientation), [0.0, 0.0, 1.0, 0.0], atol=1e-9)
    assert stamp_s == 4.5


def test_frames_that_hang_on_themselves_or_never_move_say_nothing() -> None:
    frames = Frames()
    frames.take(
        message(transform("a", "b", (0, 0, 0)), transform("b", "a", (0, 0, 0))), stays=False
    )
    assert frames.pose("b", "base_link") is None
    frames.take(message(transform("base_link", "tool", (0, 0, 0))), stays=True)
    assert frames.pose("tool", "base_link") is None


def test_no_more_frames_are_kept_than_admitted() -> None:
    frames = Frames()
    many = [transform("base_link", f"f{k}", (0, 0, 0)) for k in range(MOST_FRAMES + 1)]
    frames.take(message(*many), stays=False)
    assert frames.pose(f"f{MOST_FRAMES - 1}", "base_link") is not None
    assert frames.pose(f"f{MOST_FRAMES}", "base_link") is None


def test_only_what_moves_the_tool_on_is_a_report() -> None:
    reports = ArmReports("base_link", tool_frame="tool")
    first = message(transform("base_link", "tool", (0.0, 0.0, 0.0), stamp_s=1.0))
    assert reports.take_transforms(first, 10, stay=False)
    reports.handled()
    camera = message(transform("base_link", "camera", (0.0, 0.0, 0.0), stamp_s=9.0))
    assert not reports.take_transforms(camera, 20, stay=False)
    assert not reports.take_transforms(first, 30, stay=False)
    assert reports.newest is not None
    assert reports.newest.heard_ns == 10, "a silent arm must not look alive"
    then = message(transform("base_link", "tool", (0.01, 0.0, 0.0), stamp_s=1.1))
    assert reports.take_transforms(then, 40, stay=False)
    np.testing.assert_allclose(reports.newest.twist, [0.1, 0, 0, 0, 0, 0], atol=1e-9)


@pytest.mark.parametrize(
    "wrong",
    [
        transform("base_link", "tool", (np.nan, 0.0, 0.0)),
        transform("base_link", "tool", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)),
        transform("base_link", "tool", (0.0, 0.0, 0.0), (np.inf, 0.0, 0.0, 1.0)),
    ],
)
def test_a_transform_that_cannot_be_is_refused(wrong: Any) -> None:
    reports = ArmReports("base_link", tool_frame="tool")
    assert not reports.take_transforms(message(wrong), 1, stay=False)
    assert reports.refusal.startswith("a transform ")
    assert reports.newest is None


def test_the_tools_frame_has_to_be_named() -> None:
    with pytest.raises(ValidationError, match="name the tool's frame as tool_link"):
        RosRobotSettings(tool_pose_from="tf")


@pytest.mark.skipif(importlib.util.find_spec("tf2_msgs") is not None, reason="tf2_msgs is here")
def test_without_tf2_msgs_the_remedy_is_told() -> None:
    settings = RosRobotSettings(tool_pose_from="tf", tool_link="tool")
    task = load_task("human-shapes")
    limits = tool_limits_of(task, 0.1, 2.0, 10.0)
    with pytest.raises(UserError, match=r"no wheel of tf2_msgs.*--tool-pose-from joints"):
        RosArm(settings, task, limits, fence_of(task, limits), logging.getLogger("test"))
