"""An arm with all that its description and its model say: read, checked and completed once."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hmcs.arms.chain import UNITS, Chain, chain_of
from hmcs.arms.elements import Mistake
from hmcs.arms.inverses import FEWEST, FULL, smallest_singular_value
from hmcs.arms.tools import check_joints, only_tool_link
from hmcs.arms.urdf import Urdf, read_urdf, told
from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs_robot.description.meshes import READ, MeshFiles, unusable
from hmcs_robot.description.prepared import assumed_masses, prepared
from hmcs_robot.robots import JointPositions, RobotModel

_LEAST_RAD_PER_RAD = 0.01
"""A tool that turns less about an axis, at home, does not follow a turn about it."""
_POSTURES = 512
"""Among which the home of an arm without one is looked for."""
_AROUND_MIDDLE = 0.6
"""Share of the joints' ranges, about their middle, that these are drawn from."""
_ROOM_ENOUGH = 0.3
"""rad or m; more room to the ends of a range makes no posture better."""


class DescribedArm(NamedTuple):
    """An arm, its joints, its postures, and what was assumed of it."""

    model: RobotModel
    tool_link: str
    urdf: Urdf
    chain: Chain
    files: MeshFiles
    home: Array
    """rad or m, shape (n,)."""
    poses: Mapping[str, Array]
    """Named postures."""
    notes: tuple[Mistake, ...]
    """What the file leaves out and what is assumed, what it names and nobody can use, and what an
    arm of few joints cannot follow."""

    def to_simulate(self, formats: Collection[str] = READ) -> str:
        """Return a URDF whose files are named by absolute paths, with meshes of these formats."""

        def path(tag: str, name: str) -> str | None:
            found = self.files.find(name)
            if found is None or (tag == "mesh" and found.suffix.lower() not in formats):
                return None
            return str(found)

        return prepared(self.urdf, self.chain, self.model.base_link, path)

    def to_draw(self) -> str:
        """Return a URDF whose files have the names of the description."""
        return prepared(self.urdf, self.chain, self.model.base_link, lambda _, name: name)

    @property
    def told(self) -> str:
        """What was assumed, a line each; empty where all is given."""
        return told(self.urdf.file, self.notes)


def describe(model: RobotModel) -> DescribedArm:
    """Return an arm as its file describes it.

    Raises UrdfError for a file that describes no such arm, with the lines; UserError for postures
    that are none of this arm.
    """
    urdf = read_urdf(model.urdf)
    tool_link = model.tool_link or only_tool_link(urdf)
    chain = chain_of(urdf, tool_link, model.base_link, model.tool_offset_m)
    if model.joint_speed_rad_s is not None:
        speeds = np.array(model.joint_speed_rad_s, dtype=float)
        if len(speeds) != len(chain.joint_names):
            raise UserError(
                f"{model.urdf}: {len(speeds)} joint speeds are given for its "
                f"{len(chain.joint_names)} joints ({', '.join(chain.joint_names)})"
            )
        chain = chain.with_speeds(speeds)
    files = MeshFiles(model.urdf, model.package_path)
    home = (
        comfortable_posture(chain)
        if model.home is None
        else posture(model.urdf, chain, "home", model.home)
    )
    poses = {
        name: posture(model.urdf, chain, f"pose {name!r}", given)
        for name, given in model.poses.items()
    }
    notes = (
        *chain.assumed,
        *assumed_masses(urdf, chain),
        *unusable(urdf, files),
        *_not_followed(urdf, chain, tool_link, home),
    )
    return DescribedArm(model, tool_link, urdf, chain, files, home, poses, tuple(sorted(notes)))


def check_follows(arm: DescribedArm) -> None:
    """Raise UrdfError for an arm that cannot follow its tool's velocity in every direction."""
    check_joints(arm.urdf, arm.chain, arm.tool_link, arm.model.base_link, arm.home)


def _not_followed(urdf: Urdf, chain: Chain, tool_link: str, home: Array) -> tuple[Mistake, ...]:
    """Return which turns of its tool an arm of fewer than six joints cannot follow, if it is one.

    As it is at home, while the tool stays in its place.
    """
    count = len(chain.joint_names)
    if not FEWEST <= count < FULL:
        return ()
    jacobian = chain.jacobians(home)
    _, _, right = np.linalg.svd(jacobian[:3])
    turning, sizes, _ = np.linalg.svd(jacobian[3:] @ right[3:].T)
    lost = turning[:, int((sizes > _LEAST_RAD_PER_RAD).sum()) :].T
    axes = " and ".join("(" + ", ".join(f"{value:.2f}" for value in axis) + ")" for axis in lost)
    line = urdf.links[tool_link]
    what = "turns of" if len(lost) == 3 else f"turns about {axes} (base frame, at home) of"
    return (
        Mistake(
            line,
            f"{count} joints lead link {tool_link} to every position; {what} its orientation are "
            "not followed, and it turns while it moves",
        ),
    )


def posture(urdf: Path, chain: Chain, what: str, given: JointPositions) -> Array:
    """Return joint positions, (n,), given as a list or by joint; joints without one stand at 0.

    Raises UserError, which names the joints, where they are not those of the arm or out of range.
    """
    names = chain.joint_names
    if isinstance(given, Mapping):
        for name in given:
            if name not in names:
                near = get_close_matches(name, names, n=1)
                guess = f", did you mean {near[0]}?" if near else ""
                raise UserError(
                    f"{urdf}: {what} of the robot names {name!r}, which is no joint of the arm"
                    f"{guess} (its joints are: {', '.join(names)})"
                )
        lower, upper = chain.finite_range
        rest = np.where((lower <= 0) & (upper >= 0), 0.0, (lower + upper) / 2)
        positions = np.array(
            [given.get(name, float(at)) for name, at in zip(names, rest, strict=True)]
        )
    else:
        if len(given) != len(names):
            raise UserError(
                f"{urdf}: {what} of the robot has {len(given)} positions, and the arm "
                f"{len(names)} joints: {', '.join(names)}"
            )
        positions = np.array(given, dtype=float)
    for name, kind, at, low, high in zip(
        names, chain.kinds, positions, chain.limits.lower, chain.limits.upper, strict=True
    ):
        if not low <= at <= high:
            raise UserError(
                f"{urdf}: {what} of the robot has joint {name} at {at:g}, expected "
                f"{low:g} to {high:g} {UNITS[kind]}"
            )
    return positions


def comfortable_posture(chain: Chain) -> Array:
    """Return a posture about the middle of the ranges, (n,), far from singularities and from ends.

    Always the same for the same arm.
    """
    lower, upper = chain.finite_range
    drawn = np.vstack([(lower + upper) / 2, chain.drawn(_POSTURES, _AROUND_MIDDLE)])
    smallest = smallest_singular_value(chain.jacobians(drawn))
    to_ends = np.minimum(drawn - chain.limits.lower, chain.limits.upper - drawn).min(axis=1)
    best = int(np.argmax(smallest + 0.5 * np.minimum(to_ends, _ROOM_ENOUGH)))
    return np.asarray(drawn[best])


def joint_positions_text(positions: Sequence[float] | Array) -> str:
    """Return joint positions as a task file has them."""
    return "[" + ", ".join(f"{float(position):.4g}" for position in positions) + "]"
