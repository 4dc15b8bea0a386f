"""What a robot does, how it looks, and the request that it stops."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hmcs.bus.arrays import LARGEST, Floats, Quaternion, Vector3, Vector6
from hmcs.bus.messages.fields import Count, Name, Within
from hmcs.bus.messages.message import Message


class RobotState(Message):
    """Where the robot is and what it touches."""

    SCHEMA = "robot_state"
    VERSION = 4

    robot: Name
    """Which robot, e.g. `puma560`."""
    joint_names: tuple[str, ...] = ()
    """As in the robot's URDF, in the order of `joint_positions`; empty where they have none."""
    joint_positions: Floats
    """rad, shape (n,)."""
    joint_velocities: Floats
    """rad/s, shape (n,)."""
    tool_position: Vector3
    """m, base frame, shape (3,)."""
    tool_orientation: Quaternion
    """x y z w, base frame, shape (4,)."""
    tool_twist: Vector6
    """m/s and rad/s, base frame, shape (6,)."""
    reference_twist: Vector6
    """The velocity it is following now, after its own limits, shape (6,)."""
    nearest_obstacle: str
    """Name of the nearest obstacle; empty where none is within reach of the search."""
    nearest_distance_m: Annotated[float, Field(ge=-1), Within(LARGEST)] | None
    """Distance to it; None where none is within reach of the search; negative in penetration."""
    contacts: tuple[str, ...]
    """Names of what the robot touches."""
    stop: Literal[
        "none",
        "disengaged",
        "no_command",
        "stale_command",
        "refused_command",
        "second_writer",
        "not_paired",
        "late_tick",
        "silent_arm",
        "collision",
        "asked",
    ]
    """Why the robot stands; `none` while it follows commands, `asked` after somebody asked it to
    `stop`, `not_paired` while the fixture controller drives another robot, `late_tick` after its
    own control loop came too late, `silent_arm` while it hears nothing of the arm it moves."""
    limited: tuple[str, ...]
    """Limits that shape the motion now, e.g. `speed`, `workspace`, `region`, `joint_3`,
    `singularity`."""
    region_distance_m: Annotated[float, Field(ge=-1), Within(LARGEST)] | None = None
    """From the tool to the nearest forbidden region of its task; negative inside; None where there
    is none within reach of the search."""
    late_ticks: Count = 0
    """Control ticks that came later than a period after they were due, since the robot started."""
    command_age_s: Annotated[float, Field(ge=0), Within(LARGEST)] | None = None
    """Since the last command was taken, by the robot's own clock; None before the first."""


class StopRequest(Message):
    """Somebody wants every robot of the cell to stand.

    It holds like the answer to the question `stop`: until the operator lets go and takes hold
    again. It needs no answer, so that a robot hears it whatever hangs beside it.
    """

    SCHEMA = "stop_request"

    reason: str
    """Who wants it and why, in one line."""


class RobotDescription(Message):
    """How a robot looks: what is needed to draw it."""

    SCHEMA = "robot_looks"

    robot: Name
    """Which robot, e.g. `puma560`."""
    urdf: str
    """The robot's description; files it names are in `files`."""
    joints: tuple[str, ...]
    """Names in the URDF of the joints of `joint_positions`, in their order."""
    files: dict[str, bytes]
    """Meshes by the name the URDF gives them."""
