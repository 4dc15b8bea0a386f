"""The XML of a URDF, checked for being one."""

from __future__ import annotations

from xml.etree import ElementTree

from hmcs.errors import UserError

MOST_BYTES = 16_000_000
"""Of a URDF."""


class UrdfXmlError(UserError):
    """What is no URDF."""


def urdf_element(data: bytes, name: str) -> ElementTree.Element:
    """Return the element `robot`; raises UrdfXmlError, naming the file by `name`."""
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise UrdfXmlError(f"{name}: has a document type, which a URDF has no need of: remove it")
    try:
        root = ElementTree.fromstring(data)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise UrdfXmlError(f"{name}: is no XML, and so no URDF: {error}") from error
    if root.tag != "robot":
        raise UrdfXmlError(f"{name}: begins with <{root.tag[:40]}>, expected <robot>: give a URDF")
    return root
