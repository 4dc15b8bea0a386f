"""Meshes of the tests, and tools beside them and pushed against them."""

from __future__ import annotations

import numpy as np
import trimesh
from hypothesis import strategies as st

from hmcs.fixtures.regions.closest import normals_of
from hmcs.fixtures.regions.forbidden import Region, nearby
from hmcs.fixtures.regions.keep_out import KeepOut
from hmcs.fixtures.regions.tool_shape import PlacedTool
from hmcs.motion.quaternions import turned
from support.solids import SOLIDS, TOOLS, as_mesh, block, random_turn

REACH_M = 0.01
HOLD_S, PERIOD_S, SPEED_M_S = 0.03, 0.01, 0.25
seeds = st.integers(0, 2**32 - 1)
tools, solids = st.sampled_from(sorted(TOOLS)), st.sampled_from(sorted(SOLIDS))
UNTURNED = np.array([0.0, 0.0, 0.0, 1.0])
MESHES = {name: as_mesh(made()) for name, made in SOLIDS.items()}
CORNERS = {name: np.asarray(made().triangles) for name, made in SOLIDS.items()}


def beside(name: str, tool: str, rng: np.random.Generator) -> PlacedTool:
    """A tool one of whose corners is about at the surface."""
    corners = CORNERS[name]
    at = int(rng.integers(len(corners)))
    place = rng.dirichlet(np.ones(3)) @ corners[at]
    there = PlacedTool(TOOLS[tool], np.zeros(3), random_turn(rng))
    corner = there.corners[int(rng.integers(len(there.corners)))]
    off_m = TOOLS[tool].radius_m * rng.integers(0, 2) + 0.008 * rng.normal()
    position = place - corner + off_m * normals_of(corners[at : at + 1])[0]
    return PlacedTool(TOOLS[tool], position, there.orientation)


def pushed(regions: tuple[Region, ...], tool: PlacedTool, velocity: np.ndarray) -> PlacedTool:
    """The tool a period later, kept out of the regions."""
    near = nearby(regions, tool, 0.03)
    twist = KeepOut(near, HOLD_S).admitted(np.concatenate([velocity, np.zeros(3)]))
    return PlacedTool(
        tool.shape,
        tool.position + twist[:3] * PERIOD_S,
        turned(tool.orientation, twist[3:], PERIOD_S),
    )


def table(divided: int) -> trimesh.Trimesh:
    """A thick board whose top is at 0, of ever more triangles."""
    board = block(0.4, 0.4, 0.1, at=(0.0, 0.0, -0.05))
    for _ in range(divided):
        board = board.subdivide()
    return board
