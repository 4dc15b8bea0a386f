"""The control room of the robot: at each tick one state of the arm, one motion, all limits.

It knows no wire. What the wire room hands over are small, already validated requests; nothing that
anybody sends can hold it up.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from hmcs.arms.control import Following, JointCommand, Standing, Tuning, follow, stand
from hmcs.arms.fence import Fence
from hmcs.arms.limits import Limits
from hmcs.supervision import (
    AT_ONCE,
    Policy,
    Supervision,
    accept,
    heard,
    stopped,
    tick,
    unpaired,
)
from hmcs_robot.channel import Numbered, Request, SignOfLife, Snapshot, StopAsked
from hmcs_robot.driver import ArmDriver

STILL_M_S = 1e-4
"""A reference slower than this, m/s and rad/s, has come to a stand."""
MOST_CYCLES = 24
"""So many periods are made up for in one tick; a robot farther behind lets them go."""


class Rules(NamedTuple):
    """What bounds a robot in its task."""

    limits: Limits
    tuning: Tuning
    policy: Policy
    fence: Fence
    period_ns: int
    """Of control and physics."""


class ControlLoop:
    """Moves an arm by the requests it is handed; times are ns of one monotonic clock."""

    def __init__(self, driver: ArmDriver, rules: Rules, now_ns: int) -> None:
        self._driver = driver
        self._rules = rules
        self._arm = driver.read()
        self._planes = rules.fence.planes(self._arm.tool)
        self._posture = self._arm.joint_positions
        self._supervision = Supervision()
        self._joint_command = JointCommand(np.zeros_like(self._posture), Standing(), ())
        self._done_ns = now_ns
        self._taken = -1
        self._taken_ns: int | None = None
        self._refused = self._refused_at_taken = 0
        self._late_ticks = self._late_orders = self._foreign_orders = 0

    @property
    def due_ns(self) -> int:
        """When the next tick is due."""
        return self._done_ns + self._rules.period_ns

    @property
    def stop(self) -> str:
        """Why the arm stands; `none` while it follows commands."""
        return self._supervision.stop

    def take(self, requests: Iterable[Request], now_ns: int) -> None:
        """Take over what the wire room has handed in."""
        for request in requests:
            match request:
                case Numbered():
                    self._accept(request, now_ns)
                case SignOfLife():
                    self._refused = request.refused
                    self._supervision = heard(self._supervision, now_ns, self._rules.policy)
                case StopAsked():
                    self._supervision = stopped(self._supervision)
                case _:
                    self._supervision = unpaired(self._supervision, request.writer)

    def tick(self, now_ns: int) -> int:
        """Do what is due at `now_ns`; return how many periods that were."""
        period_ns = self._rules.period_ns
        due = (now_ns - self._done_ns) // period_ns
        if due <= 0:
            return 0
        self._late_ticks += due > 1
        self._done_ns += due * period_ns
        for _ in range(min(due, MOST_CYCLES)):
            self._cycle(now_ns)
        return int(due)

    def snapshot(self) -> Snapshot:
        """Return what is to be said of the arm now."""
        arm, motion, distances = self._arm, self._joint_command, self._planes.distances
        margin_m = self._rules.fence.margin_m
        return Snapshot(
            arm.joint_positions,
            arm.joint_velocities,
            arm.tool.position,
            arm.tool.orientation,
            arm.tool_twist,
            motion.reference_twist,
            arm.nearest.name if arm.nearest else "",
            arm.nearest.distance_m if arm.nearest else None,
            arm.contacts,
            self._supervision.stop,
            motion.limited,
            float(distances.min()) + margin_m if len(distances) else None,
            self._late_ticks,
            self._command_age_s(),
            self._taken,
            self._late_orders,
            self._foreign_orders,
        )

    def _accept(self, numbered: Numbered, now_ns: int) -> None:
        self._supervision, verdict = accept(
            self._supervision, numbered.order, now_ns, self._rules.policy
        )
        if verdict == "accepted":
            self._taken, self._taken_ns = numbered.number, now_ns
            self._refused_at_taken = self._refused
        elif verdict == "late":
            self._late_orders += 1
        else:
            self._foreign_orders += 1

    def _command_age_s(self) -> float | None:
        if self._taken_ns is None:
            return None
        return max(self._done_ns - self._taken_ns, 0) / 1e9

    def _cycle(self, now_ns: int) -> None:
        self._supervision = tick(
            self._supervision,
            self._arm.contacts,
            now_ns,
            self._rules.policy,
            refused=self._refused > self._refused_at_taken,
        )
        self._joint_command = self._next_joint_command()
        self._driver.move(self._joint_command.joint_velocities)
        self._arm = self._driver.read()
        self._planes = self._rules.fence.planes(self._arm.tool)

    def _next_joint_command(self) -> JointCommand:
        stop, carried, rules = self._supervision.stop, self._joint_command.carried, self._rules
        braking = (
            isinstance(carried, Following)
            and stop not in AT_ONCE
            and float(np.abs(carried.twist).max()) > STILL_M_S
        )
        if stop != "none" and not braking:
            return stand(self._arm, carried, rules.tuning)
        return follow(
            self._arm,
            # Zero after a stop: the arm then comes to a stand within its acceleration limits.
            self._supervision.twist,
            carried,
            self._posture,
            rules.limits,
            rules.tuning,
            rules.period_ns / 1e9,
            self._planes,
        )
