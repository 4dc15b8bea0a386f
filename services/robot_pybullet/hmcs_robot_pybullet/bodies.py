"""What stands in the cell as bodies of PyBullet: obstacles, and the shapes of forbidden regions."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
import pybullet

from hmcs.task import ForbiddenRegion, Obstacle
from hmcs_robot.solids import Solid, corners_of, solid_of, solids_of

_TRIANGLES_AT_ONCE = 20_000
"""PyBullet takes no more than 131 072 corners for one shape."""
_SHAPES_OF_A_BODY = 16
"""PyBullet takes no more for one body."""


def add_obstacle(obstacle: Obstacle, client: int) -> int:
    """Add an obstacle that the arm collides with; return its body."""
    solid = solid_of(obstacle)
    shape = _shape(solid)
    visual = dict(shape)
    if "height" in visual:
        # PyBullet names the same length differently.
        visual["length"] = visual.pop("height")
    body: int = pybullet.createMultiBody(
        0,
        pybullet.createCollisionShape(**shape, physicsClientId=client),
        pybullet.createVisualShape(
            **visual, rgbaColor=[0.45, 0.55, 0.65, 1], physicsClientId=client
        ),
        solid.position.tolist(),
        solid.orientation.tolist(),
        physicsClientId=client,
    )
    return body


def add_region(region: ForbiddenRegion, client: int) -> tuple[int, ...]:
    """Add a forbidden region that distances are measured to and nothing collides with.

    A mesh is added as boxes that cover its surface; returns the bodies. Raises MeshError for a mesh
    file that cannot be read.
    """
    solids = solids_of(region)
    if region.shape == "mesh":
        return tuple(
            _added(_boxes_shape(solids[begin : begin + _SHAPES_OF_A_BODY], client), client)
            for begin in range(0, len(solids), _SHAPES_OF_A_BODY)
        )
    (solid,) = solids
    made: int = pybullet.createCollisionShape(**_shape(solid), physicsClientId=client)
    return (_added(made, client, solid.position.tolist(), solid.orientation.tolist()),)


def links_touching(
    arm: int, links: Collection[int], mesh: ForbiddenRegion, within_m: float, client: int
) -> frozenset[int]:
    """Return which of an arm's links are so near to a mesh, asked triangle by triangle."""
    corners = corners_of(mesh)
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


def _shape(solid: Solid) -> dict[str, Any]:
    """Return what PyBullet makes a shape of."""
    if solid.kind == "box":
        return {"shapeType": pybullet.GEOM_BOX, "halfExtents": solid.halves_m.tolist()}
    if solid.kind == "sphere":
        return {"shapeType": pybullet.GEOM_SPHERE, "radius": solid.radius_m}
    kind = pybullet.GEOM_CYLINDER if solid.kind == "cylinder" else pybullet.GEOM_CAPSULE
    return {"shapeType": kind, "radius": solid.radius_m, "height": solid.length_m}


def _boxes_shape(boxes: Sequence[Solid], client: int) -> int:
    made: int = pybullet.createCollisionShapeArray(
        shapeTypes=[pybullet.GEOM_BOX] * len(boxes),
        halfExtents=[box.halves_m.tolist() for box in boxes],
        collisionFramePositions=[box.position.tolist() for box in boxes],
        collisionFrameOrientations=[box.orientation.tolist() for box in boxes],
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
