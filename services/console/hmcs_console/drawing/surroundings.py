"""What stands still in the scene: ground, workspace, obstacles, forbidden regions."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import trimesh
import viser

from hmcs.task import ForbiddenRegion, Obstacle, Workspace
from hmcs_console.drawing.nodes import node
from hmcs_console.shapes.geometry import box_edges, capsule, turn_to, wxyz
from hmcs_console.shapes.palette import FORBIDDEN, OBSTACLE, WORKSPACE

_THICKNESS_M = 0.002
_SEE_THROUGH = 0.25


def draw_ground(scene: viser.SceneApi) -> None:
    """Draw the plane the robot stands on, and its base frame."""
    scene.add_grid("/ground", width=4.0, height=4.0, cell_size=0.1, section_size=0.5)
    scene.add_frame("/base", axes_length=0.15, axes_radius=0.004)


def draw_workspace(scene: viser.SceneApi, workspace: Workspace) -> None:
    """Draw where the tool may be, what is in its way, and what it is kept out of."""
    edges = box_edges(workspace.lower_m, workspace.upper_m)
    scene.add_line_segments("/workspace", edges, WORKSPACE, thickness=_THICKNESS_M)
    for obstacle in workspace.obstacles:
        _draw_obstacle(scene, obstacle)
    size_m = float(np.linalg.norm(np.subtract(workspace.upper_m, workspace.lower_m)))
    for region in workspace.forbidden:
        _draw_region(scene, region, size_m)


def _draw_obstacle(scene: viser.SceneApi, obstacle: Obstacle) -> None:
    name = node("obstacles", obstacle.name)
    turn, position = wxyz(obstacle.orientation_xyzw), obstacle.position_m
    if obstacle.size_m is not None:
        scene.add_box(name, OBSTACLE, obstacle.size_m, wxyz=turn, position=position)
    elif obstacle.radius_m is not None and obstacle.length_m is not None:
        scene.add_cylinder(
            name, obstacle.radius_m, obstacle.length_m, OBSTACLE, wxyz=turn, position=position
        )
    elif obstacle.radius_m is not None:
        scene.add_icosphere(name, obstacle.radius_m, OBSTACLE, position=position)


def _draw_region(scene: viser.SceneApi, region: ForbiddenRegion, size_m: float) -> None:
    name, position = node("forbidden", region.name), region.position_m
    turn = wxyz(region.orientation_xyzw)
    if region.normal is not None:
        plate = (size_m, size_m, _THICKNESS_M)
        _draw_box(scene, name, plate, turn_to(region.normal), position)
    elif region.size_m is not None:
        _draw_box(scene, name, region.size_m, turn, position)
    elif region.radius_m is not None:
        surface = capsule(position, region.end_m or position, region.radius_m)
        scene.add_mesh_simple(name, *surface, color=FORBIDDEN, opacity=_SEE_THROUGH, side="double")
    elif region.file is not None:
        _draw_mesh(scene, name, Path(region.file), region.scale or 1.0, turn, position)


def _draw_box(
    scene: viser.SceneApi,
    name: str,
    size_m: tuple[float, float, float],
    turn: np.ndarray[tuple[int], np.dtype[np.float64]],
    position: tuple[float, float, float],
) -> None:
    scene.add_box(name, FORBIDDEN, size_m, opacity=_SEE_THROUGH, wxyz=turn, position=position)


def _draw_mesh(
    scene: viser.SceneApi,
    name: str,
    file: Path,
    scale: float,
    turn: np.ndarray[tuple[int], np.dtype[np.float64]],
    position: tuple[float, float, float],
) -> None:
    # A model file carries its task without the meshes that lay beside it.
    with contextlib.suppress(OSError, ValueError):
        mesh = trimesh.load_mesh(file)
        scene.add_mesh_simple(
            name,
            np.asarray(mesh.vertices) * scale,
            np.asarray(mesh.faces),
            color=FORBIDDEN,
            opacity=_SEE_THROUGH,
            side="double",
            wxyz=turn,
            position=position,
        )
