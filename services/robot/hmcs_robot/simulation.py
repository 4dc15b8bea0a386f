"""A simulated arm among the obstacles of a task: one driver, whichever engine moves it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from hmcs.arms.state import ArmState, LinkNear, Nearest, Pose, Touch
from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs.motion import quaternions
from hmcs.task import ForbiddenRegion, Obstacle
from hmcs_robot.arm_description import ArmDescription, arm_description
from hmcs_robot.description.checking import reach_of, tool_at
from hmcs_robot.description.described import (
    DescribedArm,
    check_follows,
    describe,
    joint_positions_text,
)
from hmcs_robot.engine import AUTO, Cell, engine_named
from hmcs_robot.kinematics import UnreachablePoseError, inverse_kinematics
from hmcs_robot.robots import RobotModel, robot_named

_TOUCHING_M = 0.0005
"""Nearer than this counts as contact: the solver keeps bodies about so far apart."""
_SELF_MARGIN_M = 0.005
"""Links of the arm itself are kept so far apart: nothing in the physics would."""
_LINKS_WITHIN_M = 0.08
"""Links nearer to a forbidden region than this are slowed down: farther than an arm that moves at
0.25 m/s goes while it slows to a stand."""
_OFF_M, _OFF_RAD = 0.002, 0.02
"""A named posture whose tool is no farther from where the task begins is one of that start."""
_WITHIN_M = 0.002
"""A link so near to a region at the start pose, or inside, is not kept out of that region."""
ITSELF = "itself"
"""What an arm touches whose own links meet."""


class StartPoseError(UserError):
    """The robot cannot stand where the task begins."""


class Scene(NamedTuple):
    """What is simulated."""

    robot: str
    """As in a task file, or the name of `model`."""
    start: Pose
    """Of the tool."""
    obstacles: tuple[Obstacle, ...]
    forbidden: tuple[ForbiddenRegion, ...] = ()
    """Regions that the links are kept out of; they are no bodies to collide with."""
    model: RobotModel | None = None
    """The arm; None for the one of that name."""
    start_pose: str | None = None
    """Which of the arm's named postures it begins in; None: one is found for `start`."""


class Simulation:
    """An arm that is moved by its joints' motors, each with the torque it has.

    One `move` is one step of the physics of `period_s`. The arm and the obstacles collide; the arm
    stops where its own links meet. `links_within` names the links that reach into a forbidden
    region at the start pose already, and so are not kept out of it. Raises UnreachablePoseError
    where the arm cannot reach the start pose, StartPoseError where it touches an obstacle there or
    the tool is elsewhere in the posture it is to begin in,
    UserError where no window opens or there is no such engine.
    """

    def __init__(
        self,
        scene: Scene,
        period_s: float,
        *,
        engine: str = AUTO,
        gui: bool = False,
        reach_m: float = 0.2,
    ) -> None:
        self.name = scene.robot
        self._reach_m = reach_m
        model = scene.model or robot_named(scene.robot)
        self._described = describe(model)
        check_follows(self._described)
        self.engine_name, opens = engine_named(engine)
        self.engine = opens(Cell(model, scene.obstacles, scene.forbidden), period_s, gui=gui)
        try:
            self.home = self._start_posture(scene)
            self.engine.place(self.home)
            # A base that stands behind the plane of a table is there to stay.
            self._within, self._granted_m = self._already_within(scene.forbidden)
            self._check_start()
        except BaseException:
            self.close()
            raise
        self.limits = self.engine.limits
        self.joint_names = self.engine.joint_names
        within = {(self.engine.link_name(link), name) for link, name in self._within}
        self.links_within = tuple(f"{link} in {name}" for link, name in sorted(within))

    def read(self) -> ArmState:
        """Return where the arm is now."""
        positions, velocities = self.engine.joints()
        nearest, touches = self._look_around(positions)
        return ArmState(
            positions,
            velocities,
            self.engine.tool(),
            self.engine.jacobian(positions),
            nearest,
            touches,
            self._links_near(positions),
        )

    def move(self, joint_velocities: Array) -> None:
        """Advance the physics by one period, with the motors at `joint_velocities`, rad/s, (n,)."""
        self.engine.step(joint_velocities)

    def robot_description(self) -> ArmDescription:
        """Return what is needed to draw the arm."""
        return arm_description(self._described)

    def close(self) -> None:
        """End the simulation."""
        self.engine.close()

    def _start_posture(self, scene: Scene) -> Array:
        arm = self._described
        if scene.start_pose is not None:
            return _named_posture(arm, scene.start_pose, scene.start)
        try:
            return inverse_kinematics(self.engine, scene.robot, scene.start, arm.home)
        except UnreachablePoseError as error:
            reach = reach_of(arm.chain)
            ends = zip("xyz", reach.lower, reach.upper, strict=True)
            box = ", ".join(f"{axis} {lower:.2f} to {upper:.2f}" for axis, lower, upper in ends)
            raise UnreachablePoseError(
                f"{error}. In some orientation its tool gets up to {reach.farthest_m:.2f} m from "
                f"its base ({box} m)"
            ) from error

    def _check_start(self) -> None:
        touched = self.read().contacts
        if ITSELF in touched:
            raise StartPoseError(
                f"robot {self.name} touches itself at the start pose of the task: choose another "
                "tool_start_m or tool_orientation_xyzw"
            )
        if touched:
            raise StartPoseError(
                f"robot {self.name} touches {', '.join(touched)} at the start pose of the task: "
                "move the obstacle or choose another tool_start_m"
            )

    def _look_around(self, positions: Array) -> tuple[Nearest | None, tuple[Touch, ...]]:
        nearest: Nearest | None = None
        touches: list[Touch] = []
        for near in self.engine.near_obstacles(self._reach_m):
            distance_m = float(near.distances_m.min())
            if nearest is None or distance_m < nearest.distance_m:
                nearest = Nearest(near.name, distance_m)
            if distance_m <= _TOUCHING_M:
                touching = near.distances_m <= _TOUCHING_M
                separations = self.engine.separation_per_joint(
                    near.link, near.on_arm[touching], near.normals[touching], positions
                )
                touches.extend(Touch(near.name, separation) for separation in separations)
        return nearest, (*touches, *self._meeting_links(positions))

    def _links_near(self, positions: Array) -> tuple[LinkNear, ...]:
        return tuple(
            LinkNear(
                near.name,
                near.distances_m + self._granted_m.get((near.link, near.name), 0.0),
                self.engine.separation_per_joint(near.link, near.on_arm, near.normals, positions),
            )
            for near in self.engine.near_regions(_LINKS_WITHIN_M)
            if (near.link, near.name) not in self._within
        )

    def _already_within(
        self, regions: tuple[ForbiddenRegion, ...]
    ) -> tuple[set[tuple[int, str]], dict[tuple[int, str], float]]:
        """Return which links reach into which regions, and how deep into the cover of which meshes.

        A link that reaches into boxes that cover a mesh, and not into the mesh, is granted to stay
        as deep in them, m.
        """
        deep_m = {
            (near.link, near.name): float(near.distances_m.min())
            for near in self.engine.near_regions(_LINKS_WITHIN_M)
            if float(near.distances_m.min()) < _WITHIN_M
        }
        within = set(deep_m)
        for mesh in (region for region in regions if region.shape == "mesh"):
            links = {link for link, name in deep_m if name == mesh.name}
            if links:
                touching = self.engine.links_touching(links, mesh, _WITHIN_M)
                within -= {(link, mesh.name) for link in links - touching}
        granted_m = {key: _WITHIN_M - deep_m[key] for key in deep_m.keys() - within}
        return within, granted_m

    def _meeting_links(self, positions: Array) -> Iterator[Touch]:
        separation = self.engine.separation_per_joint
        for meeting in self.engine.near_itself(_SELF_MARGIN_M):
            parting = separation(
                meeting.one, meeting.on_one, meeting.normal, positions
            ) - separation(meeting.other, meeting.on_other, meeting.normal, positions)
            yield Touch(ITSELF, parting)


def _named_posture(arm: DescribedArm, name: str, start: Pose) -> Array:
    """Return a named posture, (n,); raises StartPoseError where its tool is not at the start."""
    positions = arm.poses[name]
    tool = tool_at(arm.chain, positions)
    off_m = float(np.linalg.norm(tool.position - start.position))
    turned = quaternions.between(tool.orientation, start.orientation)
    if off_m > _OFF_M or float(np.linalg.norm(turned)) > _OFF_RAD:
        raise StartPoseError(
            f"{arm.urdf.file}: in start_pose {name!r} the tool is not where the task begins: write "
            f"tool_start_m: {joint_positions_text(tool.position)} and tool_orientation_xyzw: "
            f"{joint_positions_text(tool.orientation)}, or leave start_pose out"
        )
    return positions
