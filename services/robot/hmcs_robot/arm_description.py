"""How an arm looks: its description and the meshes it names, to be drawn."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote, urlsplit
from xml.etree import ElementTree

from hmcs.errors import UserError

_IN_PACKAGE = ("package", "model")
"""Schemes of names that begin with the name of a folder, which may be anywhere above."""


class ArmDescription(NamedTuple):
    """What is needed to draw an arm."""

    urdf: str
    joints: tuple[str, ...]
    """Names in the URDF of the joints that are reported, in their order."""
    files: dict[str, bytes]
    """Meshes, and the materials and textures beside them, by the name the URDF gives them."""


def arm_description(urdf: Path, joints: tuple[str, ...]) -> ArmDescription:
    """Return the looks of the arm described in a file.

    Names that lead to no file are left out, see `missing_meshes`. Raises UserError for a file that
    is no XML.
    """
    files: dict[str, bytes] = {}
    for name in _named(urdf):
        mesh = file_named(urdf, name)
        if mesh is None:
            continue
        files[name] = mesh.read_bytes()
        material = mesh.with_suffix(".mtl")
        if material.is_file():
            files[str(Path(name).with_suffix(".mtl"))] = material.read_bytes()
    return ArmDescription(urdf.read_text(encoding="utf-8"), joints, files)


def missing_meshes(urdf: Path) -> tuple[str, ...]:
    """Return the names in a description that lead to no file: nobody can draw what they mean."""
    return tuple(name for name in _named(urdf) if file_named(urdf, name) is None)


def _named(urdf: Path) -> tuple[str, ...]:
    """The names of meshes and textures in a description, each once."""
    try:
        root = ElementTree.parse(urdf).getroot()
    except ElementTree.ParseError as error:
        raise UserError(f"{urdf}: is no URDF: {error}") from error
    named = (each.get("filename") for tag in ("mesh", "texture") for each in root.iter(tag))
    return tuple(dict.fromkeys(name for name in named if name))


def file_named(urdf: Path, name: str) -> Path | None:
    """Return the file that a name in a description means, if there is one."""
    return next((place for place in _places(urdf, name) if place.is_file()), None)


def _places(urdf: Path, name: str) -> Iterator[Path]:
    scheme, host, path, *_ = urlsplit(name)
    if scheme == "file":
        yield Path(unquote(path))
    elif scheme in _IN_PACKAGE:
        inside = unquote(path).lstrip("/")
        for above in urdf.resolve().parents:
            yield above / host / inside
            if above.name == host:
                yield above / inside
    else:
        yield urdf.parent / name
