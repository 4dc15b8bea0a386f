"""A stack with ROS 2 beside it, on a domain of its own that nobody else on the machine has."""

from __future__ import annotations

import random
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from hmcs.task import load_task
from hmcs_local.processes import StackProcess
from hmcs_ros2_bridge import robot
from hmcs_ros2_bridge.fields import header, twist
from hmcs_ros2_bridge.ros import Node, Topic
from support.fake_servo import FILE as SERVO
from support.stack import DEADLINE_S, Stack, clean_environment

LEAST_DOMAIN, LAST_DOMAIN = 10, 100
START = load_task("human-shapes").robot.tool_start_m
EVERY_S = 0.01
DEAD_MAN = 4
PATIENT = ("--silent-after-ms", 500, "--hang-s", 0.5, "--command-valid-for-ms", 500)
"""Of a robot whose way is looked at, not how soon it stops."""


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


def start_robot(stack: Stack, *flags: object) -> StackProcess:
    """Start the robot that a ROS controller moves."""
    return stack.start_program("robot", "arm", Path(robot.__file__), *PATIENT, *flags)


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
        import numpy as np

        while not self._ended.wait(EVERY_S):
            if self.silent:
                continue
            buttons = [0] * 8
            buttons[DEAD_MAN] = int(self.held)
            stamp = header(self._node.now_ns(), "base_link")
            self._joy.put({"header": stamp, "buttons": buttons, "axes": [0.0] * 6})
            velocity = np.array([*self.velocity, 0.0, 0.0, 0.0])
            self._twist.put({"header": stamp, "twist": twist(velocity)})
