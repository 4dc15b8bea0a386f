"""The bridge to ROS 2 at 100 commands a second: how long it takes, beside a plain hop of rclpy, and
whether it grows."""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import psutil
from rich.progress import Progress

from bench.figures import Figure, percentile_ms
from hmcs.bus.messages import Ask, Command
from hmcs.bus.session import Bus
from hmcs.bus.verbs import DESCRIBE
from hmcs_local.processes import StackProcess
from hmcs_ros2_bridge.fields import header, pose
from hmcs_ros2_bridge.ros import Node, Topic
from support.ros_cell import SPEED, START, RosOperator, ros_stack, start_robot, start_servo
from support.ros_talker import FILE as TALKER
from support.ros_talker import PLAIN
from support.stack import DEADLINE_S, Stack, clean_environment

RATIO = 1.5
"""Times a plain hop that the bridge may take, from a Command's arrival to that of ROS' message."""
MOST_GROWTH_MB = 2.0
RATE_HZ = 100.0
LATENCY_S = 20.0
SETTLES_SHARE = 0.25
"""What is loaded in the first part of the time is no growth."""
COMMANDS = Topic("/servo_node/delta_twist_cmds", "geometry_msgs/TwistStamped", "reliable")
_MARK_M_S = 1e-6
_MARKS = 1000


class Times(NamedTuple):
    """Durations, ns."""

    whole: list[int]
    """From a command's publication on the bus to the arrival of the bridge's message."""
    ros: list[int]
    """Of that from the stamp of the message on, which the bridge then makes and publishes."""
    plain: list[int]
    """Of a plain hop of ROS in the same process."""


def measure(minutes: float, progress: Progress) -> list[Figure]:
    """Measure both hops at the same time, then what the bridge's processes hold for so long."""
    with tempfile.TemporaryDirectory(prefix="hmcs-ros2-") as name, ros_stack(Path(name)) as stack:
        bus = stack.open_bus("fixture_controller", "fixture")
        stack.watch(bus)
        robot = start_robot(stack)
        talker = _start_talker(stack)
        figures = _latency(stack, bus, robot, progress)
        talker.stop()
        start_servo(stack)
        return [*figures, *_growth(stack, robot, 60.0 * minutes, progress)]


def _latency(stack: Stack, bus: Bus, robot: StackProcess, progress: Progress) -> list[Figure]:
    sent_ns: dict[int, int] = {}
    times = Times([], [], [])
    node = Node("measures")

    def on_command(message: Any) -> None:
        then_ns = sent_ns.pop(round(message.twist.linear.x / _MARK_M_S), None)
        if then_ns is not None:
            times.whole.append(time.monotonic_ns() - then_ns)
            times.ros.append(time.time_ns() - _stamped_ns(message))

    def on_plain(message: Any) -> None:
        times.plain.append(time.monotonic_ns() - _stamped_ns(message))

    node.subscribe(COMMANDS, on_command)
    node.subscribe(PLAIN, on_plain)
    poses = node.publisher(Topic("/tool_pose", "geometry_msgs/PoseStamped", "sensor"))
    node.start()

    def say_pose() -> None:
        # Each topic has one reader alone: a publisher takes longer for each more.
        stamp = header(node.now_ns(), "base_link")
        poses.put({"header": stamp, "pose": pose(START, (1.0, 0.0, 0.0, 0.0))})

    posing = bus.every(1.0 / RATE_HZ, say_pose)
    stack.until_ready(robot)
    _command_always(bus, lambda mark: sent_ns.update({mark: time.monotonic_ns()}))
    stack.until(lambda: times.whole and times.plain)
    _elapse(stack, LATENCY_S, progress.add_task("bridge and plain hop", total=LATENCY_S), progress)
    posing.cancel()
    node.close()
    (described,) = DESCRIBE.ask(bus, Ask(), service="robot", instance=robot.instance)
    within_ms = float(described.body.facts["commands_wait_ms"])
    plain_ms, ros_ms = percentile_ms(times.plain, 50), percentile_ms(times.ros, 50)
    return [
        Figure("a plain rclpy hop, p50", plain_ms, "ms"),
        Figure("from a Command's arrival until the arm is told, p50", within_ms, "ms"),
        Figure("from there to a subscriber of ROS, p50", ros_ms, "ms"),
        Figure("both / a plain hop", (within_ms + ros_ms) / plain_ms, at_most=RATIO),
        Figure("from a Command's publication on, bus and all, p50",
               percentile_ms(times.whole, 50), "ms"),
        Figure("commands that came through", float(len(times.whole)), ""),
    ]  # fmt: skip


def _growth(stack: Stack, robot: StackProcess, span_s: float, progress: Progress) -> list[Figure]:
    """Watch the robot, the process that shows the cell, and the operator's device."""
    operator = RosOperator((0.0, SPEED, 0.0))
    watched = {
        "robot": robot,
        "what ROS watches": stack.bring_up("ros2_bridge", "bridge"),
        "operator": stack.bring_up("input_device", "device", "--source", "ros2"),
    }
    task = progress.add_task("memory", total=span_s)
    _elapse(stack, SETTLES_SHARE * span_s, task, progress)
    settled_mb = {name: _held_mb(process) for name, process in watched.items()}
    _elapse(stack, (1.0 - SETTLES_SHARE) * span_s, task, progress)
    held_mb = {name: _held_mb(process) for name, process in watched.items()}
    operator.close()
    taken = sum(stack.health(robot).received.values())
    figures = [Figure("messages that the robot took in all", float(taken))]
    for name, mb in held_mb.items():
        figures += [
            Figure(f"{name}, held after the first quarter", settled_mb[name], "MB"),
            Figure(f"{name}, growth since", mb - settled_mb[name], "MB", at_most=MOST_GROWTH_MB),
        ]
    return figures


def _command_always(bus: Bus, note: Callable[[int], None]) -> None:
    """Command all the time, each command with a mark that is told before."""
    commands = bus.publisher(Command, bus.keys.command)
    count = 0

    def command() -> None:
        nonlocal count
        count += 1
        mark = count % _MARKS
        twist = np.array([mark * _MARK_M_S, 0.0, 0.0, 0.0, 0.0, 0.0])
        # Let go of for a moment once in a while, so that a stop of a busy machine is no end.
        engaged = mark > 10
        note(mark)
        commands.put(Command(twist=twist, valid_for_ns=500_000_000, engaged=engaged))

    bus.every(1.0 / RATE_HZ, command)


def _elapse(stack: Stack, span_s: float, task: Any, progress: Progress) -> None:
    began_s = done_s = time.monotonic()
    while time.monotonic() - began_s < span_s:
        stack.elapse(0.5)
        progress.advance(task, time.monotonic() - done_s)
        done_s = time.monotonic()


def _stamped_ns(message: Any) -> int:
    stamp = message.header.stamp
    return int(stamp.sec * 1_000_000_000 + stamp.nanosec)


def _start_talker(stack: Stack) -> StackProcess:
    process = StackProcess(
        "talker",
        "plain",
        [sys.executable, str(TALKER)],
        clean_environment(),
        stack.folder / "talker.log",
        stop_grace_s=DEADLINE_S,
    )
    stack.processes.append(process)
    return process


def _held_mb(process: StackProcess) -> float:
    return float(psutil.Process(process.pid).memory_info().rss) / 1e6
