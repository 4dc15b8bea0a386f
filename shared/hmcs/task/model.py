"""A task as a whole, and what its parts must agree on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Annotated, Literal, NamedTuple, Self

from pydantic import Field, model_validator

from hmcs.task.fixture_parts import FixtureSetup, VolumeSetup
from hmcs.task.parts import (
    Drawings,
    ForbiddenRegion,
    Gesteme,
    Obstacle,
    Recognition,
    RobotSetup,
    State,
    Workspace,
)
from hmcs.task.values import TWIST_AXES, Distribution, Name, Part, unknown_name_message

Location = tuple[str | int, ...]

_MOST_UNKNOWN = 50
"""Unknown names that are reported."""


class Task(Part):
    """A task: what the operator may do, where, and with which robot.

    Raises pydantic's ValidationError, naming every contradiction between its parts.
    """

    format: Literal["hmcs-task/1"]
    name: Name
    description: str = ""
    dead_zone_m: Annotated[float, Field(gt=0, le=0.2, allow_inf_nan=False)]
    """δ: the shortest motion that counts as a step."""
    gestemes: Annotated[tuple[Gesteme, ...], Field(min_length=1)]
    states: Annotated[tuple[State, ...], Field(min_length=1)]
    start: Annotated[Distribution, Field(min_length=1)]
    """In which states the task may begin, with which probability; or a list of them."""
    recognition: Recognition = Recognition()
    drawings: Drawings | None = None
    workspace: Workspace
    robot: RobotSetup
    fixture: FixtureSetup = FixtureSetup()

    @model_validator(mode="after")
    def _parts_agree(self) -> Self:
        found = contradictions(
            Draft(
                list(enumerate(self.gestemes)),
                list(enumerate(self.states)),
                self.start,
                list(enumerate(self.workspace.obstacles)),
                self.workspace,
                self.robot,
                forbidden=list(enumerate(self.workspace.forbidden)),
                dead_zone_m=self.dead_zone_m,
                fixture=self.fixture,
            )
        )
        if found:
            raise ValueError("; ".join(message for _, message in found))
        return self

    def state(self, name: str) -> State:
        """Return the state of that name; raises KeyError where there is none."""
        for state in self.states:
            if state.name == name:
                return state
        raise KeyError(unknown_name_message("state", name, [state.name for state in self.states]))


class Draft(NamedTuple):
    """Those parts of a task that are right in themselves, with their places in the file."""

    gestemes: Sequence[tuple[int, Gesteme]]
    states: Sequence[tuple[int, State]]
    start: dict[str, float] | None
    obstacles: Sequence[tuple[int, Obstacle]]
    workspace: Workspace | None
    """Its obstacles aside."""
    robot: RobotSetup | None
    complete: bool = True
    """False where gestemes or states are missing from it: names may then be among those."""
    forbidden: Sequence[tuple[int, ForbiddenRegion]] = ()
    dead_zone_m: float | None = None
    fixture: FixtureSetup | None = None


class Contradiction(NamedTuple):
    """Where the parts of a task do not agree."""

    location: Location
    message: str


def contradictions(draft: Draft) -> list[Contradiction]:
    """Return everything the parts of a task do not agree on."""
    found = [
        *_repeated(("gestemes",), draft.gestemes),
        *_repeated(("states",), draft.states),
        *_repeated(("workspace", "obstacles"), draft.obstacles),
        *_repeated(("workspace", "forbidden"), draft.forbidden),
    ]
    if draft.workspace is not None and draft.robot is not None:
        found += _outside(draft.workspace, draft.robot)
    found += _narrow_volumes(draft)
    found += _blocked_axes(draft)
    if draft.complete:
        # Which name is nearest is looked for among all: that takes its time.
        strangers = list(islice(_unknown_names(draft), _MOST_UNKNOWN))
        # A misspelled name hides a way; what can be reached is reported once the names are right.
        found += strangers or _unreachable(draft)
    return found


def _repeated(
    field: Location, parts: Sequence[tuple[int, Gesteme | State | Obstacle | ForbiddenRegion]]
) -> Iterator[Contradiction]:
    seen: set[str] = set()
    for index, part in parts:
        if part.name in seen:
            yield Contradiction(
                (*field, index, "name"),
                f"{part.name!r} is the name of another one already, expected every name once",
            )
        seen.add(part.name)


def _unknown_names(draft: Draft) -> Iterator[Contradiction]:
    states = {state.name for _, state in draft.states}
    gestemes = {gesteme.name for _, gesteme in draft.gestemes}
    for index, state in draft.states:
        before: set[str] = set()
        for place, name in enumerate(state.gestemes):
            if name not in gestemes:
                yield Contradiction(
                    ("states", index, "gestemes", place),
                    unknown_name_message("gesteme", name, gestemes),
                )
            if name in before:
                yield Contradiction(
                    ("states", index, "gestemes", place), f"{name!r} stands twice, expected once"
                )
            before.add(name)
        for name in state.next:
            if name not in states:
                yield Contradiction(
                    ("states", index, "next", name), unknown_name_message("state", name, states)
                )
    for name in draft.start or ():
        if name not in states:
            yield Contradiction(("start", name), unknown_name_message("state", name, states))


def _unreachable(draft: Draft) -> Iterator[Contradiction]:
    if draft.start is None:
        return
    follow = {state.name: state.next for _, state in draft.states}
    reached: set[str] = set()
    coming = [name for name in draft.start if name in follow]
    while coming:
        name = coming.pop()
        if name not in reached:
            reached.add(name)
            coming += [after for after in follow[name] if after in follow]
    for index, state in draft.states:
        if reached and state.name not in reached:
            yield Contradiction(
                ("states", index, "name"),
                f"state {state.name!r} can never be reached: name it in start, or in next of a "
                "state that can",
            )


def _narrow_volumes(draft: Draft) -> Iterator[Contradiction]:
    """Where a volume is narrower than what counts as motion at all."""
    places: list[tuple[Location, VolumeSetup | None]] = [
        (("states", index, "fixture", "volume"), state.fixture.volume)
        for index, state in draft.states
        if state.fixture is not None
    ]
    if draft.fixture is not None:
        places.insert(0, (("fixture", "volume"), draft.fixture.volume))
    for location, volume in places:
        if volume is None or draft.dead_zone_m is None or volume.of_spread is not None:
            continue
        widest_m = max(knot.radius_m for knot in volume.knots)
        if widest_m < draft.dead_zone_m:
            yield Contradiction(
                location,
                f"radius is {widest_m:g} m at most, below dead_zone_m ({draft.dead_zone_m:g}): "
                "within it nothing is recognized; make it wider, or leave volume out",
            )


def _blocked_axes(draft: Draft) -> Iterator[Contradiction]:
    """Where the operator is to help on an axis that passes nothing of the hand."""
    if draft.fixture is None:
        return
    blocked = [
        axis for axis, share in zip(TWIST_AXES, draft.fixture.axis_scale, strict=True) if not share
    ]
    for index, state in draft.states:
        shared = None if state.fixture is None else state.fixture.shared
        for axis in shared.operator_axes if shared is not None else ():
            if axis in blocked:
                yield Contradiction(
                    ("states", index, "fixture", "shared", "operator_axes"),
                    f"{axis} is the operator's, but axis_scale of the fixture lets nothing of it "
                    "pass: give it a scale, or take it out of operator_axes",
                )


def _outside(workspace: Workspace, robot: RobotSetup) -> Iterator[Contradiction]:
    excess_m = workspace.excess_m(robot.tool_start_m)
    if excess_m:
        where = ", ".join(f"{excess:.3f} m along {axis}" for axis, excess in excess_m.items())
        yield Contradiction(
            ("robot", "tool_start_m"),
            f"{list(robot.tool_start_m)} lies outside the workspace by {where}, expected it "
            f"between {list(workspace.lower_m)} and {list(workspace.upper_m)}",
        )
