"""How an arm looks: its description and the meshes it names, for whoever draws it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

_MESH = re.compile(r'filename\s*=\s*"([^"]+)"')
_PACKAGE = "package://"


class Looks(NamedTuple):
    """What is needed to draw an arm."""

    urdf: str
    joints: tuple[str, ...]
    """Names in the URDF of the joints that are told of, in their order."""
    files: dict[str, bytes]
    """Meshes, and the materials and textures beside them, by the name the URDF gives them."""


def looks_of(urdf: Path, joints: tuple[str, ...]) -> Looks:
    """Return the looks of the arm described in a file.

    Names that lead to no file beside it are left out: who draws it does without.
    """
    text = urdf.read_text(encoding="utf-8")
    files: dict[str, bytes] = {}
    for name in dict.fromkeys(_MESH.findall(text)):
        mesh = urdf.parent / name.removeprefix(_PACKAGE)
        if mesh.is_file():
            files[name] = mesh.read_bytes()
            material = mesh.with_suffix(".mtl")
            if material.is_file():
                files[str(Path(name).with_suffix(".mtl"))] = material.read_bytes()
    return Looks(text, joints, files)
