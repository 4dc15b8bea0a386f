from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hmcs.arms.state import Pose
from hmcs.fixtures.regions.forbidden import Plane, Region
from hmcs.task import load_task
from hmcs_ros2_bridge.tool_limits import (
    Limited,
    admitted,
    braking_for,
    fence_of,
    tool_limits_of,
)

TASK = load_task("human-shapes")
START = np.array(TASK.robot.tool_start_m)
UPRIGHT = np.array([0.0, 0.0, 0.0, 1.0])
PERIOD_S = 0.01


def limited(
    twist: np.ndarray,
    before: np.ndarray,
    elapsed_s: float,
    position: np.ndarray = START,
    delay_s: float = 0.1,
    regions: tuple[Region, ...] = (),
) -> Limited:
    limits = tool_limits_of(TASK, delay_s, 2.0, 10.0)
    fence = replace(fence_of(TASK, limits), regions=regions)
    return admitted(twist, Pose(position, UPRIGHT), before, limits, fence, elapsed_s)


@given(arrays(float, 6, elements=st.floats(-1e6, 1e6)))
def test_nothing_is_faster_than_the_task_allows(twist: np.ndarray) -> None:
    led = limited(twist, np.zeros(6), 10.0).twist
    assert np.linalg.norm(led[:3]) <= TASK.robot.speed_limit_m_s * (1 + 1e-9)
    assert np.linalg.norm(led[3:]) <= TASK.robot.angular_speed_limit_rad_s * (1 + 1e-9)


def test_it_sets_out_within_its_acceleration_and_stops_at_once() -> None:
    fast = np.array([0.2, 0, 0, 0, 0, 0])
    first = limited(fast, np.zeros(6), PERIOD_S)
    assert first.twist[0] == pytest.approx(2.0 * PERIOD_S)
    assert first.names == ("acceleration",)
    assert not limited(np.zeros(6), fast, PERIOD_S).twist.any()


@pytest.mark.parametrize("delay_s", [0.01, 0.05, 0.1, 0.2])
@pytest.mark.parametrize("kind", ["wall", "region"])
def test_a_late_robot_does_not_overshoot_a_wall_or_a_region(delay_s: float, kind: str) -> None:
    end, regions = TASK.workspace.upper_m[0], ()
    if kind == "region":
        end = START[0] + 0.05
        regions = (Plane(np.array([end, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0])),)
    late = round(delay_s / PERIOD_S)
    places, twist = [START] * (late + 1), np.zeros(6)
    for _ in range(1500):
        wanted = np.array([0.25, 0, 0, 0, 0, 0])
        led = limited(wanted, twist, PERIOD_S, places[-1 - late], delay_s, regions)
        twist = led.twist
        places.append(places[-1] + twist[:3] * PERIOD_S)
    farthest = max(place[0] for place in places)
    assert end - 0.02 < farthest <= end
    assert ("workspace" if kind == "wall" else "region") in led.names


def test_the_longer_the_delay_the_earlier_the_tool_slows_down() -> None:
    assert braking_for(0.2) < braking_for(0.1) < braking_for(0.001)
