"""The links and joints of a URDF, each checked for itself, and that they are one tree."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from difflib import get_close_matches
from typing import NamedTuple
from xml.etree.ElementTree import Element

_LONGEST_NAME = 120
MOVING = ("revolute", "continuous", "prismatic")
"""Kinds of joints an arm may be made of."""
KINDS = (*MOVING, "fixed", "floating", "planar")


class Mistake(NamedTuple):
    """One mistake in a file."""

    line: int
    message: str


class Mimic(NamedTuple):
    """A joint follows another: its position is `multiplier` times that one's, plus `offset`."""

    joint: str
    multiplier: float
    offset: float


class Joint(NamedTuple):
    """A joint as the file gives it; what stands nowhere is None."""

    name: str
    kind: str
    parent: str
    child: str
    xyz: tuple[float, ...]
    """m, of its frame in the parent's."""
    rpy: tuple[float, ...]
    """rad, turns about the parent's x, y and z axis, in this order."""
    axis: tuple[float, ...]
    lower: float | None
    """rad, or m of a prismatic joint."""
    upper: float | None
    effort: float | None
    """N·m, or N."""
    speed: float | None
    """rad/s, or m/s."""
    mimic: Mimic | None
    line: int
    limit_line: int
    """Of its `limit`; that of the joint where it has none."""


def shortened_list(names: Iterable[str], most: int = 40) -> str:
    """Return names with commas between them, `most` of them."""
    listed = list(names)
    more = f", and {len(listed) - most} more" if len(listed) > most else ""
    return ", ".join(listed[:most]) + more


class Reader:
    """Reads links and joints, and gathers in `mistakes` what is wrong with them."""

    def __init__(self, lines: Mapping[int, int]) -> None:
        self._lines = lines
        self.mistakes: list[Mistake] = []

    def links(self, robot: Element) -> dict[str, int]:
        """Return the line of each link, by its name."""
        links: dict[str, int] = {}
        for link in robot.findall("link"):
            name = self._name(link, links)
            if name:
                links[name] = self._lines[id(link)]
        if not links:
            self._refuse(robot, "has no link, expected at least a base and a tool")
        return links

    def joints(self, robot: Element, links: Mapping[str, int]) -> dict[str, Joint]:
        """Return each joint, by its name."""
        joints: dict[str, Joint] = {}
        for element in robot.findall("joint"):
            name = self._name(element, joints)
            if name:
                joints[name] = self._joint(element, name, links)
        for joint in joints.values():
            if joint.mimic is not None and joint.mimic.joint not in joints:
                self.mistakes.append(
                    Mistake(joint.line, f"joint {joint.name} mimics {joint.mimic.joint!r}, which "
                            "is no joint of this file: correct the name, or remove <mimic>")
                )  # fmt: skip
        self.mistakes += _circles_of_mimics(joints)
        return joints

    def check_tree(self, links: Mapping[str, int], joints: Mapping[str, Joint]) -> None:
        """Add what keeps links and joints from being one tree."""
        parents: dict[str, Joint] = {}
        for joint in joints.values():
            other = parents.setdefault(joint.child, joint)
            if other is not joint:
                self.mistakes.append(
                    Mistake(joint.line, f"link {joint.child!r} hangs on joint {joint.name} and on "
                            f"{other.name} (line {other.line}): a URDF is a tree, without loops; "
                            "cut the loop at one of them")
                )  # fmt: skip
        if self.mistakes:
            return
        roots = [link for link in links if link not in parents]
        if len(roots) > 1:
            self.mistakes.append(
                Mistake(links[roots[1]], f"links {shortened_list(map(repr, roots))} hang on no "
                        "joint, expected one root: join them with a fixed joint, or remove the "
                        "links that are not used")
            )  # fmt: skip
            return
        for name in links:
            above, passed = name, {name}
            while above in parents:
                above = parents[above].parent
                if above in passed:
                    self.mistakes.append(
                        Mistake(parents[name].line, f"link {name!r} hangs on itself through "
                                f"{shortened_list(sorted(passed))}: a URDF is a tree, without "
                                "loops; correct the parent of one of the joints")
                    )  # fmt: skip
                    return
                passed.add(above)

    def _joint(self, element: Element, name: str, links: Mapping[str, int]) -> Joint:
        kind = element.get("type", "")
        if kind not in KINDS:
            self._refuse(
                element, f"joint {name} has type {kind!r}, expected one of: {', '.join(KINDS)}"
            )
        ends = []
        for which in ("parent", "child"):
            end = element.find(which)
            link = "" if end is None else end.get("link", "")
            if link not in links:
                near = get_close_matches(link, links, n=1)
                guess = f", did you mean {near[0]}?" if near else ""
                self._refuse(
                    element if end is None else end,
                    f"joint {name} names {link!r} as its {which}, which is no link of this file"
                    f"{guess}",
                )
            ends.append(link)
        axis = self._numbers(element, "axis", "xyz", (1.0, 0.0, 0.0))
        if kind in MOVING and not math.hypot(*axis) > 1e-6:
            self._refuse(element, f"joint {name} has the axis 0 0 0, expected a direction")
        limit = element.find("limit")
        lower, upper, effort, speed = (
            self._number(element, "limit", attribute)
            for attribute in ("lower", "upper", "effort", "velocity")
        )
        return Joint(
            name, kind, ends[0], ends[1],
            self._numbers(element, "origin", "xyz", (0.0, 0.0, 0.0)),
            self._numbers(element, "origin", "rpy", (0.0, 0.0, 0.0)),
            axis, lower, upper, effort, speed, self._mimic(element), self._lines[id(element)],
            self._lines[id(element if limit is None else limit)],
        )  # fmt: skip

    def _mimic(self, element: Element) -> Mimic | None:
        mimic = element.find("mimic")
        if mimic is None:
            return None
        multiplier, offset = (self._number(element, "mimic", a) for a in ("multiplier", "offset"))
        return Mimic(
            mimic.get("joint", ""),
            1.0 if multiplier is None else multiplier,
            0.0 if offset is None else offset,
        )

    def _name(self, element: Element, others: Mapping[str, object]) -> str:
        name = element.get("name", "")
        if not name or len(name) > _LONGEST_NAME or not name.isprintable():
            self._refuse(
                element,
                f"a {element.tag} is named {name[:_LONGEST_NAME]!r}, expected a name of 1 to "
                f"{_LONGEST_NAME} printable characters",
            )
            return ""
        if name in others:
            self._refuse(
                element, f"{element.tag} {name!r} stands here a second time: rename one of them"
            )
            return ""
        return name

    def _number(self, joint: Element, tag: str, attribute: str) -> float | None:
        element = joint.find(tag)
        if element is None or attribute not in element.attrib:
            return None
        numbers = self._read(joint, element, attribute, 1)
        return numbers[0] if numbers else None

    def _numbers(
        self, joint: Element, tag: str, attribute: str, default: tuple[float, ...]
    ) -> tuple[float, ...]:
        element = joint.find(tag)
        if element is None or attribute not in element.attrib:
            return default
        return self._read(joint, element, attribute, len(default)) or default

    def _read(
        self, joint: Element, element: Element, attribute: str, count: int
    ) -> tuple[float, ...]:
        text = element.get(attribute, "")
        numbers = finite_numbers(text)
        if len(numbers) != count:
            wanted = "a finite number" if count == 1 else f"{count} finite numbers"
            self._refuse(
                element,
                f"{attribute} of <{element.tag}> of joint {joint.get('name')} is {text[:60]!r}, "
                f"expected {wanted}",
            )
            return ()
        return numbers

    def _refuse(self, element: Element, message: str) -> None:
        self.mistakes.append(Mistake(self._lines[id(element)], message))


def finite_numbers(text: str) -> tuple[float, ...]:
    """Return the numbers in a text; none where one of them is no finite number."""
    try:
        numbers = tuple(float(word) for word in text.split())
    except ValueError:
        return ()
    return numbers if all(map(math.isfinite, numbers)) else ()


def _circles_of_mimics(joints: Mapping[str, Joint]) -> Iterator[Mistake]:
    for joint in joints.values():
        passed, at = {joint.name}, joint
        while at.mimic is not None and at.mimic.joint in joints:
            at = joints[at.mimic.joint]
            if at.name == joint.name:
                yield Mistake(
                    joint.line,
                    f"joint {joint.name} mimics itself through {shortened_list(sorted(passed))}: "
                    "one of them has to be without <mimic>",
                )
            if at.name in passed:
                break
            passed.add(at.name)
