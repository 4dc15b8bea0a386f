"""The bridge to ROS 2 at 100 commands a second: how long it takes, beside a plain hop of rclpy, and
whether it grows."""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from rich.progress import Progress

from bench.figures import Figure, percentile_ms
from hmcs.bus.messages import Command
from hmcs_local.processes import StackProcess
from hmcs_ros2_bridge.ros import Node, Topic
from support.ros_cell import ros_stack, start_robot, start_servo
from support.ros_talker import FILE as TALKER
from support.ros_talker import PLAIN
from support.stack import DEADLINE_S, Stack, clean_environment

RATIO = 1.5
MOST_GROWTH_MB = 2.0
RATE_HZ = 100.0
SETTLES_SHARE = 0.25
"""What is loaded in the first part of the time is no growth."""
COMMANDS = Topic("/servo_node/delta_twist_cmds", "geometry_msgs/TwistStamped", "reliable")
_MARK_M_S = 1e-6
_MARKS = 1000


def measure(minutes: float, progress: Progress) -> list[Figure]:
    """Measure both hops at the same time for so long."""
    with tempfile.TemporaryDirectory(prefix="hmcs-ros2-") as name, ros_stack(Path(name)) as stack:
        return _measured(stack, 60.0 * minutes, progress)


def _measured(stack: Stack, span_s: float, progress: Progress) -> list[Figure]:
    bus = stack.open_bus("fixture_controller", "fixture")
    stack.watch(bus)
    robot = start_robot(stack)
    start_servo(stack)
    _start_talker(stack)
    stack.until_ready(robot)
    sent_ns: dict[int, int] = {}
    bridged_ns: list[int] = []
    plain_ns: list[int] = []
    ros_ns: list[int] = []
    node = Node("measures")

    def on_command(message: Any) -> None:
        then_ns = sent_ns.pop(round(message.twist.linear.x / _MARK_M_S), None)
        if then_ns is not None:
            now_ns = time.monotonic_ns()
            bridged_ns.append(now_ns - then_ns)
            stamp = message.header.stamp
            stamped_ns = stamp.sec * 1_000_000_000 + stamp.nanosec
            ros_ns.append(time.time_ns() - stamped_ns)

    def on_plain(message: Any) -> None:
        stamp = message.header.stamp
        plain_ns.append(time.monotonic_ns() - stamp.sec * 1_000_000_000 - stamp.nanosec)

    node.subscribe(COMMANDS, on_command)
    node.subscribe(PLAIN, on_plain)
    node.start()
    commands = bus.publisher(Command, bus.keys.command)
    count = 0

    def command() -> None:
        nonlocal count
        count += 1
        mark = count % _MARKS
        sent_ns[mark] = time.monotonic_ns()
        twist = np.array([mark * _MARK_M_S, 0.0, 0.0, 0.0, 0.0, 0.0])
        # Let go of for a moment once in a while, so that a stop of a busy machine is no end.
        engaged = mark > 10
        commands.put(Command(twist=twist, valid_for_ns=500_000_000, engaged=engaged))

    bus.every(1.0 / RATE_HZ, command)
    stack.until(lambda: bridged_ns and plain_ns)
    task = progress.add_task("bridge and plain hop", total=span_s)
    process = psutil.Process(robot.pid)
    began_s = time.monotonic()
    settled_mb = 0.0
    while (elapsed_s := time.monotonic() - began_s) < span_s:
        if not settled_mb and elapsed_s > SETTLES_SHARE * span_s:
            settled_mb = _megabytes(process)
        stack.elapse(0.5)
        progress.update(task, completed=elapsed_s)
    grown_mb = _megabytes(process) - settled_mb
    node.close()
    bridged_ms, plain_ms = percentile_ms(bridged_ns, 50), percentile_ms(plain_ns, 50)
    return [
        Figure("a plain rclpy hop, p50", plain_ms, "ms"),
        Figure("Command to ROS by the bridge, p50", bridged_ms, "ms"),
        Figure("of that from its publication on, p50", percentile_ms(ros_ns, 50), "ms"),
        Figure("the one / the other", bridged_ms / plain_ms, at_most=RATIO),
        Figure("commands that came through", float(len(bridged_ns)), ""),
        Figure("growth after the first quarter", grown_mb, "MB", at_most=MOST_GROWTH_MB),
    ]


def _start_talker(stack: Stack) -> None:
    process = StackProcess(
        "talker",
        "plain",
        [sys.executable, str(TALKER)],
        clean_environment(),
        stack.folder / "talker.log",
        stop_grace_s=DEADLINE_S,
    )
    stack.processes.append(process)


def _megabytes(process: psutil.Process) -> float:
    return float(process.memory_info().rss) / 1e6
