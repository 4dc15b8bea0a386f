"""The input device on the bus: a source in, Motion and Step out, the last steps on request."""

from __future__ import annotations

import logging
import time
from collections import Counter

from hmcs.bus.keys import ANY
from hmcs.bus.logs import RateLimitedLog
from hmcs.bus.messages import (
    Ask,
    Done,
    FixtureState,
    Handle,
    Motion,
    Origin,
    Pairing,
    RobotState,
    Step,
)
from hmcs.bus.service import Service
from hmcs.bus.session import Bus, Received, RequestRefusedError, StoppedError
from hmcs.bus.verbs import LAST_STEPS, PLAY
from hmcs.driving import FollowingRobot, heard_robot
from hmcs.motion.steps import DeadZone
from hmcs.task import load_task
from hmcs_input_device.automatic import chosen
from hmcs_input_device.frames import frame_of
from hmcs_input_device.guarded import Guarded
from hmcs_input_device.kept_steps import KeptSteps
from hmcs_input_device.played import BUILT_IN
from hmcs_input_device.playing import Playing
from hmcs_input_device.reaction import RELEASED_S, Reaction, ReEngaging
from hmcs_input_device.settings import InputDeviceSettings
from hmcs_input_device.simulated import Simulated
from hmcs_input_device.sources import (
    LIVE,
    DeviceSample,
    HearsHandle,
    SeesRobot,
    Source,
    at_rest,
    open_source,
    plays,
)

_NS_PER_S = 1_000_000_000


class InputDevice(Service):
    """Publishes every sample of the operator's device, and every step of the engaged hand."""

    name = "input_device"
    Settings = InputDeviceSettings
    settings: InputDeviceSettings

    def __init__(self, settings: InputDeviceSettings, bus: Bus, log: logging.Logger) -> None:
        self._task = load_task(settings.task)
        settings = chosen(settings, self._task)
        super().__init__(settings, bus, log)
        self._dead_zone_m = settings.dead_zone_m or self._task.dead_zone_m
        self._source: Source = open_source(settings, self._task, BUILT_IN)
        self._guarded = Guarded(self._source, settings.source)
        self._frame = frame_of(settings, self._source)
        self._rate_hz = settings.rate_hz or self._source.rate_hz
        self._reaction = _reaction_of(self._source)
        self._playing = Playing(self._rate_hz, minds_stops=plays(self._source))
        self._zone = DeadZone(self._dead_zone_m)
        self._kept = KeptSteps(settings.steps_kept)
        self._limited = RateLimitedLog(log)
        self._present: set[str] = set()
        self._robot = FollowingRobot()
        self._may_play = settings.autoplay
        self._told_end = False
        self._told_stop = False
        self._told_trouble = ""
        self._hand: DeviceSample | None = None
        self._sent = 0
        self._motions = bus.publisher(Motion, bus.keys.motion)
        self._steps = bus.publisher(Step, bus.keys.step)

    def start(self) -> None:
        """Publish from now on; play once everybody waited for is there."""
        if problem := self._no_step_possible():
            self.log.warning(problem)
        bus = self.bus
        bus.watch(bus.keys.presence(ANY, ANY), self._on_presence)
        LAST_STEPS.answer(bus, lambda question: self._kept.asked(question, bus.source.boot))
        PLAY.answer(bus, self._play)
        if plays(self._source) or isinstance(self._source, SeesRobot):
            bus.subscribe(Pairing, bus.keys.pairing, self._on_pairing)
            bus.subscribe(RobotState, bus.keys.robot_state, self._on_robot_state)
        if self._reaction is not None:
            bus.subscribe(FixtureState, bus.keys.fixture_state, self._on_fixture_state)
        if isinstance(self._source, HearsHandle):
            bus.subscribe(Handle, bus.keys.handle, self._on_handle)
        bus.every(1.0 / self._rate_hz, self._on_tick)

    def health(self) -> tuple[bool, str]:
        """Return whether it publishes, and what it plays or waits for."""
        if trouble := self._guarded.trouble or self._no_step_possible():
            return False, trouble
        return True, self._doing()

    def facts(self) -> dict[str, str]:
        """Return what it plays, how far it is, and what makes a step."""
        played_s = self._playing.elapsed_s(_now_s()) or 0.0
        duration_s = self._source.duration_s
        return {
            "source": self.settings.source,
            "task": self._task.name,
            "rate_hz": f"{self._rate_hz:g}",
            "dead_zone_m": f"{self._dead_zone_m:g}",
            "steps": str(self._zone.count),
            "playing": self._doing(),
            "stopped": self._playing.stopped,
            "played_s": f"{min(played_s, duration_s):.2f}",
            "remaining_s": f"{max(duration_s - played_s, 0.0):.2f}",
            "re_engagements": str(self._reaction.count if self._reaction else 0),
        }

    def close(self) -> None:
        """Let go of the device."""
        self._source.close()

    # --- every tick -------------------------------------------------------------------------------

    def _on_tick(self) -> None:
        now_ns = time.monotonic_ns()
        now_s, playing = now_ns / _NS_PER_S, self._playing
        if self._may_play and not playing.begun and not playing.stopped and not self._missing():
            self._begin(now_s)
        playing.on_timeout(now_s)
        elapsed_s = playing.elapsed_s(now_s)
        if playing.rests and self._hand is not None:
            sample: DeviceSample | None = at_rest(self._hand)
        else:
            sample = self._sampled(now_s, elapsed_s)
        self._tell_stop()
        if sample is None:
            return
        self._hand = sample
        self._publish(sample, now_ns)
        if elapsed_s is None or elapsed_s <= self._source.duration_s:
            return
        if not self._told_end:
            self._told_end = True
            self.log.info("played to the end", extra={"steps": self._zone.count})
        if self.settings.exit_when_played and elapsed_s > self._source.duration_s + RELEASED_S:
            raise StoppedError

    def _sampled(self, now_s: float, elapsed_s: float | None) -> DeviceSample | None:
        released = self._reaction is not None and self._reaction.released
        if isinstance(self._source, HearsHandle):
            self._source.seconds(now_s)
        sample = self._guarded.sample(now_s, elapsed_s)
        if self._reaction is not None and self._reaction.released != released:
            self.log.info("presses again" if released else "lets go, as the robot stands")
        if refusal := self._guarded.refusal:
            self.bus.counters.count_refused(Motion.SCHEMA, refusal)
            self._limited.warning("sample", "sample refused", reason=refusal)
        trouble = self._guarded.trouble
        if trouble and trouble not in (refusal, self._told_trouble):
            self._limited.warning("trouble", "the hand rests", reason=trouble)
        self._told_trouble = trouble
        return sample

    def _publish(self, sample: DeviceSample, now_ns: int) -> None:
        motion = Motion(**self._frame(sample)._asdict())
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
            self._kept.keep(step, origin)
            self._steps.put(step, origin)

    # --- what is heard ----------------------------------------------------------------------------

    def _on_robot_state(self, received: Received[RobotState]) -> None:
        source, state = received.envelope.source, received.body
        now_s, robots = received.received_ns / _NS_PER_S, self._robots()
        if robots and source.instance not in robots:
            return
        stopped = state.stop == "asked"
        self._playing.robot_told(now_s, source.boot, source.instance, asked=stopped)
        self._robot = heard_robot(self._robot, now_s, source.boot, source.instance, robots)
        if self._robot.boot != source.boot:
            return
        if isinstance(self._source, SeesRobot):
            self._source.sees(state.tool_position, state.tool_orientation)
        heard_s = self._playing.elapsed_s(now_s)
        # A stop that was asked for is nothing to react to: a person ends it.
        if self._reaction is not None and heard_s is not None and not stopped:
            self._reaction.robot_told(heard_s, follows=state.stop == "none")

    def _on_pairing(self, received: Received[Pairing]) -> None:
        pairing, now_s = received.body, received.received_ns / _NS_PER_S
        if pairing.robot:
            self._robot = FollowingRobot(pairing.robot, pairing.robot_instance, now_s)

    def _on_handle(self, received: Received[Handle]) -> None:
        assert isinstance(self._source, HearsHandle)
        if not self._source.handled(received.received_ns / _NS_PER_S, received.body):
            reason = self._source.refusal
            self.bus.counters.count_refused(Handle.SCHEMA, reason)
            self._limited.warning("handle", "handle refused", reason=reason)

    def _on_fixture_state(self, received: Received[FixtureState]) -> None:
        if self._reaction is not None:
            self._reaction.fixture_told(engaged=received.body.engaged)

    def _on_presence(self, key: str, alive: bool) -> None:
        (self._present.add if alive else self._present.discard)(key)

    def _services(self) -> list[tuple[str, str]]:
        return [self.bus.keys.member_of(key) for key in self._present]

    def _robots(self) -> set[str]:
        return {instance for service, instance in self._services() if service == "robot"}

    def _missing(self) -> list[str]:
        there = Counter(service for service, _ in self._services())
        return sorted((Counter(self.settings.wait_for) - there).elements())

    # --- playing ----------------------------------------------------------------------------------

    def _begin(self, now_s: float) -> None:
        self._playing.begin(now_s)
        self._told_end = False
        self.log.info("playing", extra={"source": self.settings.source})

    def _tell_stop(self) -> None:
        """Say once that it lets go for a stop that was asked for."""
        stopped = bool(self._playing.stopped)
        if stopped and not self._told_stop:
            self.log.warning(
                "lets go, as a stop was asked for: goes on when it is asked to play (hmcs play)",
                extra={"robot": self._playing.stopped},
            )
        self._told_stop = stopped

    def _doing(self) -> str:
        elapsed_s = self._playing.elapsed_s(_now_s())
        if self._playing.stopped:
            return (
                f"stopped: {self._playing.stopped} was asked to stand; goes on when it is asked to "
                "play (hmcs play)"
            )
        if elapsed_s is None:
            if self._may_play:
                return f"waiting for {', '.join(self._missing()) or 'its first sample'}"
            return "waiting for a request to play"
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
        now_s, playing, source = _now_s(), self._playing, self.settings.source
        elapsed_s = playing.elapsed_s(now_s)
        finished = elapsed_s is not None and elapsed_s > self._source.duration_s
        if self._source.duration_s == LIVE and elapsed_s is not None and not playing.stopped:
            raise RequestRefusedError(f"{source} plays already and has no end: nothing to start")
        if missing := self._missing():
            raise RequestRefusedError(
                f"not everybody is there: waiting for {', '.join(missing)}; ask again then"
            )
        self._may_play = True
        if playing.stopped and elapsed_s is not None and not finished:
            playing.go_on(now_s)
            self.log.info("goes on after a stop", extra={"played_s": round(elapsed_s, 2)})
            return Done(
                detail=f"{source} takes hold again and goes on at {elapsed_s:.1f} s, where it let "
                "go for the stop"
            )
        self._begin(now_s)
        return Done(detail=f"playing {source} from its beginning")


def _now_s() -> float:
    return time.monotonic_ns() / _NS_PER_S


def _reaction_of(source: Source) -> Reaction | None:
    return source.reaction if isinstance(source, (ReEngaging, Simulated)) else None
