"""The cell as visualization_msgs/Markers: workspace, obstacles, forbidden regions, guides."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from hmcs.arrays import Array
from hmcs.fixtures.regions.mesh_files import read_placed_mesh
from hmcs.motion.quaternions import from_vector, rotation_matrix
from hmcs.task import ForbiddenRegion, Obstacle, Task
from hmcs_ros2_bridge.fields import Fields, header, pose, vector

ARROW, CUBE, SPHERE, CYLINDER, LINE_STRIP, LINE_LIST, TRIANGLES = 0, 1, 2, 3, 4, 5, 11
"""Types of markers, as in visualization_msgs/Marker."""
ADD, DELETE = 0, 2
FORBIDDEN, OBSTACLE = (0.84, 0.15, 0.16, 0.3), (0.5, 0.5, 0.5, 0.9)
WORKSPACE, GUIDE, LEADING = (0.4, 0.4, 0.4, 0.6), (0.12, 0.47, 0.71, 0.35), (0.12, 0.47, 0.71, 1.0)
"""Red, green, blue, opacity."""
_PLATE_M, _LINE_M, _ARROW_M = 0.002, 0.003, 0.1
_UPRIGHT = (0.0, 0.0, 0.0, 1.0)
_NOWHERE = (0.0, 0.0, 0.0)


def standing(task: Task, stamp_ns: int, frame: str) -> list[Fields]:
    """Return what stands still in a task: its workspace, obstacles and forbidden regions."""
    space = task.workspace
    size_m = float(np.linalg.norm(np.subtract(space.upper_m, space.lower_m)))
    shapes = [
        _lines("workspace", _edges(np.array(space.lower_m), np.array(space.upper_m)), WORKSPACE),
        *(shape for obstacle in space.obstacles for shape in _obstacle(obstacle)),
        *(shape for region in space.forbidden for shape in _region(region, size_m)),
    ]
    return _placed(shapes, stamp_ns, frame)


def guide(
    name: str, points: Array, origin: Array, stamp_ns: int, frame: str, *, leads: bool
) -> list[Fields]:
    """Return a guide whose path, m, shape (n, 3), begins at `origin`."""
    line = _lines(f"guide/{name}", points - points[0] + origin, LEADING if leads else GUIDE)
    return _placed([{**line, "type": LINE_STRIP}], stamp_ns, frame)


def no_guide(name: str, stamp_ns: int, frame: str) -> list[Fields]:
    """Return what takes a guide away."""
    return _placed([{"ns": f"guide/{name}", "action": DELETE}], stamp_ns, frame)


def direction(place: Array, along: Array, stamp_ns: int, frame: str) -> list[Fields]:
    """Return the fixture's preferred direction at the tool; taken away where there is none."""
    if not np.any(along):
        return _placed([{"ns": "direction", "action": DELETE}], stamp_ns, frame)
    arrow = {
        "ns": "direction",
        "type": ARROW,
        "pose": pose(_NOWHERE, _UPRIGHT),
        "points": [vector(place), vector(place + _ARROW_M * along)],
        "scale": vector((0.006, 0.012, 0.02)),
        "color": _color(LEADING),
    }
    return _placed([arrow], stamp_ns, frame)


def _obstacle(obstacle: Obstacle) -> Iterator[Fields]:
    name, place, turn = (
        f"obstacle/{obstacle.name}",
        obstacle.position_m,
        obstacle.orientation_xyzw,
    )
    if obstacle.size_m is not None:
        yield _solid(name, CUBE, obstacle.size_m, place, turn, OBSTACLE)
    elif obstacle.radius_m is not None:
        width = 2.0 * obstacle.radius_m
        long = obstacle.length_m
        kind, size = (SPHERE, width) if long is None else (CYLINDER, long)
        yield _solid(name, kind, (width, width, size), place, turn, OBSTACLE)


def _region(region: ForbiddenRegion, size_m: float) -> Iterator[Fields]:
    name, place, turn = f"forbidden/{region.name}", region.position_m, region.orientation_xyzw
    if region.normal is not None:
        plate = (size_m, size_m, _PLATE_M)
        yield _solid(name, CUBE, plate, place, _turn_to(np.array(region.normal)), FORBIDDEN)
    elif region.size_m is not None:
        yield _solid(name, CUBE, region.size_m, place, turn, FORBIDDEN)
    elif region.radius_m is not None:
        yield from _capsule(name, np.array(place), region.end_m or place, region.radius_m)
    elif region.file is not None:
        yield {
            "ns": name,
            "type": TRIANGLES,
            "pose": pose(_NOWHERE, _UPRIGHT),
            "points": [vector(corner) for corner in _mesh_corners(region)],
            "scale": vector((1.0, 1.0, 1.0)),
            "color": _color(FORBIDDEN),
        }


def _mesh_corners(region: ForbiddenRegion) -> Array:
    """Return the corners of the triangles of a region's mesh, m, base frame, shape (3 n, 3)."""
    assert region.file is not None
    vertices, triangles = read_placed_mesh(
        Path(region.file),
        region.scale or 1.0,
        rotation_matrix(region.orientation_xyzw),
        np.array(region.position_m),
    )
    return np.asarray(vertices[triangles.ravel()])


def _capsule(name: str, begin: Array, end: Iterable[float], radius_m: float) -> Iterator[Fields]:
    end_at = np.array(tuple(end))
    along, width = end_at - begin, 2.0 * radius_m
    length = float(np.linalg.norm(along))
    ball = (width, width, width)
    yield _solid(name, SPHERE, ball, begin, _UPRIGHT, FORBIDDEN)
    if length > 0.0:
        yield _solid(name, SPHERE, ball, end_at, _UPRIGHT, FORBIDDEN)
        rod = (width, width, length)
        yield _solid(name, CYLINDER, rod, 0.5 * (begin + end_at), _turn_to(along), FORBIDDEN)


def _solid(
    name: str,
    kind: int,
    size_m: Iterable[float],
    place: Iterable[float],
    turn: Iterable[float],
    color: tuple[float, float, float, float],
) -> Fields:
    return {
        "ns": name,
        "type": kind,
        "pose": pose(place, turn),
        "scale": vector(size_m),
        "color": _color(color),
    }


def _lines(name: str, points: Array, color: tuple[float, float, float, float]) -> Fields:
    return {
        "ns": name,
        "type": LINE_LIST,
        "pose": pose(_NOWHERE, _UPRIGHT),
        "scale": vector((_LINE_M, 0.0, 0.0)),
        "color": _color(color),
        "points": [vector(point) for point in points],
    }


def _placed(shapes: list[Fields], stamp_ns: int, frame: str) -> list[Fields]:
    """Return markers of shapes, numbered within each name."""
    count: dict[str, int] = {}
    markers = []
    for shape in shapes:
        number = count.get(shape["ns"], 0)
        count[shape["ns"]] = number + 1
        markers.append({"header": header(stamp_ns, frame), "id": number, "action": ADD, **shape})
    return markers


def _color(color: tuple[float, float, float, float]) -> Fields:
    return dict(zip("rgba", color, strict=True))


def _edges(lower: Array, upper: Array) -> Array:
    """Return both ends of the twelve edges of a box, shape (24, 3)."""
    corners = [
        np.where([which >> axis & 1 for axis in range(3)], upper, lower) for which in range(8)
    ]
    return np.array(
        [
            corners[end]
            for which in range(8)
            for axis in range(3)
            if not which >> axis & 1
            for end in (which, which | 1 << axis)
        ]
    )


def _turn_to(along: Array) -> Array:
    """Return a quaternion that turns z to a direction."""
    unit = along / np.linalg.norm(along)
    axis = np.cross([0.0, 0.0, 1.0], unit)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-9:
        return from_vector(np.array([0.0 if unit[2] > 0 else np.pi, 0.0, 0.0]))
    return from_vector(axis / sine * np.arctan2(sine, unit[2]))
