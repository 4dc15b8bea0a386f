"""The robot as its own process describes it, loaded to be drawn."""

from __future__ import annotations

import io
import logging
import tempfile
from collections.abc import Mapping
from pathlib import Path, PurePosixPath

import numpy as np
import yourdfpy  # type: ignore[import-untyped]
from numpy.typing import NDArray
from PIL import Image

from hmcs.bus.messages import RobotDescription
from hmcs.shown import plain
from hmcs_console.drawing.description import DescriptionError, count_in, tidy

MOST_FILES = 512
MOST_BYTES = 32_000_000
"""Of all files of a robot."""
MOST_TRIANGLES = 2_000_000
_MOST_PIXELS = 16_000_000
"""Of a picture on a mesh."""
_MOST_INSTANCES = 8
"""Of parts of a mesh within others: each may hold two of the next."""
_LONGEST_NAME = 120
_MESHES = (".stl", ".obj", ".dae")
_BESIDE = (".mtl", ".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".tga")

for _library in ("yourdfpy", "trimesh"):
    # They tell of every file, in the words of the file.
    logging.getLogger(_library).addHandler(logging.NullHandler())
    logging.getLogger(_library).propagate = False


def load_robot(robot_description: RobotDescription) -> yourdfpy.URDF:
    """Return a robot's description with its meshes.

    Raises DescriptionError for one that cannot be drawn, and whatever a mesh makes its parser
    raise.
    """
    with tempfile.TemporaryDirectory(prefix="hmcs-robot-") as folder:
        places = written(robot_description.files, Path(folder))
        meshes = {
            name: place for name, place in places.items() if Path(place).suffix.lower() in _MESHES
        }
        robot = yourdfpy.URDF.load(
            io.BytesIO(tidy(robot_description.urdf, meshes)), filename_handler=lambda fname: fname
        )
    triangles = sum(len(getattr(shape, "faces", ())) for shape in robot.scene.geometry.values())
    if triangles > MOST_TRIANGLES:
        raise DescriptionError(f"its meshes have more than {MOST_TRIANGLES} triangles")
    return robot


def written(files: Mapping[str, bytes], folder: Path) -> dict[str, str]:
    """Write files into a folder; return where each is by the name it came with.

    Those of one place stay beside each other, for a mesh names its materials; but what came over
    the wire says nothing about places on this disk. What is no mesh, material or picture is left
    out. Raises DescriptionError where there is more than a robot has need of.
    """
    if len(files) > MOST_FILES or sum(map(len, files.values())) > MOST_BYTES:
        raise DescriptionError(f"it has more than {MOST_FILES} files, or {MOST_BYTES} bytes in all")
    places = {name: PurePosixPath(name.replace("\\", "/")) for name in files}
    beside = sorted({str(place.parent) for place in places.values()})
    names = {}
    for name, place in places.items():
        if _is_file_name(place.name) and _is_drawable(place.suffix.lower(), files[name]):
            file = folder / str(beside.index(str(place.parent))) / place.name
            file.parent.mkdir(exist_ok=True)
            file.write_bytes(files[name])
            names[name] = str(file)
    return names


def joints_of(
    robot_description: RobotDescription, positions: NDArray[np.float64]
) -> dict[str, float]:
    """Return the position, rad or m, of each reported joint, by its name."""
    return dict(zip(robot_description.joints, positions.tolist(), strict=False))


def _is_file_name(name: str) -> bool:
    fits = 0 < len(name.encode("utf-8", "replace")) <= _LONGEST_NAME
    return fits and name not in (".", "..") and plain(name, _LONGEST_NAME) == name


def _is_drawable(suffix: str, data: bytes) -> bool:
    """Whether a file is one that a robot is drawn by, and no larger than it says."""
    if suffix == ".dae":
        return _is_collada(data)
    if suffix in _BESIDE and suffix != ".mtl":
        return _is_picture(data)
    return suffix in _MESHES or suffix == ".mtl"


def _is_collada(data: bytes) -> bool:
    try:
        return count_in(data, "instance_node") <= _MOST_INSTANCES
    except DescriptionError:
        return False


def _is_picture(data: bytes) -> bool:
    try:
        with Image.open(io.BytesIO(data)) as picture:
            width, height = picture.size
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return False
    return bool(width * height <= _MOST_PIXELS)
