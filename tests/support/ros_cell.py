"""A stack with ROS 2 beside it, on a domain of its own that nobody else on the machine has."""

from __future__ import annotations

import random
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hmcs.bus.messages import Command, RobotState
from hmcs.bus.session import Bus, Received
from hmcs.task import load_task
from hmcs_local.processes import StackProcess
from hmcs_robot.robots import ROBOTS
from hmcs_ros2_bridge import robot
from hmcs_ros2_bridge.fields import header, twist
from hmcs_ros2_bridge.ros import Node, Topic
from support.fake_joint_controller import FILE as JOINT_CONTROLLER
from support.fake_servo import FILE as SERVO
from support.stack import DEADLINE_S, Stack, clean_environment

LEAST_DOMAIN, LAST_DOMAIN = 10, 100
START = load_task("human-shapes").robot.tool_start_m
EVERY_S = 0.01
DEAD_MAN = 4
PATIENT = ("--silent-after-ms", 500, "--hang-s", 0.5, "--command-valid-for-ms", 500)
"""Of a robot whose way is looked at, not how soon it stops."""
SPEED = 0.05
"""m/s, of the tool in tests."""
VALID_NS = 500_000_000


@contextmanager
def ros_stack(folder: Path) -> Iterator[Stack]:
    """Open a stack whose processes, and this one, share a ROS domain at loopback."""
    with pytest.MonkeyPatch.context() as patch, Stack(folder) as stack:
        domain = random.SystemRandom().randint(LEAST_DOMAIN, LAST_DOMAIN)
        patch.setenv("ROS_DOMAIN_ID", str(domain))
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        yield stack


def start_servo(stack: Stack, delay_s: float = 0.03) -> StackProcess:
    """Start a fake servo, a process of its own."""
    process = StackProcess(
        "servo",
        "fake",
        [sys.executable, str(SERVO), str(delay_s), *map(str, START)],
        clean_environment(),
        stack.folder / f"{len(stack.processes)}-servo.log",
        stop_grace_s=DEADLINE_S,
    )
    stack.processes.append(process)
    return process


def start_joint_controller(stack: Stack, kind: str, start: Sequence[float]) -> StackProcess:
    """Start a fake joint controller of the PUMA 560, which begins at these joint positions."""
    process = StackProcess(
        "joints",
        "fake",
        [
            sys.executable,
            *(str(JOINT_CONTROLLER), kind, "0.03", str(ROBOTS["puma560"].urdf), "tool"),
            *map(str, start),
        ],
        clean_environment(),
        stack.folder / f"{len(stack.processes)}-joints.log",
        stop_grace_s=DEADLINE_S,
    )
    stack.processes.append(process)
    return process


def start_robot(stack: Stack, *flags: object) -> StackProcess:
    """Start the robot that a ROS controller moves."""
    return stack.start_program("robot", "arm", Path(robot.__file__), *PATIENT, *flags)


class Driver:
    """Commands on the bus as a fixture controller gives them, and what the robot says."""

    def __init__(self, stack: Stack) -> None:
        self.stack = stack
        self.bus: Bus = stack.open_bus("fixture_controller", "fixture")
        self.states: list[RobotState] = []
        self.engaged, self.twist, self.gives = False, np.zeros(6), True
        self._commands = self.bus.publisher(Command, self.bus.keys.command)
        self.bus.subscribe(RobotState, self.bus.keys.robot_state, self._heard)
        self.bus.every(0.01, self._give)
        stack.watch(self.bus)

    def until_following(self) -> None:
        """Let go, take hold, and wait until the robot moves."""
        self.engaged = False
        self.stack.until(lambda: self._newest_stop() == "disengaged")
        self.engaged = True
        self.stack.until(lambda: self._newest_stop() == "none" and self.moves())

    def moves(self) -> bool:
        return float(np.linalg.norm(self.states[-1].tool_twist[:3])) > 0.5 * SPEED

    def _newest_stop(self) -> str:
        return self.states[-1].stop if self.states else ""

    def _heard(self, received: Received[RobotState]) -> None:
        self.states.append(received.body)

    def _give(self) -> None:
        if self.gives:
            self._commands.put(
                Command(twist=self.twist, valid_for_ns=VALID_NS, engaged=self.engaged)
            )


class Listener:
    """A ROS node in this process that keeps the newest messages of topics."""

    def __init__(self, *topics: Topic) -> None:
        self.heard: dict[str, list[Any]] = {topic.name: [] for topic in topics}
        self._node = Node("listener")
        for topic in topics:
            self._node.subscribe(topic, self.heard[topic.name].append)
        self._node.start()

    def close(self) -> None:
        self._node.close()


class RosOperator:
    """A ROS node in this process that publishes Joy and TwistStamped while it is not `silent`."""

    def __init__(self, velocity: tuple[float, float, float]) -> None:
        self.velocity = velocity
        self.held = True
        self.silent = False
        self._node = Node("operator")
        self._joy = self._node.publisher(Topic("joy", "sensor_msgs/Joy", "sensor"))
        self._twist = self._node.publisher(
            Topic("operator", "geometry_msgs/TwistStamped", "sensor")
        )
        self._node.start()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._go, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._ended.set()
        self._thread.join(DEADLINE_S)
        self._node.close()

    def _go(self) -> None:
        while not self._ended.wait(EVERY_S):
            if self.silent:
                continue
            buttons = [0] * 8
            buttons[DEAD_MAN] = int(self.held)
            stamp = header(self._node.now_ns(), "base_link")
            self._joy.put({"header": stamp, "buttons": buttons, "axes": [0.0] * 6})
            velocity = np.array([*self.velocity, 0.0, 0.0, 0.0])
            self._twist.put({"header": stamp, "twist": twist(velocity)})
