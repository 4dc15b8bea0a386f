"""The service: samples in, commands out, at once; steps and beliefs change the fixture meanwhile.

The fast loop is the handler of Motion: what the robot is to do is computed and sent in it, so
from the operator to the robot there are two hops whatever recognition does.
"""

from __future__ import annotations

import logging
import time
from pathlib import Path
from typing import ClassVar

from hmcs.bus.keys import ANY
from hmcs.bus.logs import Seldom
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
    Motion,
    Origin,
    RobotState,
    Step,
)
from hmcs.bus.service import Service, UserError
from hmcs.bus.session import Bus, Received
from hmcs.fixtures.controller import Controller
from hmcs.fixtures.driver import Driver
from hmcs.fixtures.exchanged import Fixture, UnknownModelError
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model
from hmcs.translation import guides_of, sample_of, segment_belief_of
from hmcs_fixture_controller.models import load_models
from hmcs_fixture_controller.settings import FixtureControllerSettings
from hmcs_fixture_controller.translation import command_of, state_of

PAST_STEPS = 1000
"""How many steps are fetched at the start: segments that began before it need their origin."""
WATCH_MARGIN_S = 0.001
"""How much later than it may be stale the input is looked at again."""
NS_PER_S = 1_000_000_000


class FixtureController(Service):
    """Lends the operator a ruler while it is recognized what the hand is about to do."""

    name: ClassVar[str] = "fixture_controller"
    Settings = FixtureControllerSettings

    def __init__(self, settings: FixtureControllerSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        self._seldom = Seldom(log)
        self._controller = Controller(settings.safeguards)
        self._driver = Driver(settings.safeguards.input_stale_after_s)
        self._clock = ""
        self._next_step = 0
        self._fixture: Fixture | None = None
        self._robot: RobotState | None = None
        self._models: dict[str, Model] = {}
        for model in load_models(settings.models).values():
            self._load(model)
        if settings.active_model is not None:
            self.activate(settings.active_model)
        self._commands = bus.publisher(Command, bus.keys.command)
        self._states = bus.publisher(FixtureState, bus.keys.fixture_state)

    def start(self) -> None:
        """Catch up with the steps there were, and begin to command."""
        bus = self.bus
        bus.subscribe(Motion, bus.keys.motion, self._on_motion)
        bus.subscribe(Step, bus.keys.step, self._on_step)
        bus.subscribe(Belief, bus.keys.belief(ANY), self._on_belief)
        bus.subscribe(RobotState, bus.keys.robot_state, self._on_robot_state)
        bus.answer(
            "activate", ActivateRecognizer, lambda asked: Done(detail=self.activate(asked.model))
        )
        bus.answer("load_model", LoadModel, lambda asked: Done(detail=self.load(Path(asked.path))))
        self._fetch_past_steps()
        self._watch_input()

    def health(self) -> tuple[bool, str]:
        """Say what it does: guiding, or why not."""
        fixture, robot = self._fixture, self._robot
        if fixture is None or fixture.reason == "input_stale":
            doing = "idle: no operator input"
        else:
            doing = f"{fixture.reason}, {fixture.law} law, factor {fixture.factor:.2f}"
            doing += "; its plan is stuck and asks for help" if fixture.asks_for_help else ""
        stands = f"; {robot.robot} stands: {robot.stop}" if robot and robot.stop != "none" else ""
        return True, f"{doing}; follows {self._controller.active or 'no model'}{stands}"

    def facts(self) -> dict[str, str]:
        """Name the models and which of them is followed."""
        active = self._controller.active
        return {
            "models": ", ".join(f"{name} {m.hash}" for name, m in self._models.items()),
            "active_model": active,
            "model_hash": self._models[active].hash if active else "",
        }

    # --- the fast loop ----------------------------------------------------------------------------

    def _on_motion(self, received: Received[Motion]) -> None:
        source = received.envelope.source
        now_s = received.received_ns / NS_PER_S
        if time.monotonic_ns() / NS_PER_S - now_s > self.settings.safeguards.input_stale_after_s:
            self.bus.counters.count_late(Motion.SCHEMA)
            return
        verdict = self._driver.heard(now_s, source.boot, received.envelope.seq)
        if verdict == "second_device":
            self._refuse(Motion, f"{source.instance} is a second input device: stop one of them")
        elif verdict == "old":
            self.bus.counters.count_late(Motion.SCHEMA)
        else:
            if source.boot != self._clock:
                self._begin_clock(source.boot)
            envelope = received.envelope
            sample = sample_of(received.body, envelope.seq, envelope.origin)
            self._send(self._controller.sampled(now_s, sample), envelope.origin)

    def _watch_input(self) -> None:
        """Command the stop when the operator's samples stay out, and again while they do."""
        now_ns = time.monotonic_ns()
        if self._controller.input_stale(now_ns / NS_PER_S):
            self._send(self._controller.waited(now_ns / NS_PER_S), None)
            wait_s = self.settings.stop_repeated_every_ms / 1e3
        else:
            wait_s = self._controller.input_good_for_s(now_ns / NS_PER_S) + WATCH_MARGIN_S
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
        source, origin = received.envelope.source, received.envelope.origin
        now_s = received.received_ns / NS_PER_S
        if source.boot != self._clock:
            if self._clock and not self._driver.admits(now_s, source.boot):
                self._refuse(Step, f"{source.instance} is a second input device: stop one of them")
                return
            self._begin_clock(source.boot)
        self._take_step(now_s, received.body, origin)

    def _take_step(self, now_s: float, step: Step, origin: Origin | None) -> None:
        if step.index < self._next_step:
            self._refuse(
                Step, f"step {step.index} came again or jumped back: expected {self._next_step}"
            )
            return
        self._next_step = step.index + 1
        number = None if origin is None else origin.seq
        self._controller.stepped(now_s, step.index, step.position, step.displacement, number)

    def _begin_clock(self, clock: str) -> None:
        self._clock, self._next_step = clock, 0
        self._controller.forget()

    def _fetch_past_steps(self) -> None:
        bus = self.bus
        key = bus.keys.rpc("input_device", ANY, "last_steps")
        answers = bus.ask(key, LastStepsQuestion(count=PAST_STEPS), LastSteps, timeout_s=0.5)
        for answer in answers[:1]:
            self.take_past_steps(answer.body)

    def take_past_steps(self, last: LastSteps) -> None:
        """Begin with the steps that were made before this process came up."""
        now_s = time.monotonic_ns() / NS_PER_S
        self._begin_clock(last.clock)
        for step, origin in zip(last.steps, last.origins, strict=False):
            self._take_step(now_s, step, origin)

    def _on_belief(self, received: Received[Belief]) -> None:
        belief, bus = received.body, self.bus
        before, after = bus.keys.belief(ANY).split(ANY)
        name = received.key.removeprefix(before).removesuffix(after)
        model = self._model_of(name, belief.model_hash)
        if model is None:
            self._refuse(
                Belief,
                f"recognizer {name!r} speaks of model {belief.model_hash}, which is not loaded "
                "here: ask for `load_model` first",
            )
            return
        if belief.model_hash != model.hash:
            self._refuse(
                Belief,
                f"it is of model {name!r} {belief.model_hash}, loaded is {model.hash}: "
                "give both sides the same file",
            )
            return
        if belief.clock != self._clock:
            bus.counters.count_late(Belief.SCHEMA)
            return
        try:
            newer = self._controller.believed(name, segment_belief_of(belief))
        except ValueError as error:
            self._refuse(Belief, str(error))
            return
        if not newer:
            bus.counters.count_late(Belief.SCHEMA)
        elif not self._controller.active:
            self.activate(name)

    def _on_robot_state(self, received: Received[RobotState]) -> None:
        self._robot = received.body
        robot = received.body
        self._controller.robot_moved(
            received.received_ns / NS_PER_S, robot.tool_position, robot.tool_orientation
        )

    def _model_of(self, recognizer: str, model_hash: str) -> Model | None:
        """The model of that recognizer; one of another name may stand on any loaded model."""
        if recognizer not in self._models:
            for model in tuple(self._models.values()):
                if model.hash == model_hash:
                    self._lend(recognizer, model)
                    break
        return self._models.get(recognizer)

    # --- recognizers ------------------------------------------------------------------------------

    def load(self, path: Path) -> str:
        """Load a model file, instead of one of the same name; return what is so now.

        Raises ModelFileError where it cannot be used; nothing changes then.
        """
        model, followed = load_model(path), self._models.get(self._controller.active)
        told = self._load(model)
        if followed is None or followed.task.name == model.task.name:
            return told
        self.log.warning(
            "a model of another task",
            extra={"model": model.name, "task": model.task.name, "followed": followed.task.name},
        )
        return (
            f"{told}; mind that it is of task {model.task.name!r}, the followed one of "
            f"{followed.task.name!r}: its guides and limits are those of its own task"
        )

    def activate(self, name: str) -> str:
        """Follow the recognizer of a loaded model from now on; return what is so now.

        Raises UserError where it is not loaded.
        """
        try:
            self._controller.activate(name)
        except UnknownModelError as error:
            raise UserError(str(error)) from error
        self.log.info("recognizer activated", extra={"model": name})
        return f"follows {name} {self._models[name].hash}"

    def _lend(self, recognizer: str, model: Model) -> None:
        self._models[recognizer] = model
        self._controller.load(recognizer, guides_of(model))

    def _load(self, model: Model) -> str:
        self._lend(model.name, model)
        self.log.info("model loaded", extra={"model": model.name, "hash": model.hash})
        return f"model {model.name} {model.hash} is loaded"

    def _refuse(self, message_type: type[Message], reason: str) -> None:
        schema = message_type.SCHEMA
        self.bus.counters.count_refused(schema, reason)
        self._seldom.warning(schema, f"{schema} refused", reason=reason)
