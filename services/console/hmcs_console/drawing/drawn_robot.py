"""The robot in the scene, moved joint by joint.

The library looks up every joint's transform anew, fixed ones as well, which costs more than all
else that is drawn. But of a joint only its own angle or way ever changes.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, sin
from typing import Any, NamedTuple, cast

import numpy as np
import trimesh
import viser
import yourdfpy  # type: ignore[import-untyped]
from numpy.typing import NDArray
from viser.extras import ViserUrdf
from viser.transforms import SO3

from hmcs.motion.quaternions import product
from hmcs_console.drawing.nodes import node_in
from hmcs_console.shapes.geometry import wxyz

_STILL = 1e-4
"""A joint that moved no more, rad or m, is not drawn anew: at a meter that is 0.1 mm."""

Vector = NDArray[np.float64]


class Hinge(NamedTuple):
    """A joint that moves, and how it hangs on its parent."""

    leader: str
    """Whose position it goes by: its own name, unless it mimics another joint."""
    scale: float
    offset: float
    """It stands at so many times the leader's position plus this, rad or m."""
    axis: Vector | None
    """That it turns about, unit vector in its own frame, shape (3,); None where it slides."""
    along: Vector
    """That it slides along, parent's frame, shape (3,); zero where it turns."""
    position: Vector
    """Of its frame at zero, m, parent's frame, shape (3,)."""
    orientation: Vector
    """Of its frame at zero, x y z w, parent's frame, shape (4,)."""


class DrawnRobot(ViserUrdf):
    """A robot that is moved by the names of its joints."""

    def __init__(self, server: viser.ViserServer, robot: yourdfpy.URDF, root: str) -> None:
        """Draw it below the node `root`, with its joints at zero."""
        # It calls nodes by what stands in the robot's files.
        named = cast(viser.ViserServer, _Named(_NamedScene(server.scene)))
        super().__init__(named, robot, root_node_name=root)
        self.update_cfg(np.zeros(robot.num_actuated_joints))
        frames = zip(robot.joint_map.values(), self._joint_frames, strict=False)
        hinges = ((hinge_of(joint), frame) for joint, frame in frames)
        self._hinges = [(hinge, frame) for hinge, frame in hinges if hinge is not None]
        self._stands = [hinge.offset for hinge, _ in self._hinges]

    def move(self, joints: Mapping[str, float]) -> None:
        """Draw it with joints at these positions, rad or m; the others stay."""
        for index, (hinge, frame) in enumerate(self._hinges):
            if hinge.leader not in joints:
                continue
            stands = hinge.scale * joints[hinge.leader] + hinge.offset
            if abs(stands - self._stands[index]) > _STILL:
                self._stands[index] = stands
                if hinge.axis is None:
                    frame.position = hinge.position + stands * hinge.along
                else:
                    frame.wxyz = wxyz(product(hinge.orientation, turned(hinge.axis, stands)))


class _NamedScene:
    """A scene whose nodes may be called anything."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene

    def add_frame(self, name: str, **settings: Any) -> viser.FrameHandle:
        return self._scene.add_frame(node_in(name), **settings)

    def add_mesh_trimesh(self, name: str, mesh: trimesh.Trimesh) -> viser.GlbHandle:
        return self._scene.add_mesh_trimesh(node_in(name), mesh)


class _Named(NamedTuple):
    scene: _NamedScene


def hinge_of(joint: yourdfpy.Joint) -> Hinge | None:
    """Return what is to be known of a joint of a description; None for one that does not move."""
    axis = np.asarray(joint.axis, dtype=float)
    if joint.type not in ("revolute", "continuous", "prismatic") or not axis.any():
        return None
    origin = np.eye(4) if joint.origin is None else joint.origin
    slides, mimic = joint.type == "prismatic", joint.mimic
    return Hinge(
        leader=joint.name if mimic is None else mimic.joint,
        scale=1.0 if mimic is None else mimic.multiplier,
        offset=0.0 if mimic is None else mimic.offset,
        axis=None if slides else axis / np.linalg.norm(axis),
        along=origin[:3, :3] @ axis if slides else np.zeros(3),
        position=origin[:3, 3],
        orientation=np.roll(SO3.from_matrix(origin[:3, :3]).wxyz, -1),
    )


def turned(axis: Vector, angle_rad: float) -> Vector:
    """Return the rotation about a unit vector, shape (3,), as x y z w, shape (4,)."""
    return np.array([*(sin(angle_rad / 2) * axis), cos(angle_rad / 2)])
