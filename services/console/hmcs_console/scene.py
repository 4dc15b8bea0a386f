"""What moves in the scene: robot, trails, the guide that leads, directions and forces."""

from __future__ import annotations

import logging

import numpy as np
import viser
from numpy.typing import NDArray
from viser.extras import ViserUrdf

from hmcs.bus.messages import FixtureState, RobotLooks, RobotState
from hmcs_console.geometry import line, wxyz
from hmcs_console.models import Guides
from hmcs_console.palette import DIRECTION, FORCE, UNKNOWN, Color, color_of
from hmcs_console.robot_model import joints_of, load_robot
from hmcs_console.seen import Picture

_ARROW_M = 0.12
_M_PER_N = 0.02
_LONGEST_FORCE_M = 0.3
_SHORTEST_M = 2e-3
_NOTHING = np.zeros((1, 2, 3), dtype=np.float32)


class Scene:
    """Draws pictures into the scene; called on one thread."""

    def __init__(
        self,
        server: viser.ViserServer,
        guides: Guides,
        log: logging.Logger,
    ) -> None:
        self._server = server
        self._guides = guides
        self._log = log
        scene = server.scene
        self._tool = scene.add_frame(
            "/tool", axes_length=0.08, axes_radius=0.004, origin_radius=0.008, visible=False
        )
        self._robot_trail = self._lines("/trails/robot", 0.004)
        self._hand_trail = self._lines("/trails/hand", 0.002)
        self._guide = scene.add_frame("/guide", show_axes=False, visible=False)
        self._direction = self._arrow("/arrows/direction", DIRECTION)
        self._force = self._arrow("/arrows/force", FORCE)
        self._looks: RobotLooks | None = None
        self._robot: ViserUrdf | None = None
        self._joints: dict[str, float] = {}
        self._drawn_guide = ("", "", "", "")

    def draw(self, picture: Picture) -> None:
        """Draw a moment."""
        if picture.looks is not self._looks:
            self._load(picture.looks)
        if picture.robot is not None:
            self._draw_robot(picture.robot)
        self._draw_guide(picture)
        self._draw_arrows(picture.robot, picture.fixture)
        _set_lines(self._robot_trail, *picture.robot_trail)
        _set_lines(self._hand_trail, *picture.hand_trail)

    def _load(self, looks: RobotLooks | None) -> None:
        self._looks = looks
        self._joints = {}
        if self._robot is not None:
            self._robot.remove()
            self._robot = None
        if looks is None:
            return
        try:
            self._server.scene.add_frame("/robot", show_axes=False)
            self._robot = ViserUrdf(self._server, load_robot(looks), root_node_name="/robot")
        except Exception:
            # Whatever a description does to its parsers, the tool is drawn all the same.
            self._log.warning("the robot cannot be drawn", exc_info=True)

    def _draw_robot(self, robot: RobotState) -> None:
        self._tool.visible = True
        self._tool.position = robot.tool_position
        self._tool.wxyz = wxyz(robot.tool_orientation)
        if self._robot is None or self._looks is None:
            return
        known = self._robot.get_actuated_joint_names()
        joints = joints_of(self._looks, robot.joint_positions, known)
        if joints and joints != self._joints:
            # Its description takes joints by name, too, which its drawing hands on.
            self._robot.update_cfg(joints)  # type: ignore[arg-type]
            self._joints = joints

    def _draw_guide(self, picture: Picture) -> None:
        fixture = picture.fixture
        if fixture is None or fixture.guide_origin is None or not fixture.gesteme:
            self._guide.visible = False
            return
        model_hash = picture.belief.model_hash if picture.belief is not None else ""
        wanted = (fixture.model, model_hash, fixture.state, fixture.gesteme)
        if wanted != self._drawn_guide:
            self._drawn_guide = wanted
            self._make_guide(*wanted, color_of(fixture.state, picture.states))
        self._guide.position = fixture.guide_origin
        self._guide.visible = True

    def _make_guide(
        self, model: str, model_hash: str, state: str, gesteme: str, color: Color
    ) -> None:
        scene = self._server.scene
        # Taking the frame away takes what lies in it along.
        self._guide.remove()
        self._guide = scene.add_frame("/guide", show_axes=False)
        guide = self._guides.find(model, model_hash, state, gesteme)
        if guide is None:
            return
        scene.add_line_segments("/guide/path", line(guide.points), color, thickness=0.008)
        if guide.volume is not None:
            scene.add_mesh_simple(
                "/guide/volume", *guide.volume, color=color, opacity=0.2, side="double"
            )

    def _draw_arrows(self, robot: RobotState | None, fixture: FixtureState | None) -> None:
        if robot is None or fixture is None:
            self._direction.visible = self._force.visible = False
            return
        force = fixture.wrench[:3] * _M_PER_N
        length_m = float(np.linalg.norm(force))
        if length_m > _LONGEST_FORCE_M:
            force = force * (_LONGEST_FORCE_M / length_m)
        _set_arrow(self._direction, robot.tool_position, fixture.preferred_direction * _ARROW_M)
        _set_arrow(self._force, robot.tool_position, force)

    def _lines(self, name: str, thickness_m: float) -> viser.LineSegmentsHandle:
        return self._server.scene.add_line_segments(
            name, _NOTHING, UNKNOWN, thickness=thickness_m, visible=False
        )

    def _arrow(self, name: str, color: Color) -> viser.ArrowsHandle:
        return self._server.scene.add_arrows(
            name,
            np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, _ARROW_M]]]),
            color,
            shaft_radius=0.004,
            head_radius=0.01,
            head_length=0.025,
            visible=False,
        )


def _set_lines(
    handle: viser.LineSegmentsHandle, segments: NDArray[np.float32], colors: NDArray[np.uint8]
) -> None:
    handle.visible = len(segments) > 0
    if len(segments):
        handle.points = segments
        handle.colors = colors


def _set_arrow(
    handle: viser.ArrowsHandle, begin: NDArray[np.float64], way: NDArray[np.float64]
) -> None:
    handle.visible = float(np.linalg.norm(way)) > _SHORTEST_M
    if handle.visible:
        handle.points = np.array([[begin, begin + way]], dtype=np.float32)
