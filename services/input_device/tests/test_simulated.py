"""The source whose operator sees the robot."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs.motion.demonstrations import read_csv
from hmcs.task import find_task, load_task
from hmcs_input_device.played import BUILT_IN
from hmcs_input_device.settings import InputDeviceSettings
from hmcs_input_device.simulated import Simulated
from hmcs_input_device.sources import LIVE, DeviceSample, open_source

LINES = load_task("lines-through-obstacles")
LINES_CSV = find_task("lines-through-obstacles").with_suffix(".csv")
TURNED = np.array(LINES.robot.tool_orientation_xyzw)
END = read_csv(LINES_CSV).positions[-1]


def opened(**settings: Any) -> Simulated:
    settings = {"demonstration": LINES_CSV, "lead_in_s": 0.5, **settings}
    source = open_source(
        InputDeviceSettings(task=LINES.name, source="simulated", **settings), LINES, BUILT_IN
    )
    assert isinstance(source, Simulated)
    return source


def led(source: Simulated, seconds: float, begin_s: float = 0.0) -> np.ndarray:
    """Where the source leads a robot that follows its hand, m, shape (T, 3)."""
    robot, trail = np.array(LINES.robot.tool_start_m), []
    for tick in range(round(seconds * source.rate_hz)):
        source.sees(robot, TURNED)
        sample = source.sample(begin_s + tick / source.rate_hz)
        if sample.dead_man:
            robot = robot + sample.velocity / source.rate_hz
        trail.append(robot)
    return np.array(trail)


def samples_at(source: Simulated, robot: np.ndarray, ticks: int) -> list[DeviceSample]:
    """What the source does while the robot stands where it is."""
    samples = []
    for tick in range(ticks):
        source.sees(robot, TURNED)
        samples.append(source.sample(tick / 100))
    return samples


def test_it_leads_a_robot_that_follows_to_the_end_and_rests_there() -> None:
    source = opened()
    trail = led(source, 20.0)
    assert np.linalg.norm(trail[-1] - END) < 0.01
    assert source.duration_s < 20.0
    assert not source.sample(20.0).dead_man


def test_a_robot_that_does_not_follow_is_steered_all_the_same() -> None:
    source = opened()
    samples = samples_at(source, np.array(LINES.robot.tool_start_m), 200)
    assert samples[-1].dead_man
    assert np.linalg.norm(samples[-1].velocity) > 0.02
    assert source.duration_s == LIVE


def test_the_hand_goes_as_far_as_its_velocity_says() -> None:
    source = opened()
    samples = samples_at(source, np.array(LINES.robot.tool_start_m), 300)
    moved = samples[-1].position - samples[0].position
    np.testing.assert_allclose(moved, sum(s.velocity for s in samples) / 100, atol=1e-9)


def test_it_waits_until_the_robot_is_seen() -> None:
    source = opened()
    assert not any(source.sample(tick / 100).dead_man for tick in range(200))
    source.sees(np.array(LINES.robot.tool_start_m), TURNED)
    assert source.sample(2.0).dead_man


@pytest.mark.parametrize("task", [LINES.name, "object-3d"])
def test_while_nobody_sees_the_robot_the_hand_rests(task: str) -> None:
    """Also a hand that leads the tool: what its sensor felt last is no force for ever."""
    start = np.array(load_task(task).robot.tool_start_m)
    source = open_source(
        InputDeviceSettings(
            task=task,
            source="simulated",
            lead_in_s=0.5,
            demonstration=find_task(task).with_suffix(".csv"),
        ),
        load_task(task),
        BUILT_IN,
    )
    assert samples_at(source, start, 300)[-1].dead_man
    unseen = [source.sample(3.0 + tick / 100) for tick in range(200)]
    assert 0.4 < sum(sample.dead_man for sample in unseen) / 100 < 0.6
    np.testing.assert_array_equal(unseen[-1].velocity, np.zeros(3))
    np.testing.assert_array_equal(unseen[-1].position, unseen[60].position)
    source.sees(start, TURNED)
    again = source.sample(5.0)
    assert again.dead_man
    assert np.linalg.norm(again.position - unseen[-1].position) < 0.01


def test_a_process_that_hung_does_not_jump() -> None:
    source = opened()
    before = samples_at(source, np.array(LINES.robot.tool_start_m), 100)[-1]
    source.sees(np.array(LINES.robot.tool_start_m), TURNED)
    after = source.sample(5.0)
    assert np.linalg.norm(after.position - before.position) < 0.03


def test_operators_differ_and_equal_seeds_do_not() -> None:
    def hand(**settings: Any) -> np.ndarray:
        return led(opened(**settings), 4.0)

    np.testing.assert_array_equal(hand(seed=3), hand(seed=3))
    assert not np.array_equal(hand(seed=3), hand(seed=4))
    assert not np.array_equal(hand(operator="steady"), hand(operator="novice"))


def test_an_operator_nobody_knows_is_reported() -> None:
    with pytest.raises(ValueError, match="novice"):
        InputDeviceSettings(task=LINES.name, source="simulated", operator="expert")


def test_what_is_meant_has_to_fit_the_task(tmp_path: Any) -> None:
    file = tmp_path / "other.csv"
    file.write_text("time_s,x_m,y_m,z_m,state\n0,0,0,0,dance\n1,1,0,0,dance\n")
    with pytest.raises(UserError, match="dance"):
        opened(demonstration=file)


def test_a_hand_on_the_tool_is_where_the_tool_is_and_tells_its_force() -> None:
    task = load_task("object-3d")
    source = open_source(
        InputDeviceSettings(
            task=task.name,
            source="simulated",
            lead_in_s=0.5,
            demonstration=find_task(task.name).with_suffix(".csv"),
        ),
        task,
        BUILT_IN,
    )
    assert isinstance(source, Simulated)
    robot = np.array(task.robot.tool_start_m)
    turned = np.array(task.robot.tool_orientation_xyzw)
    for tick in range(3000):
        source.sees(robot, turned)
        sample = source.sample(tick / source.rate_hz)
        np.testing.assert_array_equal(sample.position, robot)
        if sample.dead_man:
            assert sample.wrench is not None
            robot = robot + sample.velocity / source.rate_hz
    end = read_csv(find_task(task.name).with_suffix(".csv")).positions[-1]
    assert np.linalg.norm(robot - end) < 0.01
