"""ROS 2 over real rclpy: an operator drives, a robot follows and is stopped, nodes watch."""

from __future__ import annotations

import contextlib
import json
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: hmcs-ros2-bridge[ros], or one installed")

from hmcs.bus.messages import (
    Ask,
    Belief,
    FixtureState,
    Motion,
    RobotState,
    Step,
    StopRequest,
)
from hmcs.bus.session import RequestRefusedError
from hmcs.bus.verbs import LOOKS
from hmcs_local.processes import StackProcess
from hmcs_ros2_bridge.fields import twist_in
from hmcs_ros2_bridge.ros import Topic
from hmcs_ros2_bridge.service import TOPICS
from support.ros_cell import (
    SPEED,
    Driver,
    Listener,
    RosOperator,
    ros_stack,
    start_robot,
    start_servo,
)
from support.stack import Stack

COMMANDS = Topic("/servo_node/delta_twist_cmds", "geometry_msgs/TwistStamped", "reliable")


@pytest.fixture
def stack(tmp_path: Path) -> Iterator[Stack]:
    with ros_stack(tmp_path) as stack:
        yield stack


@pytest.fixture
def driver(stack: Stack) -> Driver:
    return Driver(stack)


def _driven(stack: Stack, driver: Driver, *flags: object) -> tuple[StackProcess, StackProcess]:
    servo, robot = start_servo(stack), start_robot(stack, *flags)
    stack.until_ready(robot)
    driver.twist = np.array([SPEED, 0.0, 0.0, 0.0, 0.0, 0.0])
    driver.until_following()
    return servo, robot


def test_a_robot_killed_in_motion_is_stopped_and_resumes_only_when_a_person_does(
    stack: Stack, driver: Driver
) -> None:
    listener = Listener(COMMANDS)
    sent = listener.heard[COMMANDS.name]
    servo, robot = _driven(stack, driver)
    assert driver.states[-1].joint_names == ("slide_x", "slide_y", "slide_z")
    # Nodes of ROS find each other in their own time.
    stack.until(lambda: sent)

    servo.send(signal.SIGKILL)
    stack.until(lambda: driver.states[-1].stop == "silent_arm")
    stack.until(lambda: not np.any(twist_in(sent[-1].twist)))
    assert "silent" in stack.health(robot).detail

    driver.states.clear()
    start_servo(stack)
    stack.until(lambda: len(driver.states) > 50 and stack.health(robot).healthy)
    assert all(state.stop != "none" for state in driver.states)
    driver.until_following()
    listener.close()


def test_a_ros_robot_looks_as_its_description_says(stack: Stack, driver: Driver) -> None:
    start_servo(stack)
    stack.until_ready(start_robot(stack))

    def looks() -> str:
        with contextlib.suppress(RequestRefusedError):
            for answer in LOOKS.ask(driver.bus, Ask(), timeout_s=2.0):
                return answer.body.urdf
        return ""

    assert "gantry" in stack.until(looks)


def test_commands_that_stay_out_and_stops_that_are_asked_for_stop_a_ros_robot(
    stack: Stack, driver: Driver
) -> None:
    _driven(stack, driver)
    driver.gives = False
    stack.until(lambda: driver.states[-1].stop == "stale_command")
    stack.until(lambda: not driver.moves())
    driver.gives = True
    driver.until_following()
    requests = driver.bus.publisher(StopRequest, driver.bus.keys.stop_request)
    requests.put(StopRequest(reason="a test"))
    stack.until(lambda: driver.states[-1].stop == "asked")
    driver.until_following()


def test_a_ros_robot_is_kept_out_of_what_is_forbidden_and_in_its_workspace(
    stack: Stack, driver: Driver, tmp_path: Path
) -> None:
    from hmcs.task import load_task

    task = load_task("human-shapes")
    wall_x = task.robot.tool_start_m[0] + 0.05
    region = {
        "name": "wall",
        "shape": "plane",
        "position_m": [wall_x, 0.0, 0.0],
        "normal": [-1.0, 0.0, 0.0],
    }
    data = task.model_dump(mode="json", exclude_none=True)
    data["workspace"]["forbidden"] = [region]
    file = tmp_path / "walled.yaml"
    file.write_text(json.dumps(data), encoding="utf-8")
    _driven(stack, driver, "--task", file)

    stack.until(lambda: "region" in driver.states[-1].limited and not driver.moves())
    stack.elapse(0.3)
    farthest = max(state.tool_position[0] for state in driver.states)
    assert wall_x - 0.02 < farthest < wall_x


def test_a_ros_operator_drives_once_the_dead_man_was_pressed_and_while_it_is_heard(
    stack: Stack,
) -> None:
    bus = stack.open_bus("fixture_controller", "fixture")
    motions: list[Motion] = []
    steps: list[Step] = []
    bus.subscribe(Motion, bus.keys.motion, lambda received: motions.append(received.body))
    bus.subscribe(Step, bus.keys.step, lambda received: steps.append(received.body))
    stack.watch(bus)
    operator = RosOperator((0.0, 0.1, 0.0))
    try:
        device = stack.bring_up("input_device", "device", "--source", "ros2")
        stack.until(lambda: "held since before" in stack.health(device).detail)
        assert not any(motion.dead_man for motion in motions)

        _press(stack, operator, motions)
        stack.until(lambda: steps)
        assert motions[-1].velocity == pytest.approx([0.0, 0.1, 0.0])
        assert steps[-1].displacement[1] > 0.005

        operator.silent = True
        stack.until(lambda: not motions[-1].dead_man)
        operator.silent = False
        motions.clear()
        stack.until(lambda: len(motions) > 30)
        assert not any(motion.dead_man for motion in motions), "no one pressed it anew"
        _press(stack, operator, motions)
    finally:
        operator.close()


def test_from_a_ros_operator_to_a_ros_robot_through_the_stack(stack: Stack) -> None:
    bus = stack.open_bus("watcher", "w")
    states: list[RobotState] = []
    motions: list[Motion] = []
    bus.subscribe(RobotState, bus.keys.robot_state, lambda received: states.append(received.body))
    bus.subscribe(Motion, bus.keys.motion, lambda received: motions.append(received.body))
    stack.watch(bus)
    start_servo(stack)
    operator = RosOperator((0.0, SPEED, 0.0))
    try:
        stack.until_ready(
            start_robot(stack),
            stack.start("input_device", "device", "--source", "ros2"),
            stack.start("fixture_controller", "fixture"),
        )
        operator.held = False
        stack.until(lambda: states and motions and states[-1].stop == "disengaged")
        begun = states[-1].tool_position.copy()

        def led_on() -> bool:
            # A press counts once the switch was seen released, and nodes of ROS find each other in
            # their own time: a person whose press does nothing lets go and presses again.
            operator.held = motions[-1].dead_man or time.monotonic() % 2.0 > 0.5
            return bool(states[-1].tool_position[1] - begun[1] > 0.03)

        stack.until(led_on)
        operator.held = False
        stack.until(lambda: states[-1].stop == "disengaged")
    finally:
        operator.close()


def test_ros_sees_the_cell(stack: Stack, model_file: Path) -> None:
    bus = stack.open_bus("robot", "r")
    stack.watch(bus)
    stack.bring_up("ros2_bridge", "bridge", "--models", json.dumps([str(model_file)]))
    topics = [topic._replace(name=topic.name.replace("~", "/hmcs")) for topic in TOPICS.values()]
    listener = Listener(*topics)
    publishers = (
        (bus.publisher(RobotState, bus.keys.robot_state), ROBOT_STATE),
        (bus.publisher(FixtureState, bus.keys.fixture_state), FIXTURE_STATE),
        (bus.publisher(Motion, bus.keys.motion), MOTION),
        (bus.publisher(Belief, bus.keys.belief("m", "i")), BELIEF),
    )

    def publish() -> None:
        for publisher, message in publishers:
            publisher.put(message)

    bus.every(0.02, publish)
    heard = listener.heard
    stack.until(lambda: all(heard.values()))
    stack.until(lambda: any(m.text or m.ns for a in heard["/hmcs/guides"] for m in a.markers))

    assert list(heard["/hmcs/joint_states"][-1].name) == ["a", "b"]
    assert heard["/hmcs/tool_pose"][-1].pose.position.z == pytest.approx(0.3)
    assert json.loads(heard["/hmcs/belief"][-1].data)["states"] == ["one", "two"]
    assert "workspace" in {marker.ns for marker in heard["/hmcs/scene"][-1].markers}
    stack.until(lambda: any(s.message == "two" for s in heard["/diagnostics"][-1].status))
    listener.close()


def _press(stack: Stack, operator: RosOperator, motions: list[Motion]) -> None:
    operator.held = False
    motions.clear()
    stack.until(lambda: len(motions) > 10)
    operator.held = True
    stack.until(lambda: motions and motions[-1].dead_man)


ROBOT_STATE = RobotState(
    robot="puma560",
    joint_names=("a", "b"),
    joint_positions=np.array([0.1, 0.2]),
    joint_velocities=np.zeros(2),
    tool_position=np.array([0.1, 0.2, 0.3]),
    tool_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
    tool_twist=np.zeros(6),
    reference_twist=np.zeros(6),
    nearest_obstacle="",
    nearest_distance_m=None,
    contacts=(),
    stop="none",
    limited=(),
)
FIXTURE_STATE = FixtureState(
    law="general",
    model="m",
    state="two",
    factor=0.5,
    compliance=0.4,
    preferred_direction=np.array([1.0, 0.0, 0.0]),
    progress=0.5,
    operator_twist=np.zeros(6),
    command_twist=np.zeros(6),
    wrench=np.zeros(6),
    engaged=True,
    reason="guiding",
)
MOTION = Motion(position=np.zeros(3), velocity=np.zeros(3), dead_man=True)
BELIEF = Belief(
    model_hash="h",
    clock="c",
    step=3,
    states=("one", "two"),
    probabilities=np.array([0.2, 0.8]),
    likely_gesteme="two",
    segment_start=0,
)
