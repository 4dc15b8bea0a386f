"""A device of your own: a process that moves a hand in a circle of 5 cm, one turn in 12 s.

    python examples/05_own_device.py        # in place of the input device of `hmcs up`

A press of the dead-man counts only after it was seen released: the hand rests for half a second.
"""

import time
from collections import deque
from math import cos, sin

import numpy as np

from hmcs import Service, ServiceSettings, run
from hmcs.bus.messages import LastSteps, LastStepsQuestion, Motion, Origin, Step
from hmcs.motion.steps import DeadZone

REST_S, RADIUS_M, TURN_PER_S, DEAD_ZONE_M = 0.5, 0.05, 0.5, 0.008


class Circling(Service):
    name, Settings = "input_device", ServiceSettings

    def start(self):
        self.motions = self.bus.publisher(Motion, self.bus.keys.motion)
        self.steps = self.bus.publisher(Step, self.bus.keys.step)
        self.bus.answer("last_steps", LastStepsQuestion, self.last_steps)
        self.zone, self.kept, self.sent = DeadZone(DEAD_ZONE_M), deque(maxlen=4096), 0
        self.began_s = time.monotonic()
        self.bus.every(0.01, self.sample)

    def sample(self):
        moving_s = max(time.monotonic() - self.began_s - REST_S, 0.0)
        angle, speed_m_s = TURN_PER_S * moving_s, RADIUS_M * TURN_PER_S * (moving_s > 0)
        position = RADIUS_M * np.array([cos(angle), sin(angle), 0.0])
        velocity = speed_m_s * np.array([-sin(angle), cos(angle), 0.0])
        # A sample is its own origin, so that its way through the cell can be timed.
        now_ns, boot = time.monotonic_ns(), self.bus.source.boot
        origin = Origin(boot=boot, seq=self.sent, captured_ns=now_ns)
        motion = Motion(position=position, velocity=velocity, dead_man=moving_s > 0)
        self.sent = self.motions.put(motion, origin).seq + 1
        if motion.dead_man and (step := self.zone.push(position)) is not None:
            self.kept.append((Step(**step._asdict()), origin))
            self.steps.put(*self.kept[-1])

    def last_steps(self, question):
        """Recognizers that missed a step ask for it."""
        kept = [k for k in self.kept if question.before is None or k[0].index < question.before]
        steps, origins = zip(*kept[-question.count :], strict=True) if kept else ((), ())
        return LastSteps(clock=self.bus.source.boot, steps=steps, origins=origins)


if __name__ == "__main__":
    raise SystemExit(run(Circling))
