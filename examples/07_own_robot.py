"""A robot of your own: a point without weight that goes exactly as it is commanded.

    python examples/07_own_robot.py         # in place of the robot of `hmcs up`

What a robot has to promise: it follows a command only while it is valid, by its own clock; one
sender at a time; after a stop it moves again only once it saw `engaged` False and then True; it
says in every state why it stands. An arm has limits besides; see docs/how-to/own-robot.md.
"""

import time

import numpy as np

from hmcs import Service, ServiceSettings, run
from hmcs.bus.messages import Command, Done, RobotState, StopRequest
from hmcs.bus.verbs import STOP

PERIOD_S, VALID_AT_MOST_S, SILENT_S = 1 / 120, 0.08, 1.0


class PointRobot(Service):
    name, Settings = "robot", ServiceSettings

    def start(self):
        self.states = self.bus.publisher(RobotState, self.bus.keys.robot_state)
        self.position, self.twist, self.until_s = np.array([0.5, 0.0, 0.5]), np.zeros(6), 0.0
        self.writer, self.heard_s = "", -SILENT_S
        self.stop, self.released = "no_command", False
        self.bus.subscribe(Command, self.bus.keys.command, self.on_command)
        self.bus.subscribe(StopRequest, self.bus.keys.stop_request, self.on_stop)
        STOP.answer(self.bus, lambda _: self.on_stop(_) or Done(detail="stands"))
        self.bus.every(PERIOD_S, self.tick)

    def on_command(self, received):
        command, boot, now_s = received.body, received.envelope.source.boot, time.monotonic()
        if boot != self.writer and now_s - self.heard_s < SILENT_S:
            self.bus.counters.count_refused("command", "another one commands already")
            return
        if boot != self.writer:
            self.writer, self.released = boot, False
            self.stop = "disengaged" if self.stop == "none" else self.stop
        self.heard_s, self.released = now_s, self.released or not command.engaged
        if not command.engaged and self.stop == "none":
            self.stop = "disengaged"
        elif command.engaged and self.released:
            self.stop = "none"
        self.twist = command.twist
        self.until_s = received.received_ns * 1e-9 + min(
            command.valid_for_ns * 1e-9, VALID_AT_MOST_S
        )

    def on_stop(self, _):
        self.stop, self.released = "asked", False

    def tick(self):
        if self.stop == "none" and time.monotonic() > self.until_s:
            self.stop, self.released = "stale_command", False
        twist = self.twist if self.stop == "none" else np.zeros(6)
        self.position = self.position + PERIOD_S * twist[:3]
        state = RobotState(
            robot="point", joint_positions=np.zeros(0), joint_velocities=np.zeros(0),
            tool_position=self.position, tool_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
            tool_twist=twist, reference_twist=twist, nearest_obstacle="", nearest_distance_m=None,
            contacts=(), stop=self.stop, limited=(),
        )  # fmt: skip
        self.states.put(state)


if __name__ == "__main__":
    raise SystemExit(run(PointRobot))
