"""The files that a description names: where they are, and which of them can be used."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from urllib.parse import unquote, urlsplit

from hmcs.arms.elements import Mistake
from hmcs.arms.urdf import Urdf

READ = (".stl", ".obj", ".dae")
"""Formats of meshes that every engine and the page read."""
_IN_PACKAGE = ("package", "model")
"""Schemes of names that begin with the name of a folder, which may be anywhere above."""


class MeshFiles:
    """Finds the files a description names, beside it or in packages.

    A package is looked for among the folders above the description, and in those of
    `package_path`.
    """

    def __init__(self, urdf: Path, package_path: Iterable[Path] = ()) -> None:
        self._urdf = urdf
        self._package_path = tuple(package_path)

    def find(self, name: str) -> Path | None:
        """Return the file that a name means; None where there is none."""
        for place in self._places(name):
            try:
                if place.is_file():
                    return place.resolve()
            except (OSError, ValueError):
                continue
        return None

    def _places(self, name: str) -> Iterator[Path]:
        scheme, host, path, *_ = urlsplit(name)
        if scheme == "file":
            yield Path(unquote(path))
        elif scheme in _IN_PACKAGE:
            inside = unquote(path).lstrip("/")
            for above in (*self._urdf.resolve().parents, *self._package_path):
                yield above / host / inside
                if above.name == host:
                    yield above / inside
        else:
            yield self._urdf.parent / name


def names_of(urdf: Urdf) -> tuple[str, ...]:
    """Return the names of meshes and textures in a description, each once."""
    named = (e.get("filename") for tag in ("mesh", "texture") for e in urdf.robot.iter(tag))
    return tuple(dict.fromkeys(name for name in named if name))


def unusable(urdf: Urdf, files: MeshFiles) -> tuple[Mistake, ...]:
    """Return each mesh and texture that is left out, with its line and why, each name once."""
    found: dict[str, Mistake] = {}
    for element in urdf.robot.iter():
        name = element.get("filename", "")
        if element.tag not in ("mesh", "texture") or name in found:
            continue
        line, place = urdf.lines[id(element)], files.find(name)
        if place is None:
            where = (
                "set robot.package_path to the folder that holds the package"
                if urlsplit(name).scheme in _IN_PACKAGE
                else "put it beside the URDF"
            )
            found[name] = Mistake(
                line, f"{element.tag} {name!r}: no such file; the arm does without it ({where})"
            )
        elif element.tag == "mesh" and place.suffix.lower() not in READ:
            found[name] = Mistake(
                line,
                f"mesh {name!r}: {place.suffix or 'a file without ending'} is read neither by the "
                f"page nor by PyBullet (expected {', '.join(READ)}); the arm does without it: "
                "convert it, e.g. with trimesh",
            )
    return tuple(found.values())
