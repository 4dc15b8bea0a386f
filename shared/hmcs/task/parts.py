"""The parts of a task, each checked for itself: what every field of a task file means."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
_SUM_TOLERANCE = 1e-6
_UNIT_TOLERANCE = 1e-3


def _name(name: str) -> str:
    # The same names `hmcs.bus.keys` admits, which this module must not know.
    if not _NAME.fullmatch(name):
        raise ValueError(
            f"{name!r} cannot be part of a key, expected 1 to 64 letters, digits, '.', '_' or '-', "
            "beginning with a letter or digit"
        )
    return name


def _uniform(value: Any) -> Any:
    if not isinstance(value, (list, tuple)):
        return value
    twice = sorted({str(item) for item in value if value.count(item) > 1})
    if twice:
        raise ValueError(f"{', '.join(twice)} stands twice in the list, expected each name once")
    if not all(isinstance(item, str) for item in value):
        raise ValueError("expected a list of names, or a mapping of names to probabilities")
    return {name: 1.0 / len(value) for name in value}


def _distribution(value: dict[str, float]) -> dict[str, float]:
    for name, probability in value.items():
        if not 0 < probability <= 1:
            raise ValueError(f"probability of {name} is {probability:g}, expected 0 < p <= 1")
    total = sum(value.values())
    if value and abs(total - 1) > _SUM_TOLERANCE:
        raise ValueError(
            f"probabilities sum to {total:g}, expected 1 (a plain list of names makes them equal)"
        )
    return value


def _unit(quaternion: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    length = sum(q * q for q in quaternion) ** 0.5
    if abs(length - 1) > _UNIT_TOLERANCE:
        raise ValueError(f"quaternion x y z w has length {length:g}, expected 1")
    return quaternion


def _different(value: tuple[str, ...]) -> tuple[str, ...]:
    axes = [axis.removeprefix("-") for axis in value]
    if len(set(axes)) < len(axes):
        raise ValueError(f"axes are {', '.join(value)}, expected each axis once")
    return value


Name = Annotated[str, AfterValidator(_name)]
Distribution = Annotated[
    dict[Name, float], BeforeValidator(_uniform), AfterValidator(_distribution)
]
Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Point = tuple[Number, Number, Number]
Rotation = Annotated[tuple[Number, Number, Number, Number], AfterValidator(_unit)]
Axis = Literal["x", "y", "z"]
SignedAxis = Literal["x", "y", "z", "-x", "-y", "-z"]
AXES: Mapping[str, int] = {"x": 0, "y": 1, "z": 2}
"""Where each axis stands in a position."""


class Part(BaseModel):
    """A part of a task: frozen, and unknown fields are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


class Gesteme(Part):
    """An action-primitive of the operator's motion."""

    name: Name
    """Of its learned model; for drawings the shape's name."""
    description: str = ""


class State(Part):
    """A task state: a mental stage of the operator."""

    name: Name
    gestemes: Annotated[tuple[Name, ...], Field(min_length=1)]
    """Gestemes performed in it; one gesteme may serve several states."""
    next: Distribution
    """Which states follow, with which probability; a list makes them equally probable, an empty
    one ends the task here."""
    description: str = ""


class Recognition(Part):
    """What the recognizer looks at."""

    axes: Annotated[tuple[Axis, ...], Field(min_length=1), AfterValidator(_different)] = (
        "x",
        "y",
        "z",
    )
    """Axes of the workspace that carry the gestemes."""


class Drawings(Part):
    """How drawings (`lasa:SHAPE/NUMBER`) enter the workspace; a shape's name is its gesteme's."""

    scale: Positive
    """m of the workspace for a m drawn."""
    plane: Annotated[tuple[SignedAxis, SignedAxis], AfterValidator(_different)]
    """Where drawn x and drawn y go."""


class Obstacle(Part):
    """A fixed body."""

    name: Name
    shape: Literal["box", "sphere", "cylinder"]
    position_m: Point
    """Of its center, base frame."""
    orientation_xyzw: Rotation = (0.0, 0.0, 0.0, 1.0)
    size_m: tuple[Positive, Positive, Positive] | None = None
    """Full lengths of a box along its x, y, z."""
    radius_m: Positive | None = None
    """Of a sphere or a cylinder."""
    length_m: Positive | None = None
    """Of a cylinder, along its z."""

    @model_validator(mode="after")
    def _has_its_measures(self) -> Self:
        wanted = {"box": {"size_m"}, "sphere": {"radius_m"}, "cylinder": {"radius_m", "length_m"}}
        given = {
            measure
            for measure in ("size_m", "radius_m", "length_m")
            if getattr(self, measure) is not None
        }
        missing, needless = wanted[self.shape] - given, given - wanted[self.shape]
        if missing:
            raise ValueError(f"a {self.shape} needs {' and '.join(sorted(missing))}")
        if needless:
            raise ValueError(f"a {self.shape} has no {' and no '.join(sorted(needless))}")
        return self


class ForbiddenRegion(Part):
    """Where the fixture never lets the tool go, base frame."""

    name: Name
    shape: Literal["plane", "sphere", "box", "capsule", "mesh"]
    position_m: Point
    """On a plane; of the center of a sphere or a box; where a capsule begins; of a mesh's origin.
    """
    orientation_xyzw: Rotation = (0.0, 0.0, 0.0, 1.0)
    """Of a box or a mesh."""
    normal: Point | None = None
    """Of a plane: points to where the tool may be."""
    size_m: tuple[Positive, Positive, Positive] | None = None
    """Full lengths of a box along its x, y, z."""
    radius_m: Positive | None = None
    """Of a sphere or a capsule."""
    end_m: Point | None = None
    """Where a capsule ends."""
    file: str | None = None
    """STL or OBJ file of a mesh; beside the task file where it is no absolute path."""
    scale: Positive | None = None
    """m for a unit of the mesh, 1 by default."""

    @model_validator(mode="after")
    def _has_its_measures(self) -> Self:
        wanted = {
            "plane": {"normal"},
            "sphere": {"radius_m"},
            "box": {"size_m"},
            "capsule": {"end_m", "radius_m"},
            "mesh": {"file"},
        }[self.shape]
        optional = {"scale"} if self.shape == "mesh" else set()
        measures = ("normal", "size_m", "radius_m", "end_m", "file", "scale")
        given = {measure for measure in measures if getattr(self, measure) is not None}
        if wanted - given:
            raise ValueError(f"a {self.shape} needs {' and '.join(sorted(wanted - given))}")
        if given - wanted - optional:
            needless = " and no ".join(sorted(given - wanted - optional))
            raise ValueError(f"a {self.shape} has no {needless}")
        if self.normal is not None and not any(self.normal):
            raise ValueError("normal is [0, 0, 0], expected a direction")
        return self


class Workspace(Part):
    """Where the robot's tool may be, base frame."""

    lower_m: Point
    upper_m: Point
    obstacles: tuple[Obstacle, ...] = ()
    forbidden: tuple[ForbiddenRegion, ...] = ()
    """What the fixture keeps the tool out of; it slides along them."""

    @model_validator(mode="after")
    def _is_a_box(self) -> Self:
        for axis, lower, upper in zip("xyz", self.lower_m, self.upper_m, strict=True):
            if lower >= upper:
                raise ValueError(
                    f"lower_m is {lower:g} and upper_m {upper:g} along {axis}, expected lower_m "
                    "below upper_m on every axis"
                )
        return self

    def excess_m(self, point: Point) -> dict[str, float]:
        """Return how far, m, a point lies outside, for each axis on which it does."""
        return {
            axis: max(lower - value, value - upper)
            for axis, value, lower, upper in zip(
                "xyz", point, self.lower_m, self.upper_m, strict=True
            )
            if not lower <= value <= upper
        }


class RobotSetup(Part):
    """The robot, and where it begins."""

    model: Literal["puma560", "iiwa", "panda"]
    tool_start_m: Point
    """Position of the tool at the start of the task, base frame."""
    tool_orientation_xyzw: Rotation
    """Of the tool, base frame; kept during the task."""
    tool_radius_m: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0
    """The tool is kept out of forbidden regions as a ball of this size about its tip."""
    speed_limit_m_s: Positive = 0.25
    angular_speed_limit_rad_s: Positive = 0.5


class FixtureSetup(Part):
    """How the virtual fixture answers the belief."""

    law: Literal["general", "thesis"] = "general"
    """`general` is (2.29), `thesis` is (3.6)."""
    compliance: Literal["belief", "insistence"] = "insistence"
    """What softens the fixture: `belief` is (3.2), the less sure the softer; `insistence` lets go
    besides of an operator whose hand keeps going across the guide."""
    maximum_factor: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] = 0.83
    """ξ of (3.6): the fixturing factor when the recognition is certain."""
    gain_rise_per_s: Positive = 6.0
    gain_fall_per_s: Positive = 16.0
    operator_scale: Positive = 1.0
    """m/s of the tool for a m/s of the hand."""
    pull: Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)] = 0.5
    """k_d of (2.32) for a hard fixture: how strongly a robot beside the path is led back to it by
    the general law; 0 for none."""
    pull_full_at_m: Positive = 0.02
    """A robot so far from the path is led back with full strength."""
    pull_reach_m: Positive = 0.025
    """Much farther than this a path counts as left, and leads nobody back."""
    shift_beyond_m: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.006
    """A path goes on from where the one before it ended, if the robot is no farther beside it than
    this when its segment begins; otherwise it is laid at the robot. 0 lays it there always."""
    tremor: Literal["none", "notch"] = "notch"
    """How tremor is taken out of the operator's velocity: a notch lets nothing pass at its
    center."""
    tremor_hz: Positive = 10.0
    tremor_quality: Positive = 0.7
    """Center of the notch, and how narrow it is: center over width."""
