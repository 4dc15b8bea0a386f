"""`python -m hmcs_ros2_bridge.robot`: a robot of the cell whose arm a ROS 2 controller moves.

On the bus it is a robot as any other, with the same rights and the same supervision; towards ROS it
publishes a TwistStamped, a JointTrajectory or joint velocities. It stops where its commands go
stale, where the arm is silent, where another node publishes on its topic, and after a hang of its
own; then only a deliberate re-engage of the operator moves it again. The arm's controller has to
stop by itself where commands stay out: that is what holds where this process dies.
"""

from __future__ import annotations

import logging
import time
from collections import deque
from dataclasses import replace
from statistics import median

from hmcs.bus.logs import RateLimitedLog
from hmcs.bus.messages import (
    Ask,
    Command,
    Done,
    Origin,
    Pairing,
    RobotDescription,
    RobotState,
    StopRequest,
)
from hmcs.bus.service import Service, run
from hmcs.bus.session import Bus, Received, RequestRefusedError
from hmcs.bus.verbs import LOOKS, STOP
from hmcs.driving import Pairings
from hmcs.supervision import (
    Order,
    Policy,
    Supervision,
    accept,
    heard,
    silent,
    stopped,
    tick,
    unpaired,
)
from hmcs.task import load_task
from hmcs_ros2_bridge.robot_settings import RosRobotSettings
from hmcs_ros2_bridge.ros_arm import RosArm
from hmcs_ros2_bridge.tool_limits import fence_of, tool_limits_of

OTHERS_EVERY_S = 0.5
"""How often other publishers on the command's topic are looked for."""
WAITS_KEPT = 1000
"""Commands of which it is kept how long they waited."""
_NS_PER_S = 1_000_000_000


class RosRobot(Service):
    """Follows the commands of one writer at a time, by way of a ROS 2 controller."""

    name = "robot"
    Settings = RosRobotSettings
    settings: RosRobotSettings

    def __init__(self, settings: RosRobotSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        self._task = load_task(settings.task)
        self._limits = tool_limits_of(
            self._task,
            settings.delay_s,
            settings.acceleration_limit_m_s2,
            settings.angular_acceleration_limit_rad_s2,
        )
        self._fence = fence_of(self._task, self._limits)
        self._policy = Policy(
            longest_valid_ns=round(settings.command_valid_for_ms * 1e6),
            late_tick_ns=round(settings.hang_s * 1e9),
            hang_ns=round(settings.hang_s * 1e9),
            settle_ns=round(settings.settle_s * 1e9),
        )
        self._limited_log = RateLimitedLog(log)
        self._supervision = Supervision()
        self._origin: Origin | None = None
        self._command_ns: int | None = None
        self._waits_ns: deque[int] = deque(maxlen=WAITS_KEPT)
        self._pairings = Pairings()
        self._trouble = "nothing was heard of the arm yet"
        self._others = 0
        self._told_stop = ""
        self._states = bus.publisher(RobotState, bus.keys.robot_state)
        self._arm = RosArm(settings, self._task, self._limits, self._fence, log)

    def start(self) -> None:
        """Listen on both sides."""
        bus = self.bus
        LOOKS.answer(bus, self._looks)
        STOP.answer(bus, self._on_stop)
        bus.subscribe(Command, bus.keys.command, self._on_command)
        bus.subscribe(StopRequest, bus.keys.stop_request, self._on_stop_request)
        bus.subscribe(Pairing, bus.keys.pairing, self._on_pairing)
        self._arm.start(bus.soon, self._publish_state)
        bus.every(1.0 / self.settings.command_rate_hz, self._on_tick)
        bus.every(OTHERS_EVERY_S, self._look_for_others)

    def health(self) -> tuple[bool, str]:
        """Return whether the arm is heard, and whether it follows or why it stands."""
        if self._trouble:
            return False, f"standing: {self._trouble}"
        if self._supervision.stop == "none":
            return True, "following commands"
        return True, f"standing: {self._supervision.stop}"

    def facts(self) -> dict[str, str]:
        """Return which robot this is, and the median time from a command to its message."""
        waits_ns = median(self._waits_ns) if self._waits_ns else 0
        return {
            "commands_wait_ms": f"{waits_ns / 1e6:.3f}",
            "robot": self._task.robot.name,
            "task": self._task.name,
            "states": ", ".join(state.name for state in self._task.states),
            "commands": self.settings.commanded_topic,
            "refused_reports": str(self._arm.reports.refused),
            "braking_per_s": f"{self._limits.braking_per_s:.2f}",
        }

    def close(self) -> None:
        """Bring the arm to a stand and leave ROS."""
        self._arm.close()

    # --- commands ---------------------------------------------------------------------------------

    def _on_command(self, received: Received[Command]) -> None:
        command, source = received.body, received.envelope.source
        now_s = received.received_ns / _NS_PER_S
        if other := self._pairings.other_than(self.bus.source.boot, source.boot, now_s):
            self._refuse(f"{source.service}/{source.instance} drives another robot: {other}")
            self._supervision = unpaired(self._supervision, source.boot)
            return
        now_ns = time.monotonic_ns()
        order = Order(
            writer=source.boot,
            twist=command.twist,
            valid_for_ns=command.valid_for_ns,
            engaged=command.engaged,
            received_ns=received.received_ns,
        )
        self._supervision, verdict = accept(self._supervision, order, now_ns, self._policy)
        if verdict == "late":
            self.bus.counters.late[Command.SCHEMA] += 1
        elif verdict == "second_writer":
            self._refuse("a second writer, while the first one is fresh")
        else:
            self._origin, self._command_ns = received.envelope.origin, received.received_ns
            self._supervise(now_ns)
            self._waits_ns.append(time.monotonic_ns() - received.received_ns)
            self._move(now_ns)

    def _on_pairing(self, received: Received[Pairing]) -> None:
        writer, now_s = received.envelope.source.boot, received.received_ns / _NS_PER_S
        self._pairings.heard(writer, received.body.robot, now_s)

    def _on_stop(self, _: Ask) -> Done:
        self._stop()
        return Done(detail="stands until the operator lets go and takes hold again")

    def _on_stop_request(self, received: Received[StopRequest]) -> None:
        source = received.envelope.source
        self.log.warning("asked to stand", extra={"by": f"{source.service}/{source.instance}"})
        self._stop()

    def _stop(self) -> None:
        self._supervision = stopped(self._supervision)
        self._move(time.monotonic_ns())

    def _refuse(self, reason: str) -> None:
        self.bus.counters.refused[Command.SCHEMA] += 1
        self._limited_log.warning("refused", "command refused", reason=reason)

    # --- control ----------------------------------------------------------------------------------

    def _on_tick(self) -> None:
        now_ns = time.monotonic_ns()
        self._supervision = heard(self._supervision, now_ns, self._policy)
        self._supervision = tick(self._supervision, (), now_ns, self._policy)
        self._supervise(now_ns)
        self._move(now_ns)
        if self._trouble:
            self._publish_state()

    def _supervise(self, now_ns: int) -> None:
        """Stop an arm that is not heard, or that somebody else moves."""
        before, self._trouble = self._trouble, self._trouble_at(now_ns)
        if self._trouble:
            stop = silent(self._supervision)
            self._supervision = replace(stop, stop="second_writer") if self._others > 0 else stop
        if self._trouble != before and self._trouble:
            self._limited_log.warning("arm", "the robot is stopped", reason=self._trouble)

    def _trouble_at(self, now_ns: int) -> str:
        if self._others > 0:
            return (
                f"{self._others} other publishers on {self.settings.commanded_topic}: end them, "
                "one alone may move the arm"
            )
        return self._arm.trouble_at(now_ns)

    def _look_for_others(self) -> None:
        self._others = self._arm.others()

    def _move(self, now_ns: int) -> None:
        if self._supervision.stop == "none":
            self._arm.move(self._supervision.twist, now_ns)
        else:
            self._arm.stand(now_ns)
        if self._supervision.stop != self._told_stop:
            self._told_stop = self._supervision.stop
            following = self._told_stop == "none"
            self.log.info(
                "following" if following else "standing",
                extra={} if following else {"reason": self._told_stop},
            )

    def _publish_state(self) -> None:
        arm = self._arm.reports.newest
        if arm is None:
            return
        following = self._supervision.stop == "none"
        age_ns = None if self._command_ns is None else time.monotonic_ns() - self._command_ns
        joints, led = self._arm.reports.joints, self._arm.led
        self._states.put(
            RobotState(
                robot=self._task.robot.name,
                joint_names=joints.names,
                joint_positions=joints.positions,
                joint_velocities=joints.velocities,
                tool_position=arm.pose.position,
                tool_orientation=arm.pose.orientation,
                tool_twist=arm.twist,
                reference_twist=led.twist,
                nearest_obstacle="",
                nearest_distance_m=None,
                contacts=(),
                stop=self._supervision.stop,
                limited=led.names,
                region_distance_m=self._fence.clearance_m(arm.pose)
                if self._fence.regions
                else None,
                command_age_s=None if age_ns is None else max(age_ns / _NS_PER_S, 0.0),
            ),
            self._origin if following else None,
        )

    def _looks(self, _: Ask) -> RobotDescription:
        if not self._arm.reports.urdf:
            raise RequestRefusedError(
                f"nothing was heard on {self.settings.robot_description_topic}: start a "
                "robot_state_publisher"
            )
        return RobotDescription(
            robot=self._task.robot.name,
            urdf=self._arm.reports.urdf,
            joints=self._arm.reports.joints.names,
            files={},
        )


if __name__ == "__main__":
    raise SystemExit(run(RosRobot))
