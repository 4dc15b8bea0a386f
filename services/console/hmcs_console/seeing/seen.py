"""What was heard last, and one moment of it to be drawn. Nothing here draws, nothing waits."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple, TypeVar

import numpy as np

from hmcs.bus.keys import Member
from hmcs.bus.messages import (
    Belief,
    Evidence,
    FixtureState,
    Health,
    Motion,
    RobotDescription,
    RobotState,
    Step,
    TrainingProgress,
)
from hmcs.recognizer_takeover import Agreement, Shadows
from hmcs_console.seeing.history import Rows, written
from hmcs_console.seeing.hops import FAST, SLOW, Arrivals, Cause
from hmcs_console.seeing.marking import Marking
from hmcs_console.seeing.runners import Runners
from hmcs_console.seeing.shelf import Shelved
from hmcs_console.seeing.step_evidence import StepEvidence, evidence_of, with_evidence
from hmcs_console.seeing.takes import Take
from hmcs_console.seeing.trails import Points, Trail
from hmcs_console.shapes.palette import UNKNOWN, Color, color_of
from hmcs_console.shapes.pieces import Pieces

T = TypeVar("T")

NS_PER_S = 1_000_000_000
FORGOTTEN_S = 2.0
"""What was not said again for so long is not shown as what is."""
ANSWER_S = 20.0
"""What came of a request is shown for so long, unless a robot may still move."""
MAY_MOVE = "**may still move**"
"""What is said of a robot that did not confirm a stop."""
UNRUN_AFTER_S = 1.0
"""A recognizer that nobody has run for so long is shown as such; a swap has no such gap."""
MOST_RECOGNIZERS = 32
"""That are heard at once; another is refused until one of those is silent and run by nobody."""
_SILENT_S = 30.0


class Picture(NamedTuple):
    """What is known at one moment, to be drawn."""

    robot: RobotState | None
    fixture: FixtureState | None
    belief: Belief | None
    """Of the recognizer that is followed."""
    evidence: tuple[Evidence, ...]
    """That it stands on, of each classifier; none where there is no such layer."""
    active: str
    """Name of that recognizer; empty while there is none."""
    recognizers: tuple[str, ...]
    agreement: dict[str, Agreement]
    """Of the others with it, by name."""
    robot_trail: Pieces
    hand_trail: Pieces
    """Laid to where the robot was when the hand took hold."""
    rows: Rows
    """The last half minute in numbers."""
    states: tuple[str, ...]
    """Of the task, as they are colored."""
    robot_description: RobotDescription | None
    health: dict[Member, Health | None]
    """Of every process that is there; None where it has not reported."""
    training: TrainingProgress | None
    marking: Marking
    """The part of the task the hand is said to be in."""
    answer: str
    """What came of the last thing that was asked for."""
    operator: str
    """Which page operates; empty while none does."""
    operating_client: int | None
    """Its number."""
    takeover: str
    """How far a newcomer among the recognizers is; empty where there is none."""
    take: Take = Take()
    """What is shown of a recording."""
    unrun: str = ""
    """Name of the recognizer that is followed where no process runs it; else empty."""
    lost: Mapping[int, str] = MappingProxyType({})
    """Why a page does not operate any more that did last, by its number."""
    device: str = ""
    """What the input device hears, e.g. `page`; empty where it has not reported."""
    recording: str = ""
    """Path of the recording that runs; empty where none does."""
    folder: str = ""
    """Of recordings, as the recorder sees it; empty where it has not reported."""
    before: str = ""
    """Name of the recognizer that was active before; empty where none was."""
    models: tuple[Shelved, ...] = ()
    """That are known, the active one first."""


class Seen:
    """Keeps the newest of everything."""

    def __init__(self, states: tuple[str, ...]) -> None:
        self.states = states
        """Of the task, as they are colored."""
        self.step: Step | None = None
        self.clock = ""
        """Boot of the input device whose steps are heard."""
        self.robot_description: RobotDescription | None = None
        self.members: set[Member] = set()
        self.health: dict[Member, Health] = {}
        self.training: TrainingProgress | None = None
        self.marking = Marking(None, by_pedal=True)
        self.takeover = ""
        self.device = ""
        """What the input device hears; empty where it has not reported."""
        self.recording = ""
        """Path of the recording that runs."""
        self.folder = ""
        """Of recordings."""
        self.before = ""
        """Which recognizer was active before."""
        self._answer = ""
        self._answered_s: float | None = None
        """When the answer was shown first."""
        self._rows: Rows = ()
        self._robot: tuple[float, RobotState] | None = None
        self._fixture: tuple[float, FixtureState] | None = None
        self._beliefs: dict[str, tuple[float, Belief]] = {}
        self._evidence: dict[str, StepEvidence] = {}
        self._fast, self._slow = Arrivals(FAST), Arrivals(SLOW)
        self._shadows = Shadows()
        self.runners = Runners()
        """Who works for which model."""
        self._followed_run = ("", 0.0)
        """Which recognizer is followed, and when somebody was seen to run it, s."""
        self._robot_trail, self._hand_trail = Trail(), Trail()
        self._hand_offset: Points | None = None

    @property
    def answer(self) -> str:
        """What came of the last thing that was asked for."""
        return self._answer

    @answer.setter
    def answer(self, text: str) -> None:
        self._answer, self._answered_s = text, None

    def _shown_answer(self, now_s: float) -> str:
        if self._answered_s is None:
            self._answered_s = now_s
        fades = MAY_MOVE not in self._answer
        return "" if fades and now_s - self._answered_s >= ANSWER_S else self._answer

    def robot_moved(self, now_s: float, robot: RobotState) -> None:
        """Take in where the robot is."""
        self._robot = now_s, robot
        self._robot_trail.add(robot.tool_position, self._color())

    def fixture_changed(self, now_s: float, fixture: FixtureState) -> None:
        """Take in what the fixture does."""
        self._fixture = now_s, fixture

    def hand_moved(self, motion: Motion) -> None:
        """Take in where the hand is.

        Its frame has a zero of its own; it is drawn as if it had taken hold of the tool.
        """
        if not motion.dead_man or motion.clutch or self._robot is None:
            self._hand_offset = None
            self._hand_trail.lift()
            return
        if self._hand_offset is None:
            self._hand_offset = self._robot[1].tool_position - motion.position
        self._hand_trail.add(motion.position + self._hand_offset, self._color())

    def admits(self, now_s: float, recognizer: str) -> bool:
        """Whether what a recognizer says is taken in; one that is not heard any more gives way."""
        if recognizer in self._beliefs or len(self._beliefs) < MOST_RECOGNIZERS:
            return True
        active = self.active(now_s)
        silent = [
            name
            for name, (said_s, _) in self._beliefs.items()
            if now_s - said_s > _SILENT_S
            and name != active
            and not self.runners.run(name, self.members)
        ]
        for name in silent:
            del self._beliefs[name]
            self._evidence.pop(name, None)
            self.forget(name)
            self.runners.forget(name)
        return bool(silent)

    def on_belief(
        self, now_s: float, recognizer: str, belief: Belief, by: Member | None = None
    ) -> None:
        """Take in what a recognizer that is admitted holds true, as a process says."""
        self._beliefs[recognizer] = now_s, belief
        if by is not None:
            self.runners.spoke(recognizer, by)
        if belief.states:
            self._shadows.heard(recognizer, belief.clock, belief.step, belief.likely_state)
        if not self.states:
            self.states = belief.states

    def evident(self, recognizer: str, evidence: Evidence) -> None:
        """Take in what a classifier makes of a step, for a recognizer that is heard."""
        if recognizer not in self._beliefs and len(self._evidence) >= MOST_RECOGNIZERS:
            return
        known = self._evidence.get(recognizer, StepEvidence())
        self._evidence[recognizer] = with_evidence(known, evidence)

    def in_fast_loop(self, stage: int, cause: Cause, at_ns: int) -> None:
        """Take in when a message of a stage of the fast loop came, monotonic ns."""
        self._fast.came(stage, cause, at_ns)

    def in_slow_loop(self, stage: int, cause: Cause, at_ns: int) -> None:
        """Take in when a message of a stage of the slow loop came, monotonic ns."""
        self._slow.came(stage, cause, at_ns)

    def active(self, now_s: float) -> str:
        """Return which recognizer is followed: as the fixture says, else the only one."""
        fixture = _fresh(self._fixture, now_s)
        if fixture is not None:
            return fixture.model
        return next(iter(self._beliefs)) if len(self._beliefs) == 1 else ""

    def agreement(self, active: str) -> dict[str, Agreement]:
        """Return how every other recognizer agrees with the active one, by name."""
        return self._shadows.agreement(active)

    def forget(self, recognizer: str) -> None:
        """Compare a recognizer by what it says from now on."""
        self._shadows.forget(recognizer)

    def unrun(self, now_s: float) -> str:
        """Return the recognizer that is followed where nobody runs it; else nothing."""
        active = self.active(now_s)
        if active != self._followed_run[0] or self.runners.run(active, self.members):
            self._followed_run = active, now_s
        return active if now_s - self._followed_run[1] >= UNRUN_AFTER_S else ""

    def write_down(self, now_s: float) -> None:
        """Add a row to the history."""
        self._rows = written(self._rows, now_s, self._numbers(now_s))

    def picture(self, now_s: float, operator: str, client: int | None) -> Picture:
        """Return this moment."""
        active = self.active(now_s)
        # A hand at rest makes no steps, and so no beliefs: the last one holds.
        belief = self._beliefs[active][1] if active in self._beliefs else None
        known = self._evidence.get(active)
        return Picture(
            robot=_fresh(self._robot, now_s),
            fixture=_fresh(self._fixture, now_s),
            belief=belief,
            evidence=() if belief is None or known is None else evidence_of(belief, known),
            active=active,
            recognizers=self._shadows.recognizers,
            agreement=self._shadows.agreement(active),
            robot_trail=self._robot_trail.pieces,
            hand_trail=self._hand_trail.pieces,
            rows=self._rows,
            states=self.states,
            robot_description=self.robot_description,
            health={member: self.health.get(member) for member in sorted(self.members)},
            training=self.training,
            marking=self.marking,
            answer=self._shown_answer(now_s),
            operator=operator,
            operating_client=client,
            takeover=self.takeover,
            unrun=self.unrun(now_s),
            device=self.device,
            recording=self.recording,
            folder=self.folder,
            before=self.before,
        )

    def _numbers(self, now_s: float) -> dict[str, float]:
        now_ns = round(now_s * NS_PER_S)
        numbers = self._fast.medians_ms(now_ns) | self._slow.medians_ms(now_ns)
        robot, fixture = _fresh(self._robot, now_s), _fresh(self._fixture, now_s)
        said = self._beliefs.get(self.active(now_s))
        if said is not None:
            belief = said[1]
            for state, probability in zip(belief.states, belief.probabilities, strict=False):
                numbers[f"P {state}"] = float(probability)
            numbers["P unknown"] = belief.unknown
        if fixture is not None:
            numbers["factor"] = fixture.factor
            numbers["operator"] = float(np.linalg.norm(fixture.operator_twist[:3]))
            if fixture.off_guide_m is not None:
                numbers["guide"] = fixture.off_guide_m
        if robot is not None:
            numbers["robot"] = float(np.linalg.norm(robot.tool_twist[:3]))
            if robot.nearest_distance_m is not None:
                numbers["obstacle"] = robot.nearest_distance_m
        return numbers

    def _color(self) -> Color:
        if self._fixture is None:
            return UNKNOWN
        said = self._beliefs.get(self._fixture[1].model)
        if said is None or not said[1].states or said[1].unknown > said[1].confidence:
            return UNKNOWN
        return color_of(said[1].likely_state, self.states)


def _fresh(said: tuple[float, T] | None, now_s: float) -> T | None:
    return None if said is None or now_s - said[0] > FORGOTTEN_S else said[1]
