"""Forward kinematics of a chain of joints in a URDF: where a link is at given joint positions.

Revolute, continuous, prismatic and fixed joints; a joint that mimics another follows it. Format:
the ROS wiki's `urdf/XML`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from hmcs.arrays import Array
from hmcs.bounded_files import read_bounded
from hmcs.errors import UserError
from hmcs.motion.quaternions import continuous, from_matrix
from hmcs.motion.urdf_xml import MOST_BYTES, urdf_element

MOVING = ("revolute", "continuous", "prismatic")
TOOLS = ("tool0", "tcp", "tool", "tool_link", "ee_link", "end_effector", "gripper_frame_link")
"""Names of links that are taken for the tool where nobody names it, the first that is there."""


class ChainError(UserError):
    """A URDF that has no such chain, or joint positions that are not of it."""


class Joint(NamedTuple):
    """A joint of the chain."""

    name: str
    kind: str
    origin: Array
    """Of its frame in the parent's, homogeneous, m, shape (4, 4)."""
    axis: Array
    """Unit vector in its own frame, shape (3,)."""
    follows: str
    """The joint whose position counts: another one where it mimics that, else its own name."""
    multiplier: float
    offset: float
    """rad, or m of a prismatic joint."""


class Chain(NamedTuple):
    """Joints from the root of a URDF to one of its links."""

    file: Path
    link: str
    joints: tuple[Joint, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Joints whose positions are needed, each once, from the root on."""
        moving = (joint.follows for joint in self.joints if joint.kind in MOVING)
        return tuple(dict.fromkeys(moving))

    @property
    def turning(self) -> frozenset[str]:
        """Those of them whose positions are angles."""
        kinds = {joint.follows for joint in self.joints if joint.kind in MOVING[:2]}
        return frozenset(kinds)


def read_chain(file: Path, link: str = "") -> Chain:
    """Return the chain from the root of a URDF to a link; by default to its tool.

    That is the first of TOOLS that is there, else the only link that carries no other. Raises
    UrdfXmlError for a file that is no URDF, and ChainError, naming the file and what it has, for no
    such link or several that may be meant, and for a joint that has no position of one number.
    """
    root = urdf_element(read_bounded(file, MOST_BYTES), str(file))
    above = {_child(file, joint): joint for joint in root.findall("joint")}
    links = [each.get("name", "") for each in root.findall("link")]
    link = link or _tool(file, links, above)
    if link not in links:
        raise ChainError(f"{file}: has no link {link!r}; its links are {_listed(links)}")
    by_name = {joint.get("name", ""): joint for joint in above.values()}
    joints, at = list[Joint](), link
    while at in above:
        if len(joints) > len(above):
            raise ChainError(f"{file}: link {link!r} hangs on itself: a URDF is a tree")
        element = above[at]
        joints.append(_joint(file, element, by_name))
        at = _linked(file, element, "parent")
    return Chain(file, link, tuple(reversed(joints)))


def poses(chain: Chain, names: Sequence[str], positions: Array) -> tuple[Array, Array]:
    """Return where the chain's link is: m, shape (T, 3), and x y z w, shape (T, 4).

    In the frame of the URDF's root. `positions`, shape (T, n), are of the joints `names`, rad or m.
    Raises ChainError where one of the chain's joints is not among them.
    """
    missing = [name for name in chain.names if name not in names]
    if missing:
        raise ChainError(
            f"{chain.file}: the chain to {chain.link!r} needs the positions of {_listed(missing)}; "
            f"there are those of {_listed(names)}: name another link by --link, or the URDF of "
            "this robot"
        )
    count = len(positions)
    turn, place = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
    for joint in chain.joints:
        place = place + turn @ joint.origin[:3, 3]
        turn = turn @ joint.origin[:3, :3]
        if joint.kind not in MOVING:
            continue
        value = joint.multiplier * positions[:, names.index(joint.follows)] + joint.offset
        if joint.kind == "prismatic":
            place = place + value[:, None] * (turn @ joint.axis)
        else:
            turn = turn @ _turns(joint.axis, value)
    return place, continuous([from_matrix(each) for each in turn])


def _turns(axis: Array, angles: Array) -> Array:
    """Rotation matrices, shape (T, 3, 3), about one axis (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine, cosine = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    return np.asarray(np.eye(3) + sine * cross + (1.0 - cosine) * (cross @ cross))


def _tool(file: Path, links: Sequence[str], above: Mapping[str, ElementTree.Element]) -> str:
    named = next((name for name in TOOLS if name in links), None)
    if named is not None:
        return named
    parents = {_linked(file, joint, "parent") for joint in above.values()}
    ends = [name for name in links if name not in parents]
    if len(ends) != 1:
        raise ChainError(
            f"{file}: which link is the tool? Name it by --link; the chains end at {_listed(ends)}"
        )
    return ends[0]


def _child(file: Path, joint: ElementTree.Element) -> str:
    return _linked(file, joint, "child")


def _linked(file: Path, joint: ElementTree.Element, which: str) -> str:
    element = joint.find(which)
    if element is None or not element.get("link"):
        raise ChainError(f"{file}: joint {joint.get('name')!r} has no {which} link")
    return str(element.get("link"))


def _joint(
    file: Path, element: ElementTree.Element, by_name: Mapping[str, ElementTree.Element]
) -> Joint:
    name, kind = element.get("name", ""), element.get("type", "")
    if kind not in (*MOVING, "fixed"):
        raise ChainError(
            f"{file}: joint {name!r} is {kind!r}, expected one of {', '.join((*MOVING, 'fixed'))}"
        )
    origin, axis = element.find("origin"), element.find("axis")
    pose = np.eye(4)
    if origin is not None:
        pose[:3, 3] = _numbers(file, name, origin.get("xyz", "0 0 0"))
        pose[:3, :3] = _by_angles(_numbers(file, name, origin.get("rpy", "0 0 0")))
    along = _numbers(file, name, "1 0 0" if axis is None else axis.get("xyz", "1 0 0"))
    length = float(np.linalg.norm(along))
    if kind in MOVING and length < 1e-9:
        raise ChainError(f"{file}: joint {name!r} has the axis 0 0 0, expected a direction")
    along = along / length if length else along
    follows, multiplier, offset = _followed(file, name, by_name)
    return Joint(name, kind, pose, along, follows, multiplier, offset)


def _followed(
    file: Path, name: str, by_name: Mapping[str, ElementTree.Element]
) -> tuple[str, float, float]:
    """The joint that a joint follows at last, with multiplier and offset."""
    multiplier, offset, passed = 1.0, 0.0, {name}
    while (mimic := by_name[name].find("mimic")) is not None:
        offset += multiplier * float(_numbers(file, name, mimic.get("offset", "0"), 1)[0])
        multiplier *= float(_numbers(file, name, mimic.get("multiplier", "1"), 1)[0])
        name = mimic.get("joint", "")
        if name in passed or name not in by_name:
            raise ChainError(f"{file}: a joint mimics {name!r}, which is itself or no joint")
        passed.add(name)
    return name, multiplier, offset


def _by_angles(rpy: Array) -> Array:
    """The rotation about fixed x, y and z axes, in this order."""
    about_x, about_y, about_z = (
        _turns(axis, np.array([angle]))[0] for axis, angle in zip(np.eye(3), rpy, strict=True)
    )
    return np.asarray(about_z @ about_y @ about_x)


def _numbers(file: Path, joint: str, text: str, count: int = 3) -> Array:
    try:
        numbers = np.array([float(word) for word in text.split()])
    except ValueError:
        numbers = np.array([])
    if len(numbers) != count or not np.isfinite(numbers).all():
        raise ChainError(
            f"{file}: joint {joint!r} has {text[:60]!r}, expected {count} finite number(s)"
        )
    return numbers


def _listed(names: Sequence[str], most: int = 20) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(name[:60] for name in names[:most]) + more
