"""The arm between two links of a description: its joints, forward kinematics and Jacobian.

Joints that are no part of it are held, at 0 or in the middle of a range without 0; a joint that
mimics one of the arm's follows it. What the file leaves out is assumed, and said with its line.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from hmcs.arms.elements import MOVING, Joint, Mistake
from hmcs.arms.state import JointLimits, Pose
from hmcs.arms.urdf import Urdf, UrdfError, told
from hmcs.arrays import Array
from hmcs.motion import quaternions

ASSUMED_RANGE: Mapping[str, tuple[float, float]] = {
    "revolute": (-np.pi, np.pi),
    "prismatic": (-0.5, 0.5),
}
"""rad, m; of a joint whose file gives none."""
ASSUMED_SPEED: Mapping[str, float] = {"revolute": 1.0, "continuous": 1.0, "prismatic": 0.2}
"""rad/s, m/s."""
ASSUMED_EFFORT: Mapping[str, float] = {"revolute": 2e4, "continuous": 2e4, "prismatic": 5e4}
"""N·m, N: enough to hold any arm, for one that is too weak sinks."""
FORCES: Mapping[str, str] = {"revolute": "N·m", "continuous": "N·m", "prismatic": "N"}
UNITS: Mapping[str, str] = {"revolute": "rad", "continuous": "rad", "prismatic": "m"}


class Follower(NamedTuple):
    """A joint that moves with one of the arm's: `multiplier` times its position plus `offset`."""

    leader: int
    """Which joint of the arm."""
    multiplier: float
    offset: float


class Segment(NamedTuple):
    """A joint between base and tool, with what leads to it."""

    origin: Array
    """Of the joint's frame in that of the joint before, homogeneous, shape (4, 4)."""
    axis: Array
    """Unit vector in the joint's frame, shape (3,)."""
    slides: bool
    """Whether it is prismatic."""
    follows: Follower


@dataclass(frozen=True)
class Chain:
    """An arm of n joints."""

    joint_names: tuple[str, ...]
    kinds: tuple[str, ...]
    limits: JointLimits
    """rad, or m of a prismatic joint; infinite where a joint turns without end."""
    efforts: Array
    """N·m, or N, shape (n,)."""
    segments: tuple[Segment, ...]
    tool_frame: Array
    """In the frame of the last joint, homogeneous, shape (4, 4)."""
    followers: Mapping[str, Follower]
    """Every joint that mimics one of the arm's, by its name, wherever it is."""
    held: Mapping[str, float]
    """Where all other joints stand, rad or m, by their names."""
    assumed: tuple[Mistake, ...]
    """What the file leaves out, and what stands in for it."""

    def poses(self, positions: Array) -> Array:
        """Return the tool's pose at joint positions, shape (…, n), homogeneous, (…, 4, 4)."""
        return self._frames(positions)[0]

    def jacobians(self, positions: Array) -> Array:
        """Return the Jacobian of the tool at joint positions, (…, n): shape (…, 6, n).

        In the base frame, linear part first.
        """
        tool, frames = self._frames(positions)
        jacobian = np.zeros((*positions.shape[:-1], 6, len(self.joint_names)))
        for segment, frame in zip(self.segments, frames, strict=True):
            axis = frame[..., :3, :3] @ segment.axis
            column = np.zeros((*positions.shape[:-1], 6))
            if segment.slides:
                column[..., :3] = axis
            else:
                column[..., :3] = np.cross(axis, tool[..., :3, 3] - frame[..., :3, 3])
                column[..., 3:] = axis
            jacobian[..., segment.follows.leader] += segment.follows.multiplier * column
        return jacobian

    def origins(self, positions: Array) -> Array:
        """Return where base, joints and tool are, m, at joint positions (n,): shape (k + 2, 3)."""
        tool, frames = self._frames(positions)
        return np.array([np.zeros(3), *(frame[:3, 3] for frame in frames), tool[:3, 3]])

    def drawn(self, count: int, share: float = 1.0) -> Array:
        """Return postures, always the same ones, from this share of the ranges: (count, n)."""
        lower, upper = self.finite_range
        middle, half = (lower + upper) / 2, share * (upper - lower) / 2
        random = np.random.default_rng(0)
        return random.uniform(middle - half, middle + half, (count, len(lower)))

    @property
    def finite_range(self) -> tuple[Array, Array]:
        """Lower and upper ends, (n,): a turn for a joint that turns without end."""
        return (
            np.where(np.isfinite(self.limits.lower), self.limits.lower, -np.pi),
            np.where(np.isfinite(self.limits.upper), self.limits.upper, np.pi),
        )

    def with_speeds(self, speeds: Array) -> Chain:
        """Return the arm with other joint speeds, rad/s or m/s, (n,)."""
        return replace(self, limits=self.limits._replace(speed=speeds))

    def at(self, positions: Array) -> Posture:
        """Return the arm put at joint positions, (n,)."""
        return Posture(self, positions)

    def _frames(self, positions: Array) -> tuple[Array, list[Array]]:
        frame = np.broadcast_to(np.eye(4), (*positions.shape[:-1], 4, 4))
        frames = []
        for segment in self.segments:
            frame = frame @ segment.origin
            frames.append(frame)
            leader, multiplier, offset = segment.follows
            frame = frame @ _moved(segment, multiplier * positions[..., leader] + offset)
        return frame @ self.tool_frame, frames


class Posture:
    """A chain that is put anywhere."""

    def __init__(self, chain: Chain, positions: Array) -> None:
        self._chain = chain
        self._positions = positions
        self.limits = chain.limits

    def place(self, joint_positions: Array) -> None:
        """Put the arm at `joint_positions`, rad or m, shape (n,)."""
        self._positions = joint_positions

    def tool(self) -> Pose:
        """Return the pose of the tool there."""
        return pose_of(self._chain.poses(self._positions))

    def jacobian(self, joint_positions: Array) -> Array:
        """Return the Jacobian of the tool, shape (6, n)."""
        return self._chain.jacobians(joint_positions)


def pose_of(frame: Array) -> Pose:
    """Return a homogeneous frame, (4, 4), as position and quaternion."""
    return Pose(frame[:3, 3], quaternions.from_matrix(frame[:3, :3]))


def chain_of(
    urdf: Urdf, tool_link: str, base_link: str | None = None, tool_offset_m: float = 0.0
) -> Chain:
    """Return the arm from `base_link`, by default the root, to `tool_link`.

    The tool frame is that of its link, shifted along its z. Raises UrdfError for links that are
    not there or not above one another, joints no arm is made of, and empty ranges.
    """
    base = urdf.root if base_link is None else base_link
    urdf.check_link(tool_link, "tool_link")
    urdf.check_link(base, "base_link")
    try:
        path = urdf.path_to(tool_link, base)
    except KeyError:
        raise UrdfError(
            f"{urdf.file}:{urdf.links[tool_link]}: tool link {tool_link!r} does not hang on base "
            f"link {base!r}: choose another base_link, or leave it out (then it is {urdf.root!r})"
        ) from None
    own = tuple(j for j in path if j.kind in MOVING and j.mimic is None)
    _check_joints(urdf, path, own, tool_link, base)
    followers, held = _others(urdf, own)
    assumed: list[Mistake] = []
    limits, efforts = _limits(urdf, own, followers, assumed)
    segments, since = list[Segment](), np.eye(4)
    for joint in path:
        since = since @ origin_of(joint)
        slides = joint.kind == "prismatic"
        axis = np.array(joint.axis) / np.linalg.norm(joint.axis) if joint.kind in MOVING else None
        if axis is not None and joint.name in followers:
            segments.append(Segment(since, axis, slides, followers[joint.name]))
            since = np.eye(4)
        elif axis is not None:
            still = Segment(np.eye(4), axis, slides, Follower(0, 0.0, 0.0))
            since = since @ _moved(still, np.array(held[joint.name]))
    since = since.copy()
    since[:3, 3] += tool_offset_m * since[:3, 2]
    names = tuple(joint.name for joint in own)
    return Chain(
        names,
        tuple(joint.kind for joint in own),
        limits,
        efforts,
        tuple(segments),
        since,
        {name: followed for name, followed in followers.items() if name not in names},
        held,
        tuple(assumed),
    )


def origin_of(joint: Joint) -> Array:
    """Return a joint's frame in that of its parent, homogeneous, shape (4, 4)."""
    (roll, pitch, yaw), frame = joint.rpy, np.eye(4)
    frame[:3, :3] = _turns("z", yaw) @ _turns("y", pitch) @ _turns("x", roll)
    frame[:3, 3] = joint.xyz
    return frame


def displacement(joint: Joint, position: float) -> Array:
    """Return how far a joint has moved its child, homogeneous, shape (4, 4)."""
    axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
    segment = Segment(np.eye(4), axis, joint.kind == "prismatic", Follower(0, 1.0, 0.0))
    return _moved(segment, np.array(position))


def _turns(axis: str, angle: float) -> Array:
    about = np.array([float(axis == each) for each in "xyz"])
    return _moved(Segment(np.eye(4), about, False, Follower(0, 1.0, 0.0)), np.array(angle))[:3, :3]


def _moved(segment: Segment, position: Array) -> Array:
    """Return what joint positions, shape (…), make of a segment's frame: (…, 4, 4)."""
    frame = np.zeros((*position.shape, 4, 4))
    frame[..., range(4), range(4)] = 1.0
    if segment.slides:
        frame[..., :3, 3] = position[..., None] * segment.axis
        return frame
    x, y, z = segment.axis
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sine, cosine = np.sin(position)[..., None, None], np.cos(position)[..., None, None]
    # Rodrigues.
    frame[..., :3, :3] += sine * across + (1.0 - cosine) * (across @ across)
    return frame


def _check_joints(
    urdf: Urdf, path: tuple[Joint, ...], own: tuple[Joint, ...], tool_link: str, base: str
) -> None:
    mistakes = [
        Mistake(
            joint.line,
            f"joint {joint.name} between base and tool is {joint.kind}, expected one of: "
            f"{', '.join(MOVING)}, fixed: choose {joint.child!r} as base_link, or make it fixed",
        )
        for joint in path
        if joint.kind not in (*MOVING, "fixed")
    ]
    if mistakes:
        raise UrdfError(told(urdf.file, mistakes))
    if not own:
        raise UrdfError(
            f"{urdf.file}:{urdf.links[tool_link]}: no joint moves the tool link {tool_link!r} "
            f"against {base!r}: choose another tool_link or base_link"
        )


def _others(urdf: Urdf, own: tuple[Joint, ...]) -> tuple[dict[str, Follower], dict[str, float]]:
    """Return how joints follow those of the arm, themselves included, and where others stand."""
    followers = {joint.name: Follower(k, 1.0, 0.0) for k, joint in enumerate(own)}
    held: dict[str, float] = {}

    def settle(joint: Joint) -> None:
        if joint.name in followers or joint.name in held:
            return
        if joint.mimic is None:
            lower, upper = joint.lower or 0.0, joint.upper or 0.0
            outside = joint.kind in ("revolute", "prismatic") and not lower <= 0.0 <= upper
            held[joint.name] = (lower + upper) / 2 if outside and lower < upper else 0.0
            return
        leader = urdf.joints[joint.mimic.joint]
        settle(leader)
        multiplier, offset = joint.mimic.multiplier, joint.mimic.offset
        if leader.name in held:
            held[joint.name] = multiplier * held[leader.name] + offset
        else:
            first = followers[leader.name]
            followers[joint.name] = Follower(
                first.leader, multiplier * first.multiplier, multiplier * first.offset + offset
            )

    for joint in urdf.joints.values():
        if joint.kind in MOVING:
            settle(joint)
    return followers, held


def _limits(
    urdf: Urdf,
    own: tuple[Joint, ...],
    followers: Mapping[str, Follower],
    assumed: list[Mistake],
) -> tuple[JointLimits, Array]:
    ranges = [_range(urdf, joint, assumed) for joint in own]
    lower, upper = (np.array(ends) for ends in zip(*ranges, strict=True))
    speed = np.array(
        [
            _positive(j, "velocity", j.speed, ASSUMED_SPEED[j.kind], f"{UNITS[j.kind]}/s", assumed)
            for j in own
        ]
    )
    efforts = np.array(
        [
            _positive(j, "effort", j.effort, ASSUMED_EFFORT[j.kind], FORCES[j.kind], assumed)
            for j in own
        ]
    )
    for name, (leader, multiplier, offset) in followers.items():
        joint = urdf.joints[name]
        if joint is own[leader] or multiplier == 0.0:
            continue
        if joint.kind != "continuous" and None not in (joint.lower, joint.upper):
            ends = sorted(
                (end - offset) / multiplier for end in (joint.lower, joint.upper) if end is not None
            )
            if ends[1] > ends[0]:
                lower[leader] = max(lower[leader], ends[0])
                upper[leader] = min(upper[leader], ends[1])
        if joint.speed:
            speed[leader] = min(speed[leader], joint.speed / abs(multiplier))
        if lower[leader] >= upper[leader]:
            raise UrdfError(
                f"{urdf.file}:{joint.limit_line}: joint {name} mimics {own[leader].name}, and no "
                "position is within the ranges of both: correct <limit> or <mimic>"
            )
    return JointLimits(lower, upper, speed), efforts


def _range(urdf: Urdf, joint: Joint, assumed: list[Mistake]) -> tuple[float, float]:
    if joint.kind == "continuous":
        return -np.inf, np.inf
    if joint.lower is None and joint.upper is None:
        lower, upper = ASSUMED_RANGE[joint.kind]
        assumed.append(
            Mistake(
                joint.limit_line,
                f"joint {joint.name} has no range (lower, upper): {lower:.4g} to {upper:.4g} "
                f"{UNITS[joint.kind]} assumed",
            )
        )
        return lower, upper
    for end, value in (("lower", joint.lower), ("upper", joint.upper)):
        if value is None:
            assumed.append(
                Mistake(joint.limit_line, f"joint {joint.name} has no {end} limit: 0 assumed")
            )
    lower, upper = joint.lower or 0.0, joint.upper or 0.0
    if lower >= upper:
        what = "is empty" if lower == upper else "is inverted"
        free = (
            ", or make it continuous where it turns without end" if joint.kind == "revolute" else ""
        )
        raise UrdfError(
            f"{urdf.file}:{joint.limit_line}: the range of joint {joint.name} {what}: lower is "
            f"{lower:g} and upper {upper:g}, expected lower below upper, in {UNITS[joint.kind]}: "
            f"correct <limit>{free}"
        )
    return lower, upper


def _positive(
    joint: Joint,
    what: str,
    given: float | None,
    assumption: float,
    unit: str,
    assumed: list[Mistake],
) -> float:
    if given is not None and given > 0.0:
        return given
    lacks = f"no {what}" if given is None else f"{what} {given:g}, with which nothing moves"
    assumed.append(
        Mistake(joint.limit_line, f"joint {joint.name} has {lacks}: {assumption:g} {unit} assumed")
    )
    return assumption
