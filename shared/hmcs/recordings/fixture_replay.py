"""What the fixture would have done in a recording: its controller again, with other beliefs.

An open loop: hand and robot are where they were recorded to be, and react to nothing that the
fixture would have done otherwise. What it does in the first moments tells this best; the longer it
leads another way than it did then, the less would hand and robot have been where they were.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from hmcs.bus.counters import Sequences
from hmcs.bus.messages import (
    Belief,
    Envelope,
    FixtureState,
    Message,
    Motion,
    RobotState,
    Step,
)
from hmcs.controller_feed import ControllerFeed
from hmcs.fixtures.controller.controller import Controller
from hmcs.fixtures.controller.interface import Fixture
from hmcs.fixtures.controller.rules import Safeguards
from hmcs.recordings.reading import Recorded, RecordingContent
from hmcs.recordings.replaying import Replay, recognizer_named, settings_in
from hmcs.recordings.ticks import FixtureOutput, Tick, Ticks
from hmcs.translation import guides_of

HEARD = (Motion, Step, Belief, RobotState, FixtureState)
CONTROLLER = "fixture_controller/"
"""What the metadata of fixture controllers are named by."""
_LARGEST_SETTING = 1e9


class FixtureReplay(NamedTuple):
    """A recording through a fixture controller."""

    followed: tuple[str, ...]
    """The models the recorded fixture followed, each once, in their order."""
    ticks: Sequence[Tick]
    spent_s: float
    """Processor time."""
    notes: tuple[str, ...]
    """What is to be known besides, a sentence each."""


def replay_fixture(
    content: RecordingContent, replay: Replay, progress: Callable[[float], None] = lambda _: None
) -> FixtureReplay:
    """Return what the fixture does in a recording with the beliefs of a replay of it.

    Every sample, step and position of the robot comes when it was recorded; a belief comes when the
    recorded one of its step came, or with its step where there was none. Rules and guides are those
    of the replayed model, safeguards those of the recorded fixture controller. `progress` receives
    the share done. Raises RecordingError where messages are of another version of the contract, and
    RegionError for a forbidden region that cannot be.
    """
    began_s = time.process_time()
    settings, active = _recorded_controller(content)
    replayed = _ReplayedController(
        replay, Safeguards() if settings is None else safeguards_from(settings), active
    )
    followed: dict[str, None] = {}
    answered = False
    begun_ns = content.first_ns
    lasts_ns = max(round(content.duration_s * 1e9), 1)
    for recorded, envelope, message in content.of_any(*HEARD):
        origin = envelope.origin
        if isinstance(message, FixtureState) and origin is not None:
            replayed.ticks.add_then(origin.boot, origin.seq, _recorded_output(message))
            followed |= dict.fromkeys([message.model] if message.model else ())
            answered = True
            continue
        replayed.hear((recorded.log_ns - begun_ns) / 1e9, recorded, envelope, message)
        progress((recorded.log_ns - begun_ns) / lasts_ns)
    notes = _notes(replayed, settings is not None, answered, tuple(followed), replay.compared_with)
    return FixtureReplay(
        tuple(followed), replayed.ticks, time.process_time() - began_s, tuple(notes)
    )


def safeguards_from(settings: Mapping[str, Any]) -> Safeguards:
    """Return the safeguards in a fixture controller's settings, as it reports them.

    What they do not give, or not as a number, is as by default.
    """
    given: dict[str, float] = {}
    for name in Safeguards.__dataclass_fields__:
        milliseconds = settings.get(f"{name.removesuffix('_s')}_ms") if name[-2:] == "_s" else None
        value = settings.get(name) if milliseconds is None else milliseconds
        if isinstance(value, int | float) and 0 <= value <= _LARGEST_SETTING:
            given[name] = value if milliseconds is None else value / 1e3
    return Safeguards(**given)


class _ReplayedController:
    """A controller that hears what the recorded one heard, as its service lets it.

    Nobody waits for samples that stay out: the first one after a gap finds it long enough to stop.
    """

    def __init__(self, replay: Replay, safeguards: Safeguards, active: bool) -> None:
        model = replay.model
        self.ticks = Ticks()
        self.lost = self.refused = self.robots = 0
        controller = Controller(safeguards)
        controller.load(model.name, guides_of(model))
        if active:
            controller.activate(model.name)
        self._feed = ControllerFeed(controller)
        self._name, self._recorded_name = model.name, replay.compared_with
        self._sequences = Sequences()
        self._replayed = replay.beliefs
        self._numbers = {
            (each.clock, each.step): number for number, each in enumerate(replay.beliefs)
        }
        """Of each step among those that were replayed."""

    def hear(self, now_s: float, recorded: Recorded, envelope: Envelope, message: Message) -> None:
        """Take in a recorded message at its time."""
        match message:
            case Motion():
                self._sampled(now_s, recorded, envelope, message)
            case Step():
                self._stepped(now_s, envelope, message)
            case RobotState():
                self.robots += 1
                self._feed.on_robot(now_s, envelope.source, message, ())
            case Belief() if recognizer_named(recorded.key) == self._recorded_name:
                self._believed(message.clock, message.step)

    def _sampled(
        self, now_s: float, recorded: Recorded, envelope: Envelope, motion: Motion
    ) -> None:
        source, number = envelope.source, envelope.seq
        lost = self._sequences.note(recorded.key, source.boot, number)
        self.lost += lost or 0
        made = None
        if lost is not None:
            made = self._feed.on_motion(now_s, source, number, motion, envelope.origin)
        if made is None:
            self.refused += 1
            return
        self.ticks.add(recorded.log_ns, source.boot, number, _replayed_output(made))

    def _stepped(self, now_s: float, envelope: Envelope, step: Step) -> None:
        """Take a step, and the belief after it where none was recorded that says when it came."""
        source = envelope.source
        if self._feed.on_step(now_s, source, step, envelope.origin) != "taken":
            return
        replayed = self._numbers.get((source.boot, step.index))
        if replayed is not None and self._replayed[replayed].recorded is None:
            self._believed(source.boot, step.index)

    def _believed(self, clock: str, step: int) -> None:
        """Take the replayed belief of a step; of several recognizers the first counts."""
        number = self._numbers.get((clock, step))
        if number is None:
            return
        verdict = self._feed.on_belief(self._name, self._replayed[number].replayed)
        controller = self._feed.controller
        if verdict in ("taken", "early") and not controller.active:
            controller.activate(self._name)


def _notes(
    replayed: _ReplayedController,
    settings_known: bool,
    recorded: bool,
    followed: tuple[str, ...],
    other: str,
) -> Iterator[str]:
    if not replayed.ticks:
        yield "no sample of the operator's device was recorded: the fixture does nothing"
    if not recorded:
        yield "no fixture was recorded: there is nothing to compare with"
    elif followed and set(followed) != {other}:
        yield (
            f"the recorded fixture followed {', then '.join(followed)}; the beliefs compared with "
            f"are those of {other or 'nobody'}"
        )
    if not settings_known:
        yield "the settings of the recorded fixture are not kept with it: defaults are used"
    if not replayed.robots:
        yield (
            "no robot was recorded: nobody knows how far it was beside its guides, so that nothing "
            "leads it back to them"
        )
    if replayed.lost:
        yield f"{replayed.lost} samples of the operator's device are missing"
    if replayed.refused:
        yield f"{replayed.refused} samples came again or from a second input device: left out"


def _recorded_controller(content: RecordingContent) -> tuple[Mapping[str, Any] | None, bool]:
    """The settings of the recorded fixture controller, and whether it followed a model already."""
    for name, facts in content.metadata.items():
        settings = settings_in(facts) if name.startswith(CONTROLLER) else None
        if settings is not None:
            return settings, bool(facts.get("active_model"))
    return None, False


def _replayed_output(fixture: Fixture) -> FixtureOutput:
    return FixtureOutput(
        fixture.state,
        fixture.reason,
        fixture.factor,
        fixture.gains.compliance,
        fixture.direction,
        fixture.command_twist[:3],
        fixture.off_guide_m,
        fixture.engaged,
    )


def _recorded_output(state: FixtureState) -> FixtureOutput:
    return FixtureOutput(
        state.state,
        state.reason,
        state.factor,
        state.compliance,
        state.preferred_direction,
        state.command_twist[:3],
        state.off_guide_m,
        state.engaged,
    )
