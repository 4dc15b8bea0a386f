"""A description made anew for whatever simulates or draws an arm.

Only the joints of the arm, and those that follow them, move in it; all others are fixed where they
are held. Its root is the arm's base frame. Every limit and every mass stands in it, files are named
as asked, and those that cannot be used are left out.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from hmcs.arms.chain import Chain, Follower, displacement, origin_of
from hmcs.arms.elements import MOVING, Joint, Mistake, finite_numbers
from hmcs.arms.urdf import Urdf
from hmcs.arrays import Array

BODY_KG, FRAME_KG = 1.0, 0.001
"""Assumed of a link without an inertia that has a shape, and of one that has none."""
BODY_RADIUS_M = 0.05
"""Such a link weighs as a ball of this size."""
_KEPT_OF_JOINTS = ("parent", "child", "axis", "dynamics")


def prepared(
    urdf: Urdf, chain: Chain, base_link: str | None, file_name: Callable[[str, str], str | None]
) -> str:
    """Return the description as XML.

    `file_name` returns what a file is called in it, given its tag (`mesh`, `texture`) and the name
    in the description, or None where it is left out.
    """
    robot = Element("robot", name=urdf.robot.get("name") or "robot")
    for element in urdf.robot:
        if element.tag == "link":
            robot.append(_link(element, urdf, file_name))
        elif element.tag == "joint" and element.get("name") in urdf.joints:
            robot.append(_joint(element, urdf.joints[element.get("name", "")], chain))
        elif element.tag == "material":
            robot.append(_named(copy.deepcopy(element), file_name))
    if base_link is not None and base_link != urdf.root:
        _begin_at(robot, urdf, chain, base_link)
    ElementTree.indent(robot)
    return ElementTree.tostring(robot, encoding="unicode")


def assumed_masses(urdf: Urdf, chain: Chain) -> tuple[Mistake, ...]:
    """Return which moving links have a shape and no usable inertia, with what is assumed."""
    moving = _moving_links(urdf, chain)
    found = []
    for link in urdf.robot.findall("link"):
        if link.get("name") not in moving or not _has_shape(link):
            continue
        wrong = _wrong_inertia(link, _is_driven(link, urdf))
        if wrong:
            inertial = link.find("inertial")
            line = urdf.lines[id(link if inertial is None else inertial)]
            found.append(
                Mistake(
                    line,
                    f"link {link.get('name')} {wrong}: {BODY_KG:g} kg as a ball of "
                    f"{BODY_RADIUS_M:g} m radius assumed",
                )
            )
    return tuple(found)


def _link(told: Element, urdf: Urdf, file_name: Callable[[str, str], str | None]) -> Element:
    link = Element("link", name=told.get("name", ""))
    inertial = told.find("inertial")
    if inertial is not None and not _wrong_inertia(told, _is_driven(told, urdf)):
        link.append(copy.deepcopy(inertial))
    else:
        link.append(_ball(BODY_KG if _has_shape(told) else FRAME_KG))
    for tag in ("visual", "collision"):
        for shape in told.findall(tag):
            if next(_meshes(shape), None) is None:
                link.append(_named(copy.deepcopy(shape), file_name))
                continue
            own = copy.deepcopy(shape)
            names = [file_name("mesh", mesh.get("filename", "")) for mesh in _meshes(own)]
            if None not in names:
                link.append(_named(own, file_name))
    return link


def _joint(told: Element, joint: Joint, chain: Chain) -> Element:
    moves = joint.name in chain.joint_names or joint.name in chain.followers
    made = Element("joint", name=joint.name, type=joint.kind if moves else "fixed")
    if joint.name in chain.held and chain.held[joint.name] != 0.0:
        made.append(_origin(origin_of(joint) @ displacement(joint, chain.held[joint.name])))
    else:
        made.extend(copy.deepcopy(told.findall("origin")[:1]))
    for tag in _KEPT_OF_JOINTS:
        made.extend(copy.deepcopy(told.findall(tag)[:1]))
    if moves:
        made.append(Element("limit", _limit(joint, chain)))
        if joint.name in chain.followers:
            leader, multiplier, offset = chain.followers[joint.name]
            made.append(
                Element(
                    "mimic", joint=chain.joint_names[leader], multiplier=repr(multiplier),
                    offset=repr(offset),
                )
            )  # fmt: skip
    return made


def _limit(joint: Joint, chain: Chain) -> dict[str, str]:
    follower = chain.followers.get(joint.name)
    if follower is None:
        follower = Follower(chain.joint_names.index(joint.name), 1.0, 0.0)
    leader, multiplier, offset = follower
    limit = {
        "effort": repr(float(chain.efforts[leader])),
        "velocity": repr(float(abs(multiplier) * chain.limits.speed[leader])),
    }
    ends = (chain.limits.lower[leader], chain.limits.upper[leader])
    if joint.kind != "continuous" and np.isfinite(ends).all():
        lower, upper = sorted(float(multiplier * end + offset) for end in ends)
        limit |= {"lower": repr(lower), "upper": repr(upper)}
    elif joint.kind != "continuous":
        limit |= {"lower": repr(joint.lower or -np.pi), "upper": repr(joint.upper or np.pi)}
    return limit


def _begin_at(robot: Element, urdf: Urdf, chain: Chain, base_link: str) -> None:
    """Add a root at the base frame, from which the old one hangs."""
    frame = np.eye(4)
    for joint in urdf.path_to(base_link, urdf.root):
        frame = frame @ origin_of(joint)
        if chain.held.get(joint.name):
            frame = frame @ displacement(joint, chain.held[joint.name])
    name = "base_frame"
    while name in urdf.links or name in urdf.joints:
        name += "_"
    link = SubElement(robot, "link", name=name)
    link.append(_ball(FRAME_KG))
    joint_element = SubElement(robot, "joint", name=name, type="fixed")
    joint_element.append(_origin(np.array(np.linalg.inv(frame), dtype=float)))
    SubElement(joint_element, "parent", link=name)
    SubElement(joint_element, "child", link=urdf.root)


def _origin(frame: Array) -> Element:
    """Return a frame, homogeneous, as an element `origin`."""
    rotation = frame[:3, :3]
    pitch = np.arcsin(np.clip(-rotation[2, 0], -1.0, 1.0))
    if abs(rotation[2, 0]) < 1.0 - 1e-12:
        roll = np.arctan2(rotation[2, 1], rotation[2, 2])
        yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
    else:  # roll and yaw turn about the same axis
        roll, yaw = 0.0, np.arctan2(-rotation[0, 1], rotation[1, 1])
    return Element(
        "origin",
        xyz=" ".join(repr(float(value)) for value in frame[:3, 3]),
        rpy=" ".join(repr(float(value)) for value in (roll, pitch, yaw)),
    )


def _named(element: Element, file_name: Callable[[str, str], str | None]) -> Element:
    """Give the files an element names their names; remove textures that are left out."""
    for above in list(element.iter()):
        for each in list(above):
            if each.tag in ("mesh", "texture") and "filename" in each.attrib:
                name = file_name(each.tag, each.get("filename", ""))
                if name is None:
                    above.remove(each)
                else:
                    each.set("filename", name)
    return element


def _meshes(shape: Element) -> Iterator[Element]:
    return shape.iter("mesh")


def _moving_links(urdf: Urdf, chain: Chain) -> set[str]:
    moving: set[str] = set()
    children: dict[str, list[Joint]] = {}
    for joint in urdf.joints.values():
        children.setdefault(joint.parent, []).append(joint)
    coming = [(urdf.root, False)]
    while coming:
        link, moves = coming.pop()
        if moves:
            moving.add(link)
        for joint in children.get(link, ()):
            below = joint.name in chain.joint_names or joint.name in chain.followers
            coming.append((joint.child, moves or below))
    return moving


def _is_driven(link: Element, urdf: Urdf) -> bool:
    """Whether a link hangs on a joint that moves: without a mass it could not be accelerated."""
    above = urdf.joint_above(link.get("name", ""))
    return above is not None and above.kind in MOVING


def _has_shape(link: Element) -> bool:
    return link.find("visual") is not None or link.find("collision") is not None


def _wrong_inertia(link: Element, driven: bool) -> str:
    """Return what is wrong with a link's inertia; empty where it can be simulated."""
    inertial = link.find("inertial")
    if inertial is None:
        return "has no inertia"
    mass, inertia, origin = (inertial.find(tag) for tag in ("mass", "inertia", "origin"))
    numbers = finite_numbers("nan" if mass is None else mass.get("value", ""))
    if len(numbers) != 1 or numbers[0] < 0.0 or (numbers[0] == 0.0 and driven):
        return "has no mass above 0"
    if origin is not None and not all(
        len(finite_numbers(origin.get(key, "0 0 0"))) == 3 for key in ("xyz", "rpy")
    ):
        return "has a center of mass that is no three finite numbers"
    if numbers[0] == 0.0:
        return ""
    keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    six = finite_numbers(" ".join("nan" if inertia is None else inertia.get(k, "0") for k in keys))
    if len(six) != len(keys):
        return "has an inertia that is not of finite numbers"
    xx, xy, xz, yy, yz, zz = six
    least = float(np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])[0])
    return "has an inertia that no body has (not positive definite)" if least <= 0.0 else ""


def _ball(mass_kg: float) -> Element:
    inertial = Element("inertial")
    SubElement(inertial, "mass", value=repr(mass_kg))
    about = repr(0.4 * mass_kg * BODY_RADIUS_M**2)
    SubElement(inertial, "inertia", ixx=about, ixy="0", ixz="0", iyy=about, iyz="0", izz=about)
    return inertial
