"""Tools, meshes and exact distances that tests of forbidden regions share."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import trimesh
from scipy.optimize import nnls

from hmcs.arrays import Array
from hmcs.fixtures.regions.closest import nearest_pairs, normals_of
from hmcs.fixtures.regions.meshes import Mesh
from hmcs.fixtures.regions.tool_shape import PlacedTool, ToolShape
from hmcs.motion.quaternions import unit_quaternion

TOOLS = {
    "point": ToolShape.ball(0.0),
    "ball": ToolShape.ball(0.01),
    "capsule": ToolShape.capsule(np.zeros(3), np.array([0.0, 0.0, 0.08]), 0.006),
    "needle": ToolShape.capsule(np.zeros(3), np.array([0.02, 0.0, 0.05]), 0.0),
    "box": ToolShape.box(np.array([0.0, 0.0, 0.03]), np.array([0.04, 0.02, 0.06])),
    "rounded box": ToolShape.box(np.array([0, 0, 0.03]), np.array([0.04, 0.02, 0.06]), None, 0.004),
}


def as_mesh(*bodies: trimesh.Trimesh) -> Mesh:
    solid = bodies[0] if len(bodies) == 1 else trimesh.util.concatenate(list(bodies))
    return Mesh(np.asarray(solid.vertices), np.asarray(solid.faces, dtype=np.int64))


def block(*size_m: float, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> trimesh.Trimesh:
    solid = trimesh.creation.box(size_m)
    solid.apply_translation(at)
    return solid


def inside_out(solid: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(solid.vertices, solid.faces[:, ::-1], process=False)


def tray() -> trimesh.Trimesh:
    """A round dish with a thick wall: the tool can be caught in its corner."""
    profile = np.array([[0.0, -0.03], [0.06, -0.03], [0.06, 0.05], [0.1, 0.05], [0.1, -0.05]])
    return trimesh.creation.revolve(np.vstack([profile, [0.0, -0.05]])[::-1], sections=24)


def bowl(rings: int, radius_m: float = 0.06) -> trimesh.Trimesh:
    """Half a hollow ball in a block, as a surface of many narrow faces."""
    angles = np.linspace(-np.pi / 2, 0.0, rings)
    profile = radius_m * np.column_stack([np.cos(angles), np.sin(angles)])
    profile[0, 0] = 0.0
    out_m = radius_m + 0.01
    profile = np.vstack([profile, [out_m, 0.0], [out_m, -out_m], [0.0, -out_m]])
    return trimesh.creation.revolve(profile[::-1], sections=4 * rings)


def spiky() -> trimesh.Trimesh:
    """A star with blunt and sharp corners that point in and out."""
    solid = trimesh.creation.icosphere(2, 0.05)
    solid.vertices = solid.vertices * (1.0 + 0.5 * np.random.default_rng(4).random((162, 1)))
    return solid


SOLIDS: dict[str, Callable[[], trimesh.Trimesh]] = {
    "ball": lambda: trimesh.creation.icosphere(4, 0.05),
    "block": lambda: block(0.1, 0.08, 0.06),
    "tray": tray,
    "bowl": lambda: bowl(20),
    "star": spiky,
    "ring": lambda: trimesh.creation.torus(0.06, 0.02, major_sections=48, minor_sections=24),
    "cone": lambda: trimesh.creation.cone(0.05, 0.1, sections=1500),
    "plate": lambda: block(0.2, 0.2, 0.001),
}


def random_turn(rng: np.random.Generator) -> Array:
    quaternion = rng.normal(size=4)
    return unit_quaternion(quaternion / np.linalg.norm(quaternion))


def hull_distance_m(one: Array, other: Array) -> float:
    """Distance of the convex hulls of corners, (m, 3) and (n, 3); 0 where they meet.

    The widest slab between them, as a least-distance problem (Lawson and Hanson 1974, chapter 23).
    """
    apart = (one[:, None] - other[None]).reshape(-1, 3)
    scale = float(np.abs(apart).max())
    rows = np.vstack([(apart / scale).T, np.ones(len(apart))])
    weights, rest = nnls(rows, np.array([0.0, 0.0, 0.0, 1.0]))
    if rest < 1e-12:
        return 0.0
    left = rows @ weights - [0.0, 0.0, 0.0, 1.0]
    return scale / float(np.linalg.norm(left[:3] / left[3]))


def triangle_distances_m(tool: PlacedTool, corners: Array) -> Array:
    """Distance of a tool from each triangle, (k, 3, 3), as if alone; below zero where they meet."""
    pairs = nearest_pairs(tool, corners, normals_of(corners))
    distances = np.linalg.norm(pairs.away, axis=1)
    normals = pairs.away / np.maximum(distances, 1e-300)[:, None]
    behind = np.vecdot(corners, normals[:, None]).max(axis=1)
    apart = (distances > 1e-12) & ((normals @ tool.corners.T).min(axis=1) - behind > -1e-12)
    return np.where(apart, distances, -1e-6) - tool.radius_m
