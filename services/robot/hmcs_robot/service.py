"""The robot on the bus: Command in, one control cycle a tick, RobotState out.

Any `ArmDriver` will do; the service is made with the simulated one.
"""

from __future__ import annotations

import logging
import math
import time

import numpy as np

from hmcs.bus.messages import Ask, Command, Done, Origin, RobotLooks, RobotState
from hmcs.bus.service import Service
from hmcs.bus.session import Bus, Received
from hmcs.task import load_task
from hmcs_robot.control import Motion, Standing, follow, stand
from hmcs_robot.driver import ArmDriver, ArmState
from hmcs_robot.set_up import limits_of, simulated, tuning_of
from hmcs_robot.settings import RobotSettings
from hmcs_robot.supervision import Order, Policy, Stop, Supervision, accept, stopped, tick

_NS_PER_S = 1_000_000_000


class Robot(Service):
    """Follows the commands of one writer at a time within the limits of the arm and the task."""

    name = "robot"
    Settings = RobotSettings
    settings: RobotSettings

    def __init__(self, settings: RobotSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        self._task = load_task(settings.task)
        self._period_ns = round(_NS_PER_S / settings.physics_rate_hz)
        self._driver: ArmDriver = simulated(self._task, settings)
        self._limits = limits_of(self._task, self._driver, settings)
        self._tuning = tuning_of(settings)
        self._policy = Policy(
            hang_ns=round(settings.hang_s * _NS_PER_S),
            settle_ns=round(settings.settle_s * _NS_PER_S),
        )
        self._arm = self._driver.read()
        self._posture = self._arm.joint_positions
        self._supervision = Supervision()
        self._motion = Motion(np.zeros_like(self._posture), Standing(), ())
        self._origin: Origin | None = None
        self._foreign = 0
        self._refused = 0
        self._done_ns = 0
        self._cycles_per_state = max(1, round(settings.physics_rate_hz / settings.state_rate_hz))
        self._cycles = 0
        self._told: Stop | None = None
        self._states = bus.publisher(RobotState, bus.keys.robot_state)

    def start(self) -> None:
        """Listen and begin to move."""
        self._done_ns = time.monotonic_ns()
        self.bus.answer("looks", Ask, self._looks)
        self.bus.answer("stop", Ask, self._stop)
        self.bus.subscribe(Command, self.bus.keys.command, self._on_command)
        self.bus.every(self._period_ns / _NS_PER_S, self._on_tick)

    def health(self) -> tuple[bool, str]:
        """Return that it is well, and whether the arm follows or why it stands."""
        stop = self._supervision.stop
        return True, "following commands" if stop == "none" else f"standing: {stop}"

    def facts(self) -> dict[str, str]:
        """Return which robot this is."""
        return {
            "robot": self._driver.name,
            "task": self._task.name,
            "physics_rate_hz": f"{self.settings.physics_rate_hz:g}",
            "speed_limit_m_s": f"{self._limits.speed_m_s:g}",
        }

    def close(self) -> None:
        """Let go of the arm."""
        self._driver.close()

    def _looks(self, _: Ask) -> RobotLooks:
        return RobotLooks(robot=self._driver.name, **self._driver.looks()._asdict())

    def _stop(self, _: Ask) -> Done:
        before = self._supervision.stop
        self._supervision = stopped(self._supervision)
        self._log_change(before)
        return Done(detail="stands until the operator lets go and takes hold again")

    def _on_command(self, received: Received[Command]) -> None:
        command = received.body
        order = Order(
            writer=received.envelope.source.boot,
            twist=command.twist,
            valid_for_ns=command.valid_for_ns,
            engaged=command.engaged,
            received_ns=received.received_ns,
        )
        before = self._supervision.stop
        self._supervision, verdict = accept(
            self._supervision, order, time.monotonic_ns(), self._policy
        )
        self._log_change(before)
        if verdict == "accepted":
            self._origin = received.envelope.origin
            self._refused = self._invalid()
        elif verdict == "late":
            self.bus.counters.count_late(Command.SCHEMA)
        else:
            self._foreign += 1
            source = received.envelope.source
            self.bus.counters.count_refused(
                Command.SCHEMA, f"{source.service}/{source.instance} is a second writer"
            )

    def _on_tick(self) -> None:
        now_ns = time.monotonic_ns()
        if now_ns - self._done_ns > self._policy.hang_ns:
            self._done_ns = now_ns - self._period_ns
        due = math.floor((now_ns - self._done_ns) / self._period_ns)
        for _ in range(due):
            self._cycle(now_ns)
        self._done_ns += due * self._period_ns
        stop = self._supervision.stop
        if due and (self._cycles >= self._cycles_per_state or stop != self._told):
            self._cycles, self._told = 0, stop
            following = stop == "none"
            state = _state(self._driver.name, self._arm, self._motion, self._supervision)
            self._states.put(state, self._origin if following else None)

    def _cycle(self, now_ns: int) -> None:
        before = self._supervision.stop
        self._supervision = tick(
            self._supervision,
            self._arm.contacts,
            now_ns,
            self._policy,
            refused=self._invalid() > self._refused,
        )
        self._log_change(before)
        if self._supervision.stop == "none":
            self._motion = follow(
                self._arm,
                self._supervision.twist,
                self._motion.carried,
                self._posture,
                self._limits,
                self._tuning,
                self._period_ns / _NS_PER_S,
            )
        else:
            self._motion = stand(self._arm, self._motion.carried, self._tuning)
        self._driver.move(self._motion.joint_velocities)
        self._arm = self._driver.read()
        self._cycles += 1

    def _invalid(self) -> int:
        """Return how many commands the wire has refused."""
        return self.bus.counters.refused[Command.SCHEMA] - self._foreign

    def _log_change(self, before: str) -> None:
        stop = self._supervision.stop
        if stop != before:
            self.log.info(
                "following" if stop == "none" else "standing",
                extra={} if stop == "none" else {"reason": stop},
            )


def _state(robot: str, arm: ArmState, motion: Motion, supervision: Supervision) -> RobotState:
    return RobotState(
        robot=robot,
        joint_positions=arm.joint_positions,
        joint_velocities=arm.joint_velocities,
        tool_position=arm.tool.position,
        tool_orientation=arm.tool.orientation,
        tool_twist=arm.tool_twist,
        reference_twist=motion.reference_twist,
        nearest_obstacle=arm.nearest.name if arm.nearest else "",
        nearest_distance_m=arm.nearest.distance_m if arm.nearest else None,
        contacts=arm.contacts,
        stop=supervision.stop,
        limited=motion.limited,
    )
