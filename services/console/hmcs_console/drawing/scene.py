"""What moves in the scene: robot, trails, guides, directions and forces."""

from __future__ import annotations

import logging
import time

import numpy as np
import viser
from numpy.typing import NDArray

from hmcs.bus.messages import FixtureState, RobotDescription, RobotState
from hmcs.recognition.model import Model
from hmcs_console.drawing.drawn_guides import DrawnGuides
from hmcs_console.drawing.drawn_robot import DrawnRobot
from hmcs_console.drawing.robot_model import joints_of, load_robot
from hmcs_console.seeing.seen import Picture
from hmcs_console.shapes.geometry import wxyz
from hmcs_console.shapes.palette import DIRECTION, FORCE, Color
from hmcs_console.shapes.pieces import Pieces, add_pieces, draw_pieces

TRAILS_EVERY_S = 0.1
"""How often trails are drawn: a long one is more to send than all else that moves."""
LOOKS_EVERY_S = 5.0
"""How often a robot is loaded anew at most: it takes its time, and nothing is drawn meanwhile."""
_ARROW_M = 0.12
_M_PER_N = 0.02
_LONGEST_FORCE_M = 0.3
_SHORTEST_M = 2e-3


class Scene:
    """Draws pictures into the scene; called on one thread."""

    def __init__(self, server: viser.ViserServer, log: logging.Logger) -> None:
        self._server = server
        self._log = log
        scene = server.scene
        self._tool = scene.add_frame(
            "/tool", axes_length=0.08, axes_radius=0.004, origin_radius=0.008, visible=False
        )
        self._robot_trail = add_pieces(scene, "/trails/robot", 0.004)
        self._hand_trail = add_pieces(scene, "/trails/hand", 0.002)
        self._guides = DrawnGuides(scene)
        self._drawn_trails: tuple[Pieces, ...] = ()
        self._trails_s = 0.0
        self._direction = self._arrow("/arrows/direction", DIRECTION)
        self._force = self._arrow("/arrows/force", FORCE)
        self._told: RobotDescription | None = None
        self._robot_description: RobotDescription | None = None
        self._loaded_s = -LOOKS_EVERY_S
        self._robot: DrawnRobot | None = None

    def draw(self, picture: Picture, model: Model | None) -> None:
        """Draw a moment, with the guides of the model that is followed."""
        now_s = time.monotonic()
        if picture.robot_description is not self._told and now_s - self._loaded_s >= LOOKS_EVERY_S:
            self._told = picture.robot_description
            if picture.robot_description != self._robot_description:
                self._loaded_s = now_s
                self._load(picture.robot_description)
        if picture.robot is not None:
            self._draw_robot(picture.robot)
        self._guides.draw(picture, model)
        self._draw_arrows(picture.robot, picture.fixture)
        if now_s - self._trails_s >= TRAILS_EVERY_S:
            self._trails_s = now_s
            self._draw_trails((picture.robot_trail, picture.hand_trail))

    def _load(self, robot_description: RobotDescription | None) -> None:
        self._robot_description = robot_description
        if self._robot is not None:
            self._robot.remove()
            self._robot = None
        if robot_description is None:
            return
        try:
            self._server.scene.add_frame("/robot", show_axes=False)
            self._robot = DrawnRobot(self._server, load_robot(robot_description), "/robot")
        except Exception as error:
            # Whatever a description does to its parsers, the tool is drawn all the same.
            reason = f"{type(error).__name__}: {error}"
            self._log.warning("the robot cannot be drawn", extra={"reason": reason})

    def _draw_robot(self, robot: RobotState) -> None:
        self._tool.visible = True
        self._tool.position = robot.tool_position
        self._tool.wxyz = wxyz(robot.tool_orientation)
        if self._robot is None or self._robot_description is None:
            return
        self._robot.move(joints_of(self._robot_description, robot.joint_positions))

    def _draw_trails(self, trails: tuple[Pieces, Pieces]) -> None:
        for handle, pieces in zip((self._robot_trail, self._hand_trail), trails, strict=True):
            if not any(pieces is drawn for drawn in self._drawn_trails):
                draw_pieces(handle, pieces)
        self._drawn_trails = trails

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


def _set_arrow(
    handle: viser.ArrowsHandle, begin: NDArray[np.float64], way: NDArray[np.float64]
) -> None:
    handle.visible = float(np.linalg.norm(way)) > _SHORTEST_M
    if handle.visible:
        handle.points = np.array([[begin, begin + way]], dtype=np.float32)
