"""A robot's description as it came over the wire, made anew of what is needed to draw it.

A process that answers for a robot may send anything: entities that read files, a tree of links
without an end, numbers that are none, names that lead elsewhere. What is written here holds links,
joints and what is seen of them, and names no file but those that came along.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping
from typing import NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

MOST_LINKS = 256
_LONGEST_BYTES = 4_000_000
_LARGEST = 1e6
_NUMBERS: Mapping[str, Mapping[str, tuple[int, ...]]] = {
    "origin": {"xyz": (3,), "rpy": (3,)},
    "axis": {"xyz": (3,)},
    "box": {"size": (3,)},
    "cylinder": {"radius": (1,), "length": (1,)},
    "sphere": {"radius": (1,)},
    "color": {"rgba": (4,)},
}
"""What is kept of elements that hold numbers alone: attributes, and how many numbers each has."""
_KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")


class DescriptionError(ValueError):
    """A description that cannot be drawn; says what is wrong with it."""


def tidy(urdf: str, files: Mapping[str, str]) -> bytes:
    """Return a description, URDF, of what is needed to draw a robot.

    `files` says where those files are that it may name; a shape of any other is left out. Links get
    names of their own, joints keep theirs. Raises DescriptionError where it is none.
    """
    if len(urdf) > _LONGEST_BYTES:
        raise DescriptionError(f"the description has more than {_LONGEST_BYTES} characters")
    described = _parse(urdf.encode("utf-8", "replace"), _Undeclared())
    if described.tag != "robot":
        raise DescriptionError(f"the description is of a {described.tag!r}, expected a robot")
    links = _links(described)
    robot = Element("robot", name="robot")
    for material in described.findall("material"):
        _copy_material(material, robot)
    for link in links.values():
        own = SubElement(robot, "link", name=link.name)
        for visual in link.element.findall("visual"):
            _copy_visual(visual, own, files)
    for joint in described.findall("joint"):
        _copy_joint(joint, robot, links)
    return bytes(ElementTree.tostring(robot, encoding="utf-8"))


def count_in(data: bytes, tag: str) -> int:
    """Return how many elements of a tag there are in XML that declares no document type.

    Raises DescriptionError for any other, and for what is no XML.
    """
    counted = _Counted(tag)
    _parse(data, counted)
    return counted.count


def _parse(data: bytes, target: ElementTree.TreeBuilder) -> Element:
    parser = ElementTree.XMLParser(target=target)
    try:
        parser.feed(data)
        root: Element = parser.close()
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise DescriptionError(f"it cannot be read as XML: {error}") from None
    return root


class _Undeclared(ElementTree.TreeBuilder):
    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        """Refuse."""
        raise DescriptionError("it declares a document type, whose entities may grow without end")


class _Counted(_Undeclared):
    """Keeps nothing but how many elements there are of a tag, in whatever namespace."""

    def __init__(self, tag: str) -> None:
        super().__init__()
        self.count = 0
        self._tag = tag

    def start(self, tag: str, attrs: dict[str, str], /) -> Element:
        self.count += tag.rpartition("}")[2] == self._tag
        return _NONE

    def end(self, tag: str, /) -> Element:
        return _NONE

    def data(self, data: str, /) -> None:
        """Leave out."""

    def close(self) -> Element:
        return _NONE


_NONE = Element("none")


class _Link(NamedTuple):
    name: str
    """In the description that is made."""
    element: Element


def _links(robot: Element) -> Mapping[str, _Link]:
    elements = robot.findall("link")
    if len(elements) > MOST_LINKS:
        raise DescriptionError(f"the robot has more than {MOST_LINKS} links")
    links = {link.get("name", ""): _Link(f"l{k}", link) for k, link in enumerate(elements)}
    if not elements or len(links) < len(elements):
        raise DescriptionError("the robot has no links, or two of one name")
    parents: dict[str, str] = {}
    for joint in robot.findall("joint"):
        parent, child = _end(joint, "parent"), _end(joint, "child")
        if parent not in links or child not in links or child in parents:
            raise DescriptionError("a joint joins no two links, or a link hangs on two joints")
        parents[child] = parent
    for name in links:
        above, steps = name, 0
        while above in parents:
            above, steps = parents[above], steps + 1
            if steps > len(links):
                raise DescriptionError("links hang on one another in a circle")
    return links


def _end(joint: Element, which: str) -> str:
    end = joint.find(which)
    return "" if end is None else end.get("link", "")


def _copy_joint(joint: Element, into: Element, links: Mapping[str, _Link]) -> None:
    kind = joint.get("type", "")
    if kind not in _KINDS:
        raise DescriptionError(f"a joint is of no kind that is known: {', '.join(_KINDS)}")
    own = SubElement(into, "joint", name=joint.get("name", ""), type=kind)
    for which in ("parent", "child"):
        SubElement(own, which, link=links[_end(joint, which)].name)
    for tag in ("origin", "axis"):
        _copy_numbers(joint, own, tag)
    mimic = joint.find("mimic")
    if mimic is not None:
        leader = SubElement(own, "mimic", joint=mimic.get("joint", ""))
        for attribute in ("multiplier", "offset"):
            if attribute in mimic.attrib:
                leader.set(attribute, _numbers(mimic.get(attribute, ""), (1,)))


def _copy_visual(visual: Element, into: Element, files: Mapping[str, str]) -> None:
    geometry = visual.find("geometry")
    if geometry is None or not len(geometry):
        return
    shape = geometry[0]
    made = Element("geometry")
    if shape.tag == "mesh":
        place = files.get(shape.get("filename", ""))
        if place is None:
            return
        mesh = SubElement(made, "mesh", filename=place)
        if "scale" in shape.attrib:
            mesh.set("scale", _numbers(shape.get("scale", ""), (1, 3)))
    elif shape.tag in ("box", "cylinder", "sphere"):
        _copy_numbers(geometry, made, shape.tag)
    else:
        return
    own = SubElement(into, "visual")
    _copy_numbers(visual, own, "origin")
    own.append(made)
    material = visual.find("material")
    if material is not None:
        _copy_material(material, own)


def _copy_material(material: Element, into: Element) -> None:
    own = SubElement(into, "material", name=material.get("name", ""))
    # Drawn in the library's own color, where its own is none.
    with contextlib.suppress(DescriptionError):
        _copy_numbers(material, own, "color")


def _copy_numbers(of: Element, into: Element, tag: str) -> None:
    element = of.find(tag)
    if element is not None:
        kept = {
            attribute: _numbers(element.get(attribute, ""), counts)
            for attribute, counts in _NUMBERS[tag].items()
            if attribute in element.attrib
        }
        SubElement(into, tag, kept)


def _numbers(text: str, counts: tuple[int, ...]) -> str:
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) not in counts or not all(
        math.isfinite(number) and abs(number) <= _LARGEST for number in numbers
    ):
        raise DescriptionError(f"{text[:40]!r} stands where {counts[-1]} numbers are expected")
    return " ".join(map(repr, numbers))
