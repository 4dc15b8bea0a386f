"""The control room as a process of its own, a child of the robot's service.

Started as `python -m hmcs_robot.control_process FD`, FD being its end of the channel. It reads its
settings there, says that it is ready or why it is not, and then moves the arm until the other end
is closed, whatever the reason: the arm then comes to a stand, and the process ends.
"""

from __future__ import annotations

import gc
import json
import os
import select
import signal
import socket
import sys
import time

from hmcs.arms.fence import Fence
from hmcs.errors import UserError
from hmcs.fixtures.regions.tool_shape import tool_shape_of
from hmcs.fixtures.regions.workspace import regions_of
from hmcs.task import Task, load_task
from hmcs_robot.channel import Channel, Closed, pack_snapshot, requests
from hmcs_robot.control_loop import ControlLoop, Rules
from hmcs_robot.driver import ArmDriver
from hmcs_robot.set_up import limits_of, policy_of, simulated, tuning_of
from hmcs_robot.settings import RobotSettings

NS_PER_S = 1_000_000_000
SLOWED_M = 0.05
"""Beyond what a tool at full speed needs to slow down before a region."""
REST_SHARE = 0.05
"""A control room that cannot keep its rate leaves this share of the time to everybody else."""
STANDS_WITHIN_S = 0.5
"""For so long the arm is brought to a stand after the other room has gone."""


def main(argv: list[str]) -> int:
    """Be the control room; return the exit code."""
    # The other room ends this process by closing the channel, also when a terminal interrupts both.
    for name in (signal.SIGINT, signal.SIGTERM):
        signal.signal(name, signal.SIG_IGN)
    channel = Channel(socket.socket(fileno=int(argv[1])))
    try:
        settings = RobotSettings.model_validate_json(_first(channel))
        try:
            task = load_task(settings.task)
            driver = simulated(task, settings)
            rules = rules_of(task, driver, settings)
        except UserError as error:
            channel.send(json.dumps({"mistake": str(error)}).encode())
            return 2
        priority = take_priority(settings.realtime_priority)
        gc.collect()
        gc.freeze()
        gc.disable()
        ready = {
            "priority": priority,
            "joint_names": driver.joint_names,
            "links_within": driver.links_within,
            "engine": driver.engine_name,
        }
        channel.send(json.dumps({"ready": ready}).encode())
        try:
            _run(channel, ControlLoop(driver, rules, time.monotonic_ns()), settings)
        finally:
            driver.close()
    except Closed:
        pass
    return 0


def rules_of(task: Task, driver: ArmDriver, settings: RobotSettings) -> Rules:
    """Return what bounds a robot in its task.

    Raises RegionError for a forbidden region that cannot be.
    """
    limits = limits_of(task, driver, settings)
    fence = Fence(
        regions_of(task), tool_shape_of(task), limits.speed_m_s / limits.braking_per_s + SLOWED_M
    )
    period_ns = round(NS_PER_S / settings.physics_rate_hz)
    return Rules(limits, tuning_of(settings), policy_of(settings), fence, period_ns)


def take_priority(realtime_priority: int) -> str:
    """Let this process go before others, as far as its user may; return what it got."""
    if realtime_priority:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(realtime_priority))
            return f"real-time, SCHED_FIFO {realtime_priority}"
        except (AttributeError, OSError):
            pass
        try:
            return f"nice {os.nice(-10)}"
        except OSError:
            pass
    return "as any other process"


def _run(channel: Channel, loop: ControlLoop, settings: RobotSettings) -> None:
    cycles_per_state = max(1, round(settings.physics_rate_hz / settings.state_rate_hz))
    cycles, last_stop = cycles_per_state, ""
    until_ns: int | None = None
    while until_ns is None or time.monotonic_ns() < until_ns:
        begun_ns = time.monotonic_ns()
        if until_ns is None:
            try:
                loop.take(requests(channel), begun_ns)
            except Closed:
                # Nothing is fresh from here on: the arm comes to a stand by itself.
                until_ns = begun_ns + round(STANDS_WITHIN_S * NS_PER_S)
        cycles += loop.tick(time.monotonic_ns())
        if cycles >= cycles_per_state or loop.stop != last_stop:
            cycles, last_stop = 0, loop.stop
            if until_ns is None:
                try:
                    channel.send(pack_snapshot(loop.snapshot()))
                except Closed:
                    continue
        now_ns = time.monotonic_ns()
        rest_ns = max(loop.due_ns - now_ns, round(REST_SHARE * (now_ns - begun_ns)))
        time.sleep(max(rest_ns, 0) / NS_PER_S)


def _first(channel: Channel) -> bytes:
    select.select([channel.fileno()], [], [])
    return channel.receive() or b""


if __name__ == "__main__":
    raise SystemExit(main(sys.argv))
