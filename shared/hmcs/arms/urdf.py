"""URDF files, read with every mistake at its line.

Format: the ROS wiki's `urdf/XML`. A file is a tree: links are joined by joints, each of which names
its parent and its child.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from hmcs.arms.elements import Joint, Mistake, Reader, shortened_list
from hmcs.bounded_files import UnreadableFileError, read_bounded
from hmcs.errors import UserError

MOST_BYTES = 16_000_000
MOST_TOLD = 20
"""Mistakes of a file that are reported at once."""


class UrdfError(UserError):
    """A file that describes no arm; its message has a line for each mistake."""


class Urdf(NamedTuple):
    """A description: a tree of links and joints."""

    file: Path
    robot: Element
    """The XML as it was read."""
    lines: Mapping[int, int]
    """Line of each element, by its `id`."""
    links: Mapping[str, int]
    """Line of each link, by its name."""
    joints: Mapping[str, Joint]
    root: str
    """The link that hangs on no other."""

    def joint_above(self, link: str) -> Joint | None:
        """Return the joint that a link hangs on; None for the root."""
        return next((joint for joint in self.joints.values() if joint.child == link), None)

    def path_to(self, link: str, base: str) -> tuple[Joint, ...]:
        """Return the joints from `base` to a link; raises KeyError where none lead there."""
        above = {joint.child: joint for joint in self.joints.values()}
        path: list[Joint] = []
        while link != base:
            path.append(above[link])
            link = above[link].parent
        return tuple(reversed(path))

    def check_link(self, name: str, what: str) -> None:
        """Raise UrdfError, which names the links there are, where there is none of that name."""
        if name not in self.links:
            near = get_close_matches(name, self.links, n=1)
            guess = f", did you mean {near[0]}?" if near else ""
            raise UrdfError(
                f"{self.file}: has no link {name!r}, asked for as {what}{guess} (its links are: "
                f"{shortened_list(self.links)})"
            )


def read_urdf(file: Path) -> Urdf:
    """Return the description in a file.

    Raises UrdfError naming each mistake with its line: no XML, no tree, numbers that are none.
    """
    try:
        data = read_bounded(file, MOST_BYTES)
    except UnreadableFileError as error:
        raise UrdfError(f"{file}: {error.what}; expected a URDF file") from error
    return urdf_in(file, data)


def urdf_in(file: Path, data: bytes) -> Urdf:
    """Return the description in `data`, which is said to be of `file`; raises as `read_urdf`."""
    robot, lines = _parse(file, data)
    _check_is_urdf(file, robot, lines)
    reader = Reader(lines)
    links = reader.links(robot)
    joints = reader.joints(robot, links)
    if not reader.mistakes:
        reader.check_tree(links, joints)
    if reader.mistakes:
        raise UrdfError(told(file, reader.mistakes))
    children = {joint.child for joint in joints.values()}
    root = next(link for link in links if link not in children)
    return Urdf(file, robot, lines, links, joints, root)


def told(file: Path, mistakes: Iterable[Mistake]) -> str:
    """Return a line for each mistake: `file:line: what is wrong`."""
    ordered = sorted(mistakes)
    text = [f"{file}:{line}: {message}" for line, message in ordered[:MOST_TOLD]]
    if len(ordered) > MOST_TOLD:
        text.append(f"{file}: there are {len(ordered) - MOST_TOLD} more mistakes")
    return "\n".join(text)


def _parse(file: Path, data: bytes) -> tuple[Element, dict[int, int]]:
    """Return the XML in a file, and the line of each element by its id."""
    builder, lines = TreeBuilder(), dict[int, int]()
    parser = expat.ParserCreate()
    parser.buffer_text = True

    def start(tag: str, attributes: dict[str, str]) -> None:
        lines[id(builder.start(tag, attributes))] = parser.CurrentLineNumber

    def declared(*_: object) -> None:
        raise UrdfError(
            f"{file}:{parser.CurrentLineNumber}: declares XML entities, which a URDF has no need "
            "of: remove its document type"
        )

    parser.StartElementHandler = start
    parser.EndElementHandler = builder.end
    parser.EntityDeclHandler = declared
    try:
        parser.Parse(data, True)
        return builder.close(), lines
    except expat.ExpatError as error:
        what = expat.ErrorString(error.code)
        raise UrdfError(
            f"{file}:{error.lineno}: is no XML, and so no URDF ({what}); expected <robot …> … "
            "</robot>"
        ) from error
    except (ValueError, LookupError) as error:
        raise UrdfError(f"{file}: cannot be read as XML: {error}") from error


def _check_is_urdf(file: Path, robot: Element, lines: Mapping[int, int]) -> None:
    unexpanded = next((e for e in robot.iter() if e.tag.startswith("xacro:")), None)
    if unexpanded is not None:
        raise UrdfError(
            f"{file}:{lines[id(unexpanded)]}: is written in xacro ({unexpanded.tag}), which has to "
            f"be expanded first: xacro {file.name} > {file.name.split('.')[0]}.urdf"
        )
    if robot.tag != "robot":
        other = {"mujoco": " (a MuJoCo model)", "sdf": " (an SDF)"}.get(robot.tag, "")
        raise UrdfError(
            f"{file}:{lines[id(robot)]}: begins with <{robot.tag}>{other}, expected <robot>: "
            "give a URDF"
        )
