"""The parts of a task, each checked for itself: what every field of a task file means."""

from __future__ import annotations

import re
from collections.abc import Mapping, Set
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from hmcs.task.fixture_parts import StateFixture
from hmcs.task.robots import check_robot, known_robots
from hmcs.task.values import (
    Axis,
    Distribution,
    Name,
    NotNegative,
    Number,
    Part,
    Point,
    Positive,
    Rotation,
    SignedAxis,
    different,
)

SPEED_LIMIT_M_S, ANGULAR_SPEED_LIMIT_RAD_S = 0.25, 0.5
"""Of a robot whose task file names none."""


def _check_measures(
    part: Part,
    shape: str,
    wanted: set[str],
    measures: tuple[str, ...],
    optional: Set[str] = frozenset(),
) -> None:
    """Raise ValueError unless a shape has of all measures those it needs and no others."""
    given = {measure for measure in measures if getattr(part, measure) is not None}
    missing, needless = wanted - given, given - wanted - optional
    if missing:
        raise ValueError(f"a {shape} needs {' and '.join(sorted(missing))}")
    if needless:
        raise ValueError(f"a {shape} has no {' and no '.join(sorted(needless))}")


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
    fixture: StateFixture | None = None
    """What its fixture does otherwise than the task's."""


class Recognition(Part):
    """What the recognizer looks at."""

    axes: Annotated[tuple[Axis, ...], Field(min_length=1), AfterValidator(different)] = (
        "x",
        "y",
        "z",
    )
    """Axes of the workspace that carry the gestemes."""


class Drawings(Part):
    """How drawings (`lasa:SHAPE/NUMBER`) enter the workspace; a shape's name is its gesteme's."""

    scale: Positive
    """m of the workspace for a m drawn."""
    plane: Annotated[tuple[SignedAxis, SignedAxis], AfterValidator(different)]
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
        _check_measures(self, self.shape, wanted[self.shape], ("size_m", "radius_m", "length_m"))
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
        _check_measures(self, self.shape, wanted, measures, optional)
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


class Cooperation(Part):
    """How a robot gives way to the force at its tool (thesis 4.3)."""

    force_threshold_n: NotNegative = 2.0
    """A weaker force moves nothing."""
    torque_threshold_n_m: NotNegative = 0.2
    m_s_per_n: Positive = 0.01
    """Speed for a force beyond the threshold."""
    rad_s_per_n_m: Positive = 0.2
    tool_mass_kg: NotNegative = 0.5
    """Of what hangs on the force sensor; its weight is removed from what is read."""
    tool_center_m: Point = (0.0, 0.0, 0.03)
    """Of its mass, tool frame."""
    sensor_bandwidth_hz: Positive = 30.0
    """The sensor passes what is slower (−3 dB)."""


class ToolSetup(Part):
    """What the tool fills of the room, tool frame; the fixture keeps all of it out of regions."""

    shape: Literal["capsule", "box"]
    position_m: Point = (0.0, 0.0, 0.0)
    """Where a capsule begins; of the center of a box."""
    end_m: Point | None = None
    """Where a capsule ends."""
    size_m: tuple[Positive, Positive, Positive] | None = None
    """Full lengths of a box along its x, y, z."""
    orientation_xyzw: Rotation | None = None
    """Of a box; by default along the tool frame."""
    radius_m: NotNegative | None = None
    """Of a capsule; a box grows by it and is rounded off, by default not at all."""

    @model_validator(mode="after")
    def _has_its_measures(self) -> Self:
        wanted = {"capsule": {"end_m", "radius_m"}, "box": {"size_m"}}[self.shape]
        optional = {"orientation_xyzw", "radius_m"} if self.shape == "box" else set()
        measures = ("end_m", "size_m", "orientation_xyzw", "radius_m")
        _check_measures(self, self.shape, wanted, measures, optional)
        return self


JointPositions = dict[str, Number] | tuple[Number, ...]
"""rad, or m of a prismatic joint: by joint, or of all joints in their order."""
_OF_A_URDF = (
    *("tool_link", "base_link", "tool_offset_m", "home", "poses", "start_pose", "package_path"),
)
_NO_PART_OF_A_NAME = re.compile(r"[^A-Za-z0-9._-]+")
_LONGEST_NAME = 64


class RobotSetup(Part):
    """The robot, and where it begins."""

    model: Annotated[str, AfterValidator(check_robot)] | None = None
    """A robot that comes along; in place of urdf."""
    urdf: Annotated[str, Field(min_length=1)] | None = None
    """The description of an arm of one's own; beside the task file where it is no absolute path."""
    tool_link: str | None = None
    """Link of the URDF whose frame is the tool frame; may be left out where only one can be it."""
    base_link: str | None = None
    """Link of the URDF whose frame is the base frame; by default the one all others hang from."""
    tool_offset_m: Number = 0.0
    """The tool frame lies so far along the z axis of tool_link."""
    home: JointPositions | None = None
    """A comfortable posture, rad (m of prismatic joints), by joint or of all in their order; by
    default one is found."""
    poses: Mapping[Name, JointPositions] = {}
    """Other postures of the arm, by name; as home."""
    start_pose: Name | None = None
    """The one of `poses` that the task begins in: of several postures with the tool where it
    starts, this one. By default a comfortable one near home is found."""
    package_path: tuple[str, ...] = ()
    """Folders that hold the packages of `package://` names in the URDF; beside the task file where
    they are no absolute paths."""
    mode: Literal["teleoperated", "cooperative"] = "teleoperated"
    """`teleoperated`: it follows a hand elsewhere. `cooperative`: the hand leads it by its tool."""
    cooperation: Cooperation = Cooperation()
    """Of `cooperative`."""
    tool_start_m: Point
    """Position of the tool at the start of the task, base frame."""
    tool_orientation_xyzw: Rotation
    """Of the tool, base frame; kept during the task."""
    tool_radius_m: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0
    """The tool is kept out of forbidden regions as a ball of this size about its tip."""
    tool: ToolSetup | None = None
    """What the tool fills of the room where it is no ball; instead of tool_radius_m."""
    speed_limit_m_s: Positive = SPEED_LIMIT_M_S
    angular_speed_limit_rad_s: Positive = ANGULAR_SPEED_LIMIT_RAD_S

    @property
    def name(self) -> str:
        """Which robot, as messages say it: its model, or the name of its URDF without the end."""
        named = self.model if self.urdf is None else Path(self.urdf).stem
        short = _NO_PART_OF_A_NAME.sub("-", named or "").strip("-._")[:_LONGEST_NAME]
        return short or "robot"

    @model_validator(mode="after")
    def _is_one_robot(self) -> Self:
        if (self.model is None) == (self.urdf is None):
            both = "both model and urdf are given" if self.model else "no robot is named"
            raise ValueError(
                f"{both}, expected model: NAME (one of {', '.join(known_robots())}) or, for an arm "
                "of your own, urdf: FILE"
            )
        needless = [
            name
            for name in _OF_A_URDF
            if self.urdf is None and getattr(self, name) != type(self).model_fields[name].default
        ]
        if needless:
            raise ValueError(
                f"{', '.join(needless)} belongs to an arm of your own (urdf: FILE), and model "
                f"{self.model} has its own: leave it out"
            )
        return self

    @model_validator(mode="after")
    def _begins_in_one_of_its_poses(self) -> Self:
        if self.start_pose is not None and self.start_pose not in self.poses:
            there = ", ".join(self.poses) or "none"
            raise ValueError(f"start_pose is {self.start_pose!r}, expected one of poses: {there}")
        return self

    @model_validator(mode="after")
    def _has_one_tool(self) -> Self:
        if self.tool is not None and self.tool_radius_m > 0:
            raise ValueError(
                f"tool_radius_m ({self.tool_radius_m:g}) makes the tool a ball and tool a "
                f"{self.tool.shape}: leave one of them out"
            )
        return self
