"""The input device on the bus: a source in, Motion and Step out, the last steps on request."""

from __future__ import annotations

import logging
import time
from collections import Counter, deque
from collections.abc import Callable
from itertools import islice

from pydantic import ValidationError

from hmcs.bus.keys import ANY
from hmcs.bus.logs import Seldom
from hmcs.bus.messages import (
    Ask,
    Done,
    FixtureState,
    Handle,
    LastSteps,
    LastStepsQuestion,
    Motion,
    Origin,
    RobotState,
    Step,
)
from hmcs.bus.service import Service
from hmcs.bus.session import Bus, Received, RequestRefusedError
from hmcs.errors import UserError
from hmcs.motion.steps import DeadZone
from hmcs.task import load_task
from hmcs_input_device.frames import TaskFrame
from hmcs_input_device.played import BUILT_IN
from hmcs_input_device.reaction import Reaction, ReEngaging
from hmcs_input_device.settings import InputDeviceSettings
from hmcs_input_device.simulated import Simulated
from hmcs_input_device.sources import (
    LIVE,
    DeviceSample,
    HearsHandle,
    SeesRobot,
    Source,
    Troubled,
    open_source,
)

_NS_PER_S = 1_000_000_000
IDENTITY = (0.0, 0.0, 0.0, 1.0)
"""No turn."""


class InputDevice(Service):
    """Publishes every sample of the operator's device, and every step of the engaged hand."""

    name = "input_device"
    Settings = InputDeviceSettings
    settings: InputDeviceSettings

    def __init__(self, settings: InputDeviceSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        self._task = load_task(settings.task)
        self._dead_zone_m = settings.dead_zone_m or self._task.dead_zone_m
        self._source: Source = open_source(settings, self._task, BUILT_IN)
        self._frame = _frame_of(settings, self._source)
        self._rate_hz = settings.rate_hz or self._source.rate_hz
        self._reaction = _reaction_of(self._source)
        self._zone = DeadZone(self._dead_zone_m)
        self._kept: deque[tuple[Step, Origin]] = deque(maxlen=settings.steps_kept)
        self._seldom = Seldom(log)
        self._present: set[str] = set()
        self._may_play = settings.autoplay
        self._began_ns: int | None = None
        self._told_end = False
        self._silent = ""
        self._sent = 0
        self._motions = bus.publisher(Motion, bus.keys.motion)
        self._steps = bus.publisher(Step, bus.keys.step)

    def start(self) -> None:
        """Publish from now on; play once everybody waited for is there."""
        if problem := self._no_step_possible():
            self.log.warning(problem)
        self.bus.watch(self.bus.keys.presence(ANY, ANY), self._on_presence)
        self.bus.answer("last_steps", LastStepsQuestion, self._last_steps)
        self.bus.answer("play", Ask, self._play)
        if self._reaction is not None or isinstance(self._source, SeesRobot):
            self.bus.subscribe(RobotState, self.bus.keys.robot_state, self._on_robot_state)
        if self._reaction is not None:
            self.bus.subscribe(FixtureState, self.bus.keys.fixture_state, self._on_fixture_state)
        if isinstance(self._source, HearsHandle):
            self.bus.subscribe(Handle, self.bus.keys.handle, self._on_handle)
        self.bus.every(1.0 / self._rate_hz, self._on_tick)

    def health(self) -> tuple[bool, str]:
        """Return whether it publishes, and what it plays or waits for."""
        if self._silent:
            return False, self._silent
        if isinstance(self._source, Troubled) and self._source.trouble:
            return False, self._source.trouble
        if problem := self._no_step_possible():
            return False, problem
        return True, self._doing()

    def facts(self) -> dict[str, str]:
        """Return what it plays, how far it is, and what makes a step."""
        played_s = self._elapsed_s(time.monotonic_ns()) or 0.0
        duration_s = self._source.duration_s
        return {
            "source": self.settings.source,
            "task": self._task.name,
            "rate_hz": f"{self._rate_hz:g}",
            "dead_zone_m": f"{self._dead_zone_m:g}",
            "steps": str(self._zone.count),
            "playing": self._doing(),
            "played_s": f"{min(played_s, duration_s):.2f}",
            "remaining_s": f"{max(duration_s - played_s, 0.0):.2f}",
            "re_engagements": str(self._reaction.count if self._reaction else 0),
        }

    def close(self) -> None:
        """Let go of the device."""
        self._source.close()

    def _on_tick(self) -> None:
        if self._began_ns is None and self._may_play and not self._missing():
            self._begin()
        now_ns = time.monotonic_ns()
        elapsed_s = self._elapsed_s(now_ns)
        released = self._reaction is not None and self._reaction.released
        if isinstance(self._source, HearsHandle):
            self._source.seconds(now_ns / _NS_PER_S)
        sample = self._source.sample(elapsed_s)
        if self._reaction is not None and self._reaction.released != released:
            self.log.info("presses again" if released else "lets go, as the robot stands")
        if sample is None:
            self._silent = f"the source {self.settings.source!r} gives no samples"
            return
        self._publish(sample, now_ns)
        if elapsed_s is not None and elapsed_s > self._source.duration_s and not self._told_end:
            self._told_end = True
            self.log.info("played to the end", extra={"steps": self._zone.count})

    def _publish(self, sample: DeviceSample, now_ns: int) -> None:
        try:
            motion = Motion(**self._frame(sample)._asdict())
        except ValidationError as error:
            reason = f"{error.errors()[0]['loc'][0]}: {error.errors()[0]['msg']}"
            self._silent = f"the source {self.settings.source!r} gives samples that are none"
            self.bus.counters.count_refused(Motion.SCHEMA, reason)
            self._seldom.warning("sample", "sample refused", reason=reason)
            return
        self._silent = ""
        # A motion is its own origin: its number must be known before it is sent.
        origin = Origin(boot=self.bus.source.boot, seq=self._sent, captured_ns=now_ns)
        self._sent = self._motions.put(motion, origin).seq + 1
        if not motion.dead_man or motion.clutch:
            self._zone.lift(pedal=motion.pedal)
            return
        made = self._zone.push(
            motion.position,
            orientation=motion.orientation,
            wrench=motion.wrench,
            pedal=motion.pedal,
        )
        if made is not None:
            step = Step(**made._asdict())
            self._kept.append((step, origin))
            self._steps.put(step, origin)

    def _begin(self) -> None:
        self._began_ns = time.monotonic_ns()
        self._told_end = False
        self.log.info("playing", extra={"source": self.settings.source})

    def _elapsed_s(self, now_ns: int) -> float | None:
        """Return the time since it began to play, on the grid of its rate.

        On the grid a recording gives the same samples every time it is played.
        """
        if self._began_ns is None:
            return None
        return round((now_ns - self._began_ns) / _NS_PER_S * self._rate_hz) / self._rate_hz

    def _on_robot_state(self, received: Received[RobotState]) -> None:
        if isinstance(self._source, SeesRobot):
            self._source.sees(received.body.tool_position, received.body.tool_orientation)
        heard_s = self._elapsed_s(received.received_ns)
        if self._reaction is not None and heard_s is not None:
            self._reaction.robot_told(heard_s, follows=received.body.stop == "none")

    def _on_handle(self, received: Received[Handle]) -> None:
        assert isinstance(self._source, HearsHandle)
        if not self._source.handled(received.received_ns / _NS_PER_S, received.body):
            reason = f"{received.body.operator} does not operate: another page holds the handle"
            self.bus.counters.count_refused(Handle.SCHEMA, reason)
            self._seldom.warning("handle", "handle refused", reason=reason)

    def _on_fixture_state(self, received: Received[FixtureState]) -> None:
        if self._reaction is not None:
            self._reaction.fixture_told(engaged=received.body.engaged)

    def _on_presence(self, key: str, alive: bool) -> None:
        (self._present.add if alive else self._present.discard)(key)

    def _missing(self) -> list[str]:
        there = Counter(self.bus.keys.member_of(key).service for key in self._present)
        return sorted((Counter(self.settings.wait_for) - there).elements())

    def _doing(self) -> str:
        elapsed_s = self._elapsed_s(time.monotonic_ns())
        if elapsed_s is None:
            if self._may_play:
                return f"waiting for {', '.join(self._missing()) or 'its first sample'}"
            return "waiting to be told to play"
        return "finished" if elapsed_s > self._source.duration_s else "playing"

    def _no_step_possible(self) -> str:
        reach_m = self._source.reach_m
        if reach_m is None or reach_m >= self._dead_zone_m:
            return ""
        return (
            f"no step possible: the motion goes {reach_m:g} m far, less than the dead zone of "
            f"{self._dead_zone_m:g} m: set dead_zone_m below that"
        )

    def _play(self, _: Ask) -> Done:
        if self._source.duration_s == LIVE and self._began_ns is not None:
            raise RequestRefusedError(
                f"{self.settings.source} plays already and has no end: nothing to start"
            )
        if missing := self._missing():
            raise RequestRefusedError(
                f"not everybody is there: waiting for {', '.join(missing)}; ask again then"
            )
        self._may_play = True
        self._begin()
        return Done(detail=f"playing {self.settings.source} from its beginning")

    def _last_steps(self, question: LastStepsQuestion) -> LastSteps:
        oldest = self._kept[0][0].index if self._kept else 0
        end = len(self._kept)
        if question.before is not None:
            end = min(max(question.before - oldest, 0), end)
        chosen = list(islice(self._kept, max(end - question.count, 0), end))
        return LastSteps(
            clock=self.bus.source.boot,
            steps=tuple(step for step, _ in chosen),
            origins=tuple(origin for _, origin in chosen),
        )


def _reaction_of(source: Source) -> Reaction | None:
    return source.reaction if isinstance(source, (ReEngaging, Simulated)) else None


def _frame_of(
    settings: InputDeviceSettings, source: Source
) -> Callable[[DeviceSample], DeviceSample]:
    """What tells samples along the axes of the robot's base.

    Raises UserError for a source that has them already.
    """
    if settings.task_frame_xyzw == IDENTITY:
        return lambda sample: sample
    if isinstance(source, SeesRobot):
        raise UserError(
            f"task_frame_xyzw: the operator of {settings.source!r} sees the robot in its base "
            "frame: leave it out"
        )
    return TaskFrame(settings.task_frame_xyzw).in_base
