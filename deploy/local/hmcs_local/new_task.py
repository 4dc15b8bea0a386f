"""`hmcs new`: a task file to begin with, every field of it explained where it stands."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from hmcs.bus.keys import KeyNameError, check_name
from hmcs.errors import UserError
from hmcs.task import check_task
from hmcs.task.values import unknown_name_message
from hmcs.whole_files import written_whole
from hmcs.write_places import check_file_place

Plane = Literal["xy", "xz", "yz"]
PLANES: tuple[Plane, ...] = ("xy", "xz", "yz")
STATES = ("approach", "work", "retract")


URDF = ".urdf"
_ROOM_M = (0.15, 0.3, 0.2)
"""About where an arm of one's own begins, to each side along x, y, z."""


class Place(NamedTuple):
    """Where an arm begins, and the room about it, m; those that come along look along +x."""

    start_m: tuple[float, ...]
    lower_m: tuple[float, ...]
    upper_m: tuple[float, ...]
    orientation_xyzw: tuple[float, ...] = (0.0, 0.7071067811865476, 0.0, 0.7071067811865476)


PLACES = {
    "puma560": Place((0.60, 0.0, 0.45), (0.45, -0.30, 0.25), (0.75, 0.30, 0.70)),
    "iiwa": Place((0.60, 0.0, 0.45), (0.45, -0.30, 0.25), (0.70, 0.30, 0.65)),
    "panda": Place((0.50, 0.0, 0.45), (0.35, -0.25, 0.25), (0.60, 0.25, 0.65)),
}
"""By the arm's name."""


def write_new_task(
    file: Path,
    states: Sequence[str],
    robot: str,
    plane: Plane | None,
    *,
    tool_link: str | None = None,
    force: bool = False,
) -> None:
    """Write a task file whose name is the file's, without its ending.

    `robot` is one that comes along, or the file of a URDF, whose tool is `tool_link` where several
    links may be. Raises UserError for a file that is there already (unless `force`), an unknown
    robot, an arm that cannot be used, and names that no task can have.
    """
    check_file_place(file, "NAME")
    if file.exists() and not force:
        raise UserError(f"{file}: is there already: choose another name, or --force to replace it")
    if robot.lower().endswith(URDF):
        place, setup = _own_arm(Path(robot), tool_link, file.parent)
    elif robot not in PLACES:
        told = unknown_name_message("robot", robot, tuple(PLACES))
        raise UserError(f"--robot: {told}, or the file of a URDF")
    elif tool_link is not None:
        raise UserError(f"--tool-link {tool_link}: {robot} has its own; it is for a URDF")
    else:
        place, setup = PLACES[robot], f"model: {robot}  # one of {', '.join(PLACES)}"
    for state in states:
        try:
            check_name("state", state)
        except KeyNameError as error:
            raise UserError(f"--states: {error}") from error
    if len(set(states)) < len(states):
        raise UserError(f"--states: {', '.join(states)}: expected every state once")
    text = task_text(file.stem, states, place, setup, plane)
    try:
        with written_whole(file) as written:
            written.write_text(text, encoding="utf-8")
            problems = check_task(written)
            if problems:
                raise UserError("\n".join(f"{each.path}: {each.message}" for each in problems))
    except OSError as error:
        raise UserError(f"{file}: cannot be written: {error.strerror}") from error


def _own_arm(urdf: Path, tool_link: str | None, folder: Path) -> tuple[Place, str]:
    """Return where an arm of one's own begins, and the lines that name it in a file of `folder`.

    It begins at its home; raises UserError for an arm that cannot be used.
    """
    from hmcs_robot.description.checking import reach_of, tool_at
    from hmcs_robot.description.described import check_follows, describe
    from hmcs_robot.robots import RobotModel, ros_package_path

    arm = describe(RobotModel(urdf, tool_link, package_path=ros_package_path()))
    check_follows(arm)
    tool, reach = tool_at(arm.chain, arm.home), reach_of(arm.chain, 2000)
    room = np.array(_ROOM_M)
    start = tool.position.round(4)
    place = Place(
        tuple(start.tolist()),
        tuple(np.minimum(np.maximum(start - room, reach.lower), start - 0.01).round(3).tolist()),
        tuple(np.maximum(np.minimum(start + room, reach.upper), start + 0.01).round(3).tolist()),
        tuple(tool.orientation.tolist()),
    )
    named = Path(os.path.relpath(urdf.resolve(), folder.resolve())).as_posix()
    home = ", ".join(f"{at:.4g}" for at in arm.home)
    setup = f"""urdf: {json.dumps(named)}  # beside this file
  tool_link: {json.dumps(arm.tool_link)}  # its frame is the tool frame
  # A comfortable posture, rad (m of prismatic joints), in the order of the joints:
  # {", ".join(arm.chain.joint_names)}
  home: [{home}]
  # Other postures by name; start_pose names the one to begin in.
  poses: {{}}"""
    return place, setup


def task_text(
    name: str, states: Sequence[str], place: Place, setup: str, plane: Plane | None
) -> str:
    """Return a task file with one gesteme for each state, in the order given.

    `setup` are the lines that name the robot.
    """
    gestemes = "\n".join(f"  - {{name: {state}}}" for state in states)
    following = [*states[1:], states[0]]
    chain = "\n".join(
        f"  - {{name: {state}, gestemes: [{state}], next: [{after}]}}"
        for state, after in zip(states, following, strict=True)
    )
    axes = ", ".join(plane or "xyz")
    return f"""\
# A task: its parts in their order, the room it is done in, and the robot that does it. Only what
# stands without a # in front counts. `hmcs task check {name}.yaml` names every mistake.
format: hmcs-task/1
name: {name}
description: ""

# The hand makes a step whenever it has moved so far. Smaller: recognized sooner, disturbed by
# tremor; some hundredths of the shortest part are good.
dead_zone_m: 0.008

# Gestemes are motion primitives, each one meaningful piece of motion. Several states may share one.
gestemes:
{gestemes}

# States are the parts of the task as you think of it. `next` lists what may follow: the last one
# leads back to the first, so that the task is done again and again; [] ends it, and whatever the
# hand does then is no part of it. {{a: 0.8, b: 0.2}} gives probabilities.
states:
{chain}

# States the task may begin in.
start: [{states[0]}]

recognition:
  # Which axes of the robot's base frame (x forward, y left, z up) carry the motion. Two of them for
  # what is done in a plane, e.g. [x, y] on a table.
  axes: [{axes}]

workspace:
  # The tool stays in this box, base frame, m.
  lower_m: {list(place.lower_m)}
  upper_m: {list(place.upper_m)}
  # Bodies the arm must not touch: box (size_m), sphere (radius_m) or cylinder (radius_m, length_m).
  obstacles: []
  #  - {{name: table, shape: box, position_m: [0.70, 0.0, 0.10], size_m: [0.60, 1.00, 0.05]}}
  # Where the tool is never let: plane (normal), sphere, box, capsule or mesh (file, STL or OBJ).
  forbidden: []
  #  - {{name: tabletop, shape: plane, position_m: [0, 0, 0.28], normal: [0, 0, 1]}}

robot:
  {setup}
  # Where the tool begins, m, and how it is turned, x y z w; it keeps it.
  tool_start_m: {list(place.start_m)}
  tool_orientation_xyzw: {list(place.orientation_xyzw)}
  tool_radius_m: 0.0  # it is kept out of forbidden regions as a ball of this size
  speed_limit_m_s: 0.25
  angular_speed_limit_rad_s: 0.5

fixture:
  law: general  # at the operator's own speed; `thesis` slows down while unsure
  compliance: insistence  # lets go of a hand that insists; or belief, fixed, cue
  maximum_factor: 0.83  # 0.5 leaves the hand free, 1 lets it go nowhere but along the path
  pull: 0.5  # how strongly a robot beside the learned path is led back to it; 0 for not at all
  operator_scale: 1.0  # m of the robot for a m of the hand
"""


def task_name_of(name: str) -> Path:
    """Return the file of a new task, with the ending of task files."""
    file = Path(name)
    return file if file.suffix in (".yaml", ".yml") else file.with_name(f"{file.name}.yaml")
