"""Obstacles and forbidden regions as shapes that any physics engine knows."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.fixtures.regions.mesh_files import read_placed_mesh
from hmcs.motion import quaternions
from hmcs.task import ForbiddenRegion, Obstacle
from hmcs_robot.covering import covering

_FAR_M = 10.0
"""Half the size of the box that stands for all behind a plane."""
_ALONG_Z = np.array([0.0, 0.0, 1.0])
_UNTURNED = np.array([0.0, 0.0, 0.0, 1.0])
_MOST_BOXES = 128
"""To cover a mesh: their distances to an arm take half a millisecond, not more than a control cycle
has."""
_NO_LENGTHS = np.zeros(3)


class Solid(NamedTuple):
    """A shape and where its middle is; those with a length lie along their z axis."""

    kind: Literal["box", "sphere", "cylinder", "capsule"]
    position: Array
    """m, base frame, shape (3,)."""
    orientation: Array
    """Unit quaternion x y z w."""
    halves_m: Array = _NO_LENGTHS
    """Half the lengths of a box, shape (3,)."""
    radius_m: float = 0.0
    length_m: float = 0.0
    """Of a cylinder; of a capsule without its round ends."""


def solid_of(obstacle: Obstacle) -> Solid:
    """Return the shape of an obstacle."""
    position, turn = np.array(obstacle.position_m), np.array(obstacle.orientation_xyzw)
    if obstacle.size_m is not None:
        return Solid("box", position, turn, halves_m=np.array(obstacle.size_m) / 2)
    radius_m = obstacle.radius_m or 0.0
    if obstacle.length_m is not None:
        return Solid("cylinder", position, turn, radius_m=radius_m, length_m=obstacle.length_m)
    return Solid("sphere", position, turn, radius_m=radius_m)


def solids_of(region: ForbiddenRegion) -> tuple[Solid, ...]:
    """Return the shape of a forbidden region; of a mesh, boxes that cover its surface.

    Raises MeshError for a mesh file that cannot be read.
    """
    if region.shape == "mesh":
        boxes = covering(corners_of(region), _MOST_BOXES)
        return tuple(
            Solid("box", box.center, quaternions.from_matrix(box.axes), halves_m=box.halves)
            for box in boxes
        )
    return (_solid(region),)


def corners_of(mesh: ForbiddenRegion) -> Array:
    """Return the triangles of a region that is a mesh, m, base frame, shape (T, 3, 3).

    Raises MeshError for a file that cannot be read.
    """
    rotation = quaternions.rotation_matrix(mesh.orientation_xyzw)
    vertices, triangles = read_placed_mesh(
        Path(str(mesh.file)), mesh.scale or 1.0, rotation, np.array(mesh.position_m)
    )
    corners: Array = vertices[triangles]
    return corners


def _solid(region: ForbiddenRegion) -> Solid:
    position, turn = np.array(region.position_m), np.array(region.orientation_xyzw)
    if region.shape == "plane":
        normal = np.array(region.normal) / np.linalg.norm(np.array(region.normal))
        behind = position - _FAR_M * normal
        return Solid("box", behind, _turn_to(normal), halves_m=np.full(3, _FAR_M))
    if region.shape == "box" and region.size_m is not None:
        return Solid("box", position, turn, halves_m=np.array(region.size_m) / 2)
    radius_m = region.radius_m or 0.0
    if region.shape == "capsule":
        axis = np.array(region.end_m) - position
        length_m = float(np.linalg.norm(axis))
        turn = _turn_to(axis / length_m) if length_m > 0 else turn
        return Solid("capsule", position + axis / 2, turn, radius_m=radius_m, length_m=length_m)
    return Solid("sphere", position, _UNTURNED, radius_m=radius_m)


def _turn_to(direction: Array) -> Array:
    """Return a quaternion that turns the z axis to a unit vector, (3,)."""
    axis = np.cross(_ALONG_Z, direction)
    sine, cosine = float(np.linalg.norm(axis)), float(direction @ _ALONG_Z)
    if sine < 1e-12:
        axis, sine = np.array([1.0, 0.0, 0.0]), 1.0
        turn = np.zeros(3) if cosine > 0 else np.pi * axis
    else:
        turn = np.arctan2(sine, cosine) * axis / sine
    return quaternions.turned(_UNTURNED, turn, 1.0)
