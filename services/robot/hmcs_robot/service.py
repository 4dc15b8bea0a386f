"""The robot on the bus: Command in, RobotState out; the arm itself is moved by a process beside it.

This is the wire room. It decodes what anybody sends, answers questions, and hands the control room
nothing but small, valid orders. Whatever happens here, the control room keeps its rate, its limits
and its regions, and without fresh orders it comes to a stand.
"""

from __future__ import annotations

import logging
import threading
from collections import OrderedDict

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
from hmcs.bus.service import Service
from hmcs.bus.session import Bus, Received, RequestRefusedError
from hmcs.bus.verbs import LOOKS, STOP
from hmcs.driving import Pairings
from hmcs.supervision import Order
from hmcs.task import load_task
from hmcs_robot.arm_description import arm_description
from hmcs_robot.channel import (
    Closed,
    Snapshot,
    pack_order,
    pack_sign,
    pack_stop,
    pack_unpaired,
    writer_id,
)
from hmcs_robot.control_room import ControlRoom, ControlRoomError
from hmcs_robot.description.described import describe
from hmcs_robot.robots import model_of
from hmcs_robot.settings import RobotSettings

SIGN_EVERY_S = 0.02
"""How often the control room gets a sign of life."""
ORIGINS_KEPT = 256
"""Orders whose operator sample is remembered until the control room says that it took them."""
MOST_NOTES = 40
"""What an arm's file leaves out, said at the start; `hmcs robot check` says all."""
NS_PER_S = 1_000_000_000


class Robot(Service):
    """Follows the commands of one writer at a time within the limits of the arm and the task."""

    name = "robot"
    Settings = RobotSettings
    settings: RobotSettings

    def __init__(self, settings: RobotSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        self._task = load_task(settings.task)
        self._arm = describe(model_of(self._task.robot))
        self._limited = RateLimitedLog(log)
        self._room = ControlRoom(settings, log)
        self._lock = threading.Lock()
        self._waiting: Snapshot | None = None
        self._snapshot: Snapshot | None = None
        self._origins: OrderedDict[int, Origin | None] = OrderedDict()
        self._pairings = Pairings()
        self._joint_names = self._room.joint_names
        self._number = 0
        self._foreign_refusals = 0
        """Refusals that say nothing of the writer that is followed."""
        self._ended = False
        self._states = bus.publisher(RobotState, bus.keys.robot_state)

    def start(self) -> None:
        """Listen and begin to move."""
        bus = self.bus
        LOOKS.answer(bus, self._robot_description)
        STOP.answer(bus, self._on_stop)
        bus.subscribe(Command, bus.keys.command, self._on_command)
        bus.subscribe(StopRequest, bus.keys.stop_request, self._on_stop_request)
        bus.subscribe(Pairing, bus.keys.pairing, self._on_pairing)
        if self._room.links_within:
            self.log.warning(
                "links that reach into a forbidden region at the start are not kept out of it",
                extra={"links": ", ".join(self._room.links_within)},
            )
        for note in self._arm.notes[:MOST_NOTES]:
            self.log.warning(f"{self._arm.urdf.file}:{note.line}: {note.message}")
        bus.every(SIGN_EVERY_S, self._give_sign)
        self._room.read(self._take_snapshot, lambda: bus.soon(self._on_end))

    def health(self) -> tuple[bool, str]:
        """Return whether the arm is controlled, and whether it follows or why it stands."""
        snapshot = self._snapshot
        if self._ended:
            return False, "the control process has ended"
        if snapshot is None:
            return True, "the arm has not moved yet"
        if snapshot.stop == "none":
            return True, "following commands"
        return True, f"standing: {snapshot.stop}"

    def facts(self) -> dict[str, str]:
        """Return which robot this is."""
        return {
            "robot": self._task.robot.name,
            "task": self._task.name,
            "states": ", ".join(state.name for state in self._task.states),
            "engine": self._room.engine,
            "physics_rate_hz": f"{self.settings.physics_rate_hz:g}",
            "speed_limit_m_s": f"{self._task.robot.speed_limit_m_s:g}",
            "links_not_kept_out": ", ".join(self._room.links_within),
            "control_priority": self._room.priority,
            "late_ticks": str(self._snapshot.late_ticks if self._snapshot else 0),
        }

    def close(self) -> None:
        """Bring the arm to a stand and let go of it."""
        self._room.close()

    # --- towards control --------------------------------------------------------------------------

    def _on_command(self, received: Received[Command]) -> None:
        command, source = received.body, received.envelope.source
        now_s = received.received_ns / NS_PER_S
        if other := self._pairings.other_than(self.bus.source.boot, source.boot, now_s):
            self._refuse(f"{source.service}/{source.instance} drives another robot: {other}")
            self._hand_over(pack_unpaired(writer_id(source.boot)))
            return
        order = Order(
            writer=writer_id(source.boot),
            twist=command.twist,
            valid_for_ns=command.valid_for_ns,
            engaged=command.engaged,
            received_ns=received.received_ns,
        )
        self._number += 1
        self._origins[self._number] = received.envelope.origin
        if len(self._origins) > ORIGINS_KEPT:
            self._origins.popitem(last=False)
        self._hand_over(pack_order(self._number, order))

    def _on_pairing(self, received: Received[Pairing]) -> None:
        writer, now_s = received.envelope.source.boot, received.received_ns / NS_PER_S
        self._pairings.heard(writer, received.body.robot, now_s)

    def _on_stop(self, _: Ask) -> Done:
        if self._ended or not self._hand_over(pack_stop()):
            raise RequestRefusedError(
                "the control process does not take the stop: it hangs or has ended. Cut the power"
            )
        return Done(
            detail="stands until the operator lets go and takes hold again; an operator that is "
            "played or simulated waits for `hmcs play`"
        )

    def _on_stop_request(self, received: Received[StopRequest]) -> None:
        source = received.envelope.source
        self.log.warning("asked to stand", extra={"by": f"{source.service}/{source.instance}"})
        self._hand_over(pack_stop())

    def _give_sign(self) -> None:
        refused = self.bus.counters.refused[Command.SCHEMA] - self._foreign_refusals
        self._hand_over(pack_sign(refused))

    def _hand_over(self, data: bytes) -> bool:
        try:
            return self._room.channel.send(data)
        except Closed:
            self._on_end()
            return False

    # --- back from control ------------------------------------------------------------------------

    def _take_snapshot(self, snapshot: Snapshot) -> None:
        # The newest alone waits for its turn: a loop that hangs must not pile them up.
        with self._lock:
            waiting, self._waiting = self._waiting, snapshot
        if waiting is None:
            self.bus.soon(self._on_newest)

    def _on_newest(self) -> None:
        with self._lock:
            snapshot, self._waiting = self._waiting, None
        if snapshot is not None:
            self._on_snapshot(snapshot)

    def _on_snapshot(self, snapshot: Snapshot) -> None:
        before, self._snapshot = self._snapshot, snapshot
        if before is None or snapshot.stop != before.stop:
            following = snapshot.stop == "none"
            self.log.info(
                "following" if following else "standing",
                extra={} if following else {"reason": snapshot.stop},
            )
        self._count(before, snapshot)
        origin = self._origins.get(snapshot.taken) if snapshot.stop == "none" else None
        self._states.put(self._state(snapshot), origin)

    def _count(self, before: Snapshot | None, snapshot: Snapshot) -> None:
        late = snapshot.late_orders - (before.late_orders if before else 0)
        foreign = snapshot.foreign_orders - (before.foreign_orders if before else 0)
        self.bus.counters.late[Command.SCHEMA] += late
        if foreign:
            self._refuse("a second writer, while the first one is fresh", foreign)
        if before is not None and snapshot.late_ticks > before.late_ticks:
            self._limited.warning("late", "late control ticks", count=snapshot.late_ticks)

    def _on_end(self) -> None:
        if not self._ended:
            self._ended = True
            raise ControlRoomError(
                "the control process has ended by itself: the arm is not controlled any more"
            )

    def _refuse(self, reason: str, count: int = 1) -> None:
        self._foreign_refusals += count
        self.bus.counters.refused[Command.SCHEMA] += count
        self._limited.warning("refused", "command refused", reason=reason)

    # --- what is said -----------------------------------------------------------------------------

    def _state(self, snapshot: Snapshot) -> RobotState:
        return RobotState(
            robot=self._task.robot.name,
            joint_names=self._joint_names,
            joint_positions=snapshot.joint_positions,
            joint_velocities=snapshot.joint_velocities,
            tool_position=snapshot.tool_position,
            tool_orientation=snapshot.tool_orientation,
            tool_twist=snapshot.tool_twist,
            reference_twist=snapshot.reference_twist,
            nearest_obstacle=snapshot.nearest_obstacle,
            nearest_distance_m=snapshot.nearest_distance_m,
            contacts=snapshot.contacts,
            stop=snapshot.stop,
            limited=snapshot.limited,
            region_distance_m=snapshot.region_distance_m,
            late_ticks=snapshot.late_ticks,
            command_age_s=snapshot.command_age_s,
        )

    def _robot_description(self, _: Ask) -> RobotDescription:
        robot_description = arm_description(self._arm)
        return RobotDescription(robot=self._task.robot.name, **robot_description._asdict())
