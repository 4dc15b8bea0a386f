"""What stands in the cell as bodies of PyBullet: obstacles, and the shapes of forbidden regions."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pybullet

from hmcs.fixtures.regions.mesh_files import read_placed_mesh
from hmcs.motion import quaternions
from hmcs.task import ForbiddenRegion, Obstacle
from hmcs_robot.covering import CoveringBox, covering

_FAR_M = 10.0
"""Half the size of the box that stands for all behind a plane."""
_ALONG_Z = np.array([0.0, 0.0, 1.0])
_TRIANGLES_AT_ONCE = 20_000
"""PyBullet takes no more than 131 072 corners for one shape."""
_BOXES_OF_A_BODY = 16
"""PyBullet takes no more shapes for one body."""
_MOST_BOXES = 8 * _BOXES_OF_A_BODY
"""To cover a mesh: their distances to an arm take half a millisecond, not more than a control cycle
has."""


def add_obstacle(obstacle: Obstacle, client: int) -> int:
    """Add an obstacle that the arm collides with; return its body."""
    collision: dict[str, Any]
    visual: dict[str, Any]
    if obstacle.size_m is not None:
        kind = pybullet.GEOM_BOX
        collision = visual = {"halfExtents": [length / 2 for length in obstacle.size_m]}
    elif obstacle.length_m is not None:
        kind = pybullet.GEOM_CYLINDER
        collision = {"radius": obstacle.radius_m, "height": obstacle.length_m}
        # PyBullet names the same length differently.
        visual = {"radius": obstacle.radius_m, "length": obstacle.length_m}
    else:
        kind = pybullet.GEOM_SPHERE
        collision = visual = {"radius": obstacle.radius_m}
    body: int = pybullet.createMultiBody(
        0,
        pybullet.createCollisionShape(kind, **collision, physicsClientId=client),
        pybullet.createVisualShape(
            kind, **visual, rgbaColor=[0.45, 0.55, 0.65, 1], physicsClientId=client
        ),
        list(obstacle.position_m),
        list(obstacle.orientation_xyzw),
        physicsClientId=client,
    )
    return body


def add_region(region: ForbiddenRegion, client: int) -> tuple[int, ...]:
    """Add a forbidden region that distances are measured to and nothing collides with.

    A mesh is added as boxes that cover its surface; returns the bodies. Raises MeshError for a mesh
    file that cannot be read.
    """
    if region.shape == "mesh":
        boxes = covering(_corners(region), _MOST_BOXES)
        return tuple(
            _added(_boxes_shape(boxes[begin : begin + _BOXES_OF_A_BODY], client), client)
            for begin in range(0, len(boxes), _BOXES_OF_A_BODY)
        )
    return (_add_solid(region, client),)


def links_touching(
    arm: int, links: Collection[int], mesh: ForbiddenRegion, within_m: float, client: int
) -> frozenset[int]:
    """Return which of an arm's links are so near to a mesh, asked triangle by triangle."""
    corners = _corners(mesh)
    lowest, highest = corners.min(axis=1), corners.max(axis=1)
    touching = set()
    for link in links:
        lower, upper = np.array(pybullet.getAABB(arm, link, physicsClientId=client))
        near = (lowest <= upper + within_m) & (highest >= lower - within_m)
        around = corners[near.all(axis=1)]
        for begin in range(0, len(around), _TRIANGLES_AT_ONCE):
            # Triangles instead of the file: of STL files PyBullet reads binary ones only.
            some = around[begin : begin + _TRIANGLES_AT_ONCE]
            shape: int = pybullet.createCollisionShape(
                pybullet.GEOM_MESH,
                vertices=some.reshape(-1, 3).tolist(),
                indices=list(range(3 * len(some))),
                flags=pybullet.GEOM_FORCE_CONCAVE_TRIMESH,
                physicsClientId=client,
            )
            body = _added(shape, client)
            if pybullet.getClosestPoints(arm, body, within_m, link, physicsClientId=client):
                touching.add(link)
            pybullet.removeBody(body, physicsClientId=client)
    return frozenset(touching)


def _corners(region: ForbiddenRegion) -> np.ndarray:
    """Return the triangles of a region that is a mesh, m, base frame, shape (T, 3, 3)."""
    rotation = quaternions.rotation_matrix(region.orientation_xyzw)
    vertices, triangles = read_placed_mesh(
        Path(str(region.file)), region.scale or 1.0, rotation, np.array(region.position_m)
    )
    corners: np.ndarray = vertices[triangles]
    return corners


def _add_solid(region: ForbiddenRegion, client: int) -> int:
    position, turn = np.array(region.position_m), np.array(region.orientation_xyzw)
    shape: dict[str, Any]
    if region.shape == "plane":
        normal = np.array(region.normal) / np.linalg.norm(np.array(region.normal))
        shape = {"shapeType": pybullet.GEOM_BOX, "halfExtents": [_FAR_M] * 3}
        position, turn = position - _FAR_M * normal, _turn_to(normal)
    elif region.shape == "box" and region.size_m is not None:
        half_m = [length / 2 for length in region.size_m]
        shape = {"shapeType": pybullet.GEOM_BOX, "halfExtents": half_m}
    elif region.shape == "capsule":
        axis = np.array(region.end_m) - position
        length_m = float(np.linalg.norm(axis))
        shape = {
            "shapeType": pybullet.GEOM_CAPSULE, "radius": region.radius_m, "height": length_m
        }  # fmt: skip
        position = position + axis / 2
        turn = _turn_to(axis / length_m) if length_m > 0 else turn
    else:
        shape = {"shapeType": pybullet.GEOM_SPHERE, "radius": region.radius_m}
    made: int = pybullet.createCollisionShape(**shape, physicsClientId=client)
    return _added(made, client, position.tolist(), turn.tolist())


def _boxes_shape(boxes: Sequence[CoveringBox], client: int) -> int:
    made: int = pybullet.createCollisionShapeArray(
        shapeTypes=[pybullet.GEOM_BOX] * len(boxes),
        halfExtents=[box.halves.tolist() for box in boxes],
        collisionFramePositions=[box.center.tolist() for box in boxes],
        collisionFrameOrientations=[quaternions.from_matrix(box.axes).tolist() for box in boxes],
        physicsClientId=client,
    )
    return made


def _added(
    shape: int,
    client: int,
    position: Sequence[float] = (0.0, 0.0, 0.0),
    turn: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
) -> int:
    body: int = pybullet.createMultiBody(0, shape, -1, position, turn, physicsClientId=client)
    pybullet.setCollisionFilterGroupMask(body, -1, 0, 0, physicsClientId=client)
    return body


def _turn_to(direction: np.ndarray) -> np.ndarray:
    """Return a quaternion that turns the z axis to a unit vector, (3,)."""
    axis = np.cross(_ALONG_Z, direction)
    sine, cosine = float(np.linalg.norm(axis)), float(direction @ _ALONG_Z)
    if sine < 1e-12:
        axis, sine = np.array([1.0, 0.0, 0.0]), 1.0
        turn = np.zeros(3) if cosine > 0 else np.pi * axis
    else:
        turn = np.arctan2(sine, cosine) * axis / sine
    return quaternions.turned(np.array([0.0, 0.0, 0.0, 1.0]), turn, 1.0)
