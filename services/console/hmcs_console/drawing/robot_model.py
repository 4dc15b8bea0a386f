"""The robot as its own process describes it, loaded to be drawn."""

from __future__ import annotations

import io
import tempfile
from pathlib import Path, PurePosixPath

import numpy as np
import yourdfpy  # type: ignore[import-untyped]
from numpy.typing import NDArray

from hmcs.bus.messages import RobotLooks


def load_robot(looks: RobotLooks) -> yourdfpy.URDF:
    """Return a robot's description with its meshes.

    Raises whatever the description or a mesh makes its parsers raise.
    """
    with tempfile.TemporaryDirectory(prefix="hmcs-robot-") as folder:
        names = written(looks.files, Path(folder))
        return yourdfpy.URDF.load(
            io.BytesIO(looks.urdf.encode()), filename_handler=lambda fname: names.get(fname, fname)
        )


def written(files: dict[str, bytes], folder: Path) -> dict[str, str]:
    """Write files into a folder; return where each is by the name it came with.

    Those of one place stay beside each other, for a mesh names its materials; but what came over
    the wire says nothing about places on this disk.
    """
    places = {name: PurePosixPath(name.replace("\\", "/")) for name in files}
    beside = sorted({str(place.parent) for place in places.values()})
    names = {}
    for name, place in places.items():
        if place.name not in ("", ".."):
            file = folder / str(beside.index(str(place.parent))) / place.name
            file.parent.mkdir(exist_ok=True)
            file.write_bytes(files[name])
            names[name] = str(file)
    return names


def joints_of(looks: RobotLooks, positions: NDArray[np.float64]) -> dict[str, float]:
    """Return the position, rad or m, of each joint that was told, by its name."""
    return dict(zip(looks.joints, positions.tolist(), strict=False))
