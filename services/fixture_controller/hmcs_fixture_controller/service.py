"""The service: samples in, commands out, at once; steps and beliefs change the fixture meanwhile.

The fast loop is the handler of Motion: what the robot is to do is computed and sent in it, so
from the operator to the robot there are two hops whatever recognition does. Model files are read,
and their guides and regions made, on a thread beside it.
"""

from __future__ import annotations

import logging
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import ClassVar

from hmcs.bus.keys import ANY, recognizer_in
from hmcs.bus.logs import RateLimitedLog
from hmcs.bus.messages import (
    ActivateRecognizer,
    Belief,
    Command,
    Done,
    FixtureState,
    LastSteps,
    LastStepsQuestion,
    LoadModel,
    Message,
    ModelFile,
    ModelQuestion,
    Motion,
    Origin,
    Pairing,
    RobotState,
    Source,
    Step,
)
from hmcs.bus.service import Service, UserError
from hmcs.bus.session import Bus, Publisher, Received, RequestRefusedError
from hmcs.bus.verbs import ACTIVATE, LAST_STEPS, LOAD_MODEL, MODEL_FILE
from hmcs.controller_feed import ControllerFeed
from hmcs.fixtures.controller.controller import Controller
from hmcs.fixtures.controller.interface import Fixture
from hmcs.model_signing import signed_by
from hmcs.recognition.model_file import asked_model, load_model
from hmcs.translation import guides_of
from hmcs_fixture_controller.models import Loaded, Recognizers, content_of, load_models
from hmcs_fixture_controller.settings import FixtureControllerSettings
from hmcs_fixture_controller.speakers import Speakers
from hmcs_fixture_controller.translation import command_of, state_of

PAST_STEPS = 1000
"""How many steps are fetched at the start: segments that began before it need their origin."""
WATCH_MARGIN_S = 0.001
"""How much later than it may be stale the input is looked at again."""
PAIRING_EVERY_S = 0.2
"""How often it is said again which device drives which robot."""
NS_PER_S = 1_000_000_000


class FixtureController(Service):
    """Makes the operator's velocity the robot's, along the path that is recognized."""

    name: ClassVar[str] = "fixture_controller"
    Settings = FixtureControllerSettings

    def __init__(self, settings: FixtureControllerSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        self._limited = RateLimitedLog(log)
        self._controller = Controller(settings.safeguards)
        self._feed = ControllerFeed(self._controller)
        self._recognizers = Recognizers()
        self._speakers = Speakers()
        self._robots: set[str] = set()
        """Instances of the robots that are present."""
        self._fixture: Fixture | None = None
        self._robot: RobotState | None = None
        self._paired: Pairing | None = None
        self._pairings: Publisher[Pairing] | None = None
        self._files = ThreadPoolExecutor(1, thread_name_prefix="files")
        for model, file in load_models(settings.models, settings.model_key, settings.task).values():
            self._adopt(Loaded(model, guides_of(model), file))
        if settings.active_model is not None:
            self._follow(settings.active_model)
        self._commands = bus.publisher(Command, bus.keys.command)
        self._states = bus.publisher(FixtureState, bus.keys.fixture_state)

    def start(self) -> None:
        """Catch up with the steps there were, and begin to command."""
        bus = self.bus
        self._pairings = bus.publisher(Pairing, bus.keys.pairing)
        bus.watch(bus.keys.presence(), self._on_presence)
        bus.watch(bus.keys.member(ANY), self._on_member)
        bus.subscribe(Motion, bus.keys.motion, self._on_motion)
        bus.subscribe(Step, bus.keys.step, self._on_step)
        bus.subscribe(Belief, bus.keys.belief(), self._on_belief)
        bus.subscribe(RobotState, bus.keys.robot_state, self._on_robot_state)
        ACTIVATE.answer(bus, self._on_activate)
        LOAD_MODEL.answer(bus, self._on_load_model, aside=self._files)
        MODEL_FILE.answer(bus, self._on_model_question, aside=self._files)
        self._fetch_past_steps()
        bus.every(PAIRING_EVERY_S, self._say_pairing)
        self._watch_input()

    def health(self) -> tuple[bool, str]:
        """Say what it does: guiding, or why not; unhealthy while nobody runs what it follows."""
        fixture, robot, active = self._fixture, self._robot, self._controller.active
        if fixture is None or fixture.reason == "input_stale":
            doing = "idle: no operator input"
        else:
            doing = f"{fixture.reason}, {fixture.law} law, factor {fixture.factor:.2f}"
            doing += "; its plan is stuck and asks for help" if fixture.asks_for_help else ""
        stands = f"; {robot.robot} stands: {robot.stop}" if robot and robot.stop != "none" else ""
        now_s = _now_s()
        unheard = bool(active) and not self._speakers.living(active, now_s)
        follows = f"{active or 'no model'}{', which no process runs' if unheard else ''}"
        lost = self._speakers.lost(active, now_s)
        return not lost, f"{doing}; follows {follows}{stands}"

    def facts(self) -> dict[str, str]:
        """Name the models, which of them is followed, who runs it, who drives, and which robot."""
        active = self._controller.active
        return {
            "models": ", ".join(
                f"{name} {known.model.hash}" for name, known in self._recognizers.items()
            ),
            "active_model": active,
            "model_hash": self._recognizers[active].model.hash if active else "",
            "active_run_by": ", ".join(self._speakers.living(active, _now_s())),
            "device": self._feed.device.instance,
            "robot": self._feed.robot.instance,
        }

    def close(self) -> None:
        """Read no more files."""
        self._files.shutdown(wait=False, cancel_futures=True)

    # --- the fast loop ----------------------------------------------------------------------------

    def _on_motion(self, received: Received[Motion]) -> None:
        source = received.envelope.source
        now_s = received.received_ns / NS_PER_S
        if _now_s() - now_s > self.settings.safeguards.input_stale_after_s:
            self.bus.counters.count_late(Motion.SCHEMA)
            return
        envelope, before = received.envelope, self._feed.device.boot
        fixture = self._feed.on_motion(now_s, source, envelope.seq, received.body, envelope.origin)
        if self._feed.device.boot != before:
            self._say_pairing()
        if fixture is None:
            self._refuse_second(Motion, "input device", source, self._feed.device.instance)
            return
        self._send(fixture, envelope.origin)

    def _watch_input(self) -> None:
        """Command the stop when the operator's samples stay out, and again while they do."""
        now_ns = time.monotonic_ns()
        wait_s = self.settings.stop_repeated_every_ms / 1e3
        try:
            if self._controller.input_stale(now_ns / NS_PER_S):
                self._send(self._controller.on_timeout(now_ns / NS_PER_S), None)
            else:
                wait_s = self._controller.input_good_for_s(now_ns / NS_PER_S) + WATCH_MARGIN_S
        finally:
            # Whatever went wrong this time must not be the end of the watch.
            self.bus.at(now_ns + round(wait_s * NS_PER_S), self._watch_input)

    def _send(self, fixture: Fixture, origin: Origin | None) -> None:
        self._commands.put(command_of(fixture, self.settings.command_valid_for_ms), origin)
        self._states.put(state_of(fixture), origin)
        if self._fixture is None or self._fixture.engaged != fixture.engaged:
            self.log.info("engaged" if fixture.engaged else f"not engaged: {fixture.reason}")
        if fixture.asks_for_help and (self._fixture is None or not self._fixture.asks_for_help):
            self.log.warning("a plan is stuck: help it on", extra={"state": fixture.state})
        self._fixture = fixture

    # --- the slow loop ----------------------------------------------------------------------------

    def _on_step(self, received: Received[Step]) -> None:
        source, step = received.envelope.source, received.body
        now_s = received.received_ns / NS_PER_S
        verdict = self._feed.on_step(now_s, source, step, received.envelope.origin)
        if verdict == "second":
            self._refuse_second(Step, "input device", source, self._feed.device.instance)
        elif verdict == "old":
            self._refuse(Step, f"step {step.index} came again or jumped")

    def _fetch_past_steps(self) -> None:
        answers = LAST_STEPS.ask(self.bus, LastStepsQuestion(count=PAST_STEPS), timeout_s=0.5)
        for answer in answers[:1]:
            self.take_past_steps(answer.body, answer.envelope.source)

    def take_past_steps(self, last: LastSteps, source: Source) -> None:
        """Begin with the steps that were made before this process came up."""
        now_s = _now_s()
        for step, origin in zip(last.steps, last.origins, strict=False):
            self._feed.on_step(now_s, source, step, origin)

    def _on_belief(self, received: Received[Belief]) -> None:
        belief, source = received.body, received.envelope.source
        name = recognizer_in(received.key).model
        known = self._recognizers.of(name, belief.model_hash)
        if known is None:
            self._refuse(
                Belief,
                f"recognizer {name!r} speaks of model {belief.model_hash}, which is not loaded "
                "here: ask for `load_model` first",
            )
            return
        if belief.model_hash != known.model.hash:
            self._refuse(
                Belief,
                f"it is of model {name!r} {belief.model_hash}, loaded is {known.model.hash}: "
                "give both sides the same file",
            )
            return
        if name not in self._recognizers:
            for forgotten in self._recognizers.lend(name, known, keep=self._controller.active):
                self._feed.unload(forgotten)
            self._feed.load(name, known.guides)
        try:
            verdict = self._feed.on_belief(name, belief)
        except ValueError as error:
            self._refuse(Belief, str(error))
            return
        if verdict in ("old", "other_clock"):
            self.bus.counters.count_late(Belief.SCHEMA)
            return
        self._speakers.heard(name, source, received.received_ns / NS_PER_S)
        if not self._controller.active:
            self._follow(name)

    def _on_robot_state(self, received: Received[RobotState]) -> None:
        source, before = received.envelope.source, self._feed.robot.boot
        now_s = received.received_ns / NS_PER_S
        verdict = self._feed.on_robot(now_s, source, received.body, self._robots)
        if self._feed.robot.boot != before:
            self._say_pairing()
        if verdict == "second":
            self._refuse_second(RobotState, "robot", source, self._feed.robot.instance)
        else:
            self._robot = received.body

    # --- who is there -----------------------------------------------------------------------------

    def _on_presence(self, key: str, alive: bool) -> None:
        member = self.bus.keys.member_of(key)
        if member.service == "robot":
            (self._robots.add if alive else self._robots.discard)(member.instance)
        self._speakers.present(member, alive)

    def _on_member(self, key: str, alive: bool) -> None:
        model, member = self.bus.keys.model_of(key), self.bus.keys.member_of(key)
        self._speakers.at_work(model, member, alive)
        if not alive and self._speakers.lost(self._controller.active, _now_s()):
            self.log.warning(
                "no process runs the recognizer that is followed",
                extra={"model": self._controller.active},
            )

    def _say_pairing(self) -> None:
        device, robot = self._feed.device, self._feed.robot
        drives = "" if device.silent(_now_s()) else device.boot
        pairing = Pairing(
            device=drives,
            device_instance=device.instance if drives else "",
            robot=robot.boot,
            robot_instance=robot.instance,
        )
        if pairing != self._paired:
            self.log.info(
                "paired", extra={"device": pairing.device_instance, "robot": robot.instance}
            )
            self._paired = pairing
        if self._pairings is not None:
            self._pairings.put(pairing)

    # --- recognizers ------------------------------------------------------------------------------

    def load(self, path: Path) -> str:
        """Load a model file, instead of one of the same name; return what is so now.

        The file is read and its guides are made on the calling thread; the loop only takes them
        over. Raises ModelFileError or RegionError where it cannot be used; nothing changes then.
        """
        model = load_model(path, verify=signed_by(self.settings.model_key))
        loaded = Loaded(model, guides_of(model), path)
        return self.bus.in_loop(lambda: self._take_over(loaded))

    def activate(self, name: str) -> str:
        """Follow a loaded recognizer from now on; return what is so now.

        Raises UserError where it is not loaded, or no process runs it.
        """
        self._check_loaded(name)
        now_s = _now_s()
        if not self._speakers.living(name, now_s):
            raise UserError(
                f"no process runs recognizer {name!r}, so that nothing would be recognized; those "
                f"that run: {', '.join(self._speakers.names(now_s)) or 'none'}. Start it first"
            )
        return self._follow(name)

    def _on_activate(self, asked: ActivateRecognizer) -> Done:
        return Done(detail=self.activate(asked.model))

    def _on_load_model(self, asked: LoadModel) -> Done:
        return Done(detail=self.load(asked_model(asked.path)))

    def _on_model_question(self, asked: ModelQuestion) -> ModelFile:
        loaded = self.bus.in_loop(lambda: self._recognizers.get(asked.model))
        if loaded is None:
            raise RequestRefusedError(f"model {asked.model!r} is not loaded here")
        return ModelFile(
            model=loaded.model.name, model_hash=loaded.model.hash, content=content_of(loaded)
        )

    def _take_over(self, loaded: Loaded) -> str:
        model, followed = loaded.model, self._recognizers.get(self._controller.active)
        outcome = self._adopt(loaded)
        if followed is None or followed.model.task.name == model.task.name:
            return outcome
        before = followed.model.task.name
        self.log.warning(
            "a model of another task",
            extra={"model": model.name, "task": model.task.name, "followed": before},
        )
        return (
            f"{outcome}; mind that it is of task {model.task.name!r}, the followed one of "
            f"{before!r}: its guides and limits are those of its own task"
        )

    def _adopt(self, loaded: Loaded) -> str:
        model = loaded.model
        self._feed.load(model.name, loaded.guides)
        self._recognizers.take(loaded)
        self.log.info("model loaded", extra={"model": model.name, "hash": model.hash})
        return f"model {model.name} {model.hash} is loaded"

    def _check_loaded(self, name: str) -> None:
        if name not in self._recognizers:
            raise UserError(
                f"model {name!r} is not loaded; loaded: {', '.join(self._recognizers) or 'none'}. "
                "Load its file first, or name one of these"
            )

    def _follow(self, name: str) -> str:
        self._check_loaded(name)
        self._controller.activate(name)
        self.log.info("recognizer activated", extra={"model": name})
        return f"follows {name} {self._recognizers[name].model.hash}"

    # --- refusals ---------------------------------------------------------------------------------

    def _refuse_second(
        self, message_type: type[Message], kind: str, source: Source, paired: str
    ) -> None:
        self._refuse(
            message_type,
            f"{source.instance} is a second {kind}, while {paired or 'none'} is paired: "
            "stop one of them",
        )

    def _refuse(self, message_type: type[Message], reason: str) -> None:
        schema = message_type.SCHEMA
        self.bus.counters.count_refused(schema, reason)
        self._limited.warning(schema, f"{schema} refused", reason=reason)


def _now_s() -> float:
    return time.monotonic_ns() / NS_PER_S
