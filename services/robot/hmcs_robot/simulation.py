"""A simulated arm among the obstacles of a task: one driver, in PyBullet."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pybullet

from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs.task import ForbiddenRegion, Obstacle
from hmcs_robot.arm import BASE_LINK, Arm
from hmcs_robot.arm_description import ArmDescription, arm_description
from hmcs_robot.bodies import add_obstacle, add_region, links_touching
from hmcs_robot.driver import ArmState, LinkNear, Nearest, Pose, Touch
from hmcs_robot.kinematics import inverse_kinematics
from hmcs_robot.robots import ROBOTS

_GRAVITY_M_S2 = 9.81
_TOUCHING_M = 0.0005
"""Nearer than this counts as contact: the solver keeps bodies about so far apart."""
_SELF_MARGIN_M = 0.005
"""Links of the arm itself are kept so far apart: nothing in the physics would."""
_LINKS_WITHIN_M = 0.08
"""Links nearer to a forbidden region than this are slowed down: farther than an arm that moves at
0.25 m/s goes while it slows to a stand."""
_WITHIN_M = 0.002
"""A link so near to a region at the start pose, or inside, is not kept out of that region."""
ITSELF = "itself"
"""What an arm touches whose own links meet."""


class StartPoseError(UserError):
    """The robot cannot stand where the task begins."""


class Scene(NamedTuple):
    """What is simulated."""

    robot: str
    """A name of `ROBOTS`."""
    start: Pose
    """Of the tool."""
    obstacles: tuple[Obstacle, ...]
    forbidden: tuple[ForbiddenRegion, ...] = ()
    """Regions that the links are kept out of; they are no bodies to collide with."""


class _LinkPoints(NamedTuple):
    """Points of a link that are closest to parts of a region, k of them."""

    link: int
    region: str
    distances_m: Array
    """Shape (k,)."""
    on_arm: Array
    """m, base frame, shape (k, 3)."""
    normals: Array
    """Away from the region, shape (k, 3)."""


class Simulation:
    """An arm that is moved by its joints' motors, each with the torque it has.

    One `move` is one step of the physics of `period_s`. The arm and the obstacles collide; the arm
    stops where its own links meet. `links_within` names the links that reach into a forbidden
    region at the start pose already, and so are not kept out of it. Raises UnreachablePoseError
    where the arm cannot reach the start pose, StartPoseError where it touches an obstacle there,
    UserError where no window opens.
    """

    def __init__(
        self, scene: Scene, period_s: float, *, gui: bool = False, reach_m: float = 0.2
    ) -> None:
        self.name = scene.robot
        self.home = start_posture(scene.robot, scene.start)
        self._reach_m = reach_m
        self._client = _connect(gui)
        pybullet.setGravity(0, 0, -_GRAVITY_M_S2, physicsClientId=self._client)
        pybullet.setTimeStep(period_s, physicsClientId=self._client)
        self.arm = Arm(ROBOTS[scene.robot], self._client)
        self.limits = self.arm.limits
        self.joint_names = self.arm.joint_names
        for link in range(pybullet.getNumJoints(self.arm.body, physicsClientId=self._client)):
            pybullet.changeDynamics(
                self.arm.body,
                link,
                linearDamping=0,
                angularDamping=0,
                jointDamping=0,
                physicsClientId=self._client,
            )
        self._obstacles = {
            add_obstacle(obstacle, self._client): obstacle.name for obstacle in scene.obstacles
        }
        self._regions = {
            region.name: add_region(region, self._client) for region in scene.forbidden
        }
        self.arm.place(self.home)
        for joint in self.arm.other_joints:
            pybullet.setJointMotorControl2(
                self.arm.body,
                joint,
                pybullet.VELOCITY_CONTROL,
                targetVelocity=0,
                force=100,
                physicsClientId=self._client,
            )
        # A base that stands behind the plane of a table is there to stay.
        self._within, self._granted_m = self._already_within(scene.forbidden)
        within = {(self.arm.link_name(link), name) for link, name in self._within}
        self.links_within = tuple(f"{link} in {name}" for link, name in sorted(within))
        touched = self.read().contacts
        if ITSELF in touched:
            self.close()
            raise StartPoseError(
                f"robot {scene.robot} touches itself at the start pose of the task: choose another "
                "tool_start_m or tool_orientation_xyzw"
            )
        if touched:
            self.close()
            raise StartPoseError(
                f"robot {scene.robot} touches {', '.join(touched)} at the start pose of the task: "
                "move the obstacle or choose another tool_start_m"
            )

    def read(self) -> ArmState:
        """Return where the arm is now."""
        states = pybullet.getJointStates(
            self.arm.body, self.arm.joints, physicsClientId=self._client
        )
        positions = np.array([state[0] for state in states])
        nearest, touches = self._look_around(positions)
        return ArmState(
            positions,
            np.array([state[1] for state in states]),
            self.arm.tool(),
            self.arm.jacobian(positions),
            nearest,
            touches,
            self._links_near(positions),
        )

    def move(self, joint_velocities: Array) -> None:
        """Advance the physics by one period, with the motors at `joint_velocities`, rad/s, (n,)."""
        pybullet.setJointMotorControlArray(
            self.arm.body,
            self.arm.joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=joint_velocities.tolist(),
            forces=self.arm.torques,
            physicsClientId=self._client,
        )
        pybullet.stepSimulation(physicsClientId=self._client)

    def robot_description(self) -> ArmDescription:
        """Return what is needed to draw the arm."""
        return arm_description(ROBOTS[self.name].urdf, self.arm.joint_names)

    def close(self) -> None:
        """End the simulation."""
        if pybullet.isConnected(physicsClientId=self._client):
            pybullet.disconnect(physicsClientId=self._client)

    def _look_around(self, positions: Array) -> tuple[Nearest | None, tuple[Touch, ...]]:
        nearest: Nearest | None = None
        touches = []
        for body, name in self._obstacles.items():
            for point in pybullet.getClosestPoints(
                self.arm.body, body, self._reach_m, physicsClientId=self._client
            ):
                link, on_arm, normal, distance = point[3], point[5], point[7], point[8]
                if link == BASE_LINK:
                    continue
                if nearest is None or distance < nearest.distance_m:
                    nearest = Nearest(name, distance)
                if distance <= _TOUCHING_M:
                    touches.append(
                        Touch(
                            name,
                            self.arm.separation_per_joint(
                                link, np.array(on_arm), np.array(normal), positions
                            ),
                        )
                    )
        return nearest, (*touches, *self._meeting_links(positions))

    def _links_near(self, positions: Array) -> tuple[LinkNear, ...]:
        return tuple(
            LinkNear(
                near.region,
                near.distances_m + self._granted_m.get((near.link, near.region), 0.0),
                self.arm.separation_per_joint(near.link, near.on_arm, near.normals, positions),
            )
            for near in self._link_points()
            if (near.link, near.region) not in self._within
        )

    def _already_within(
        self, regions: tuple[ForbiddenRegion, ...]
    ) -> tuple[set[tuple[int, str]], dict[tuple[int, str], float]]:
        """Return which links reach into which regions, and how deep into the cover of which meshes.

        A link that reaches into boxes that cover a mesh, and not into the mesh, is granted to stay
        as deep in them, m.
        """
        deep_m = {
            (near.link, near.region): float(near.distances_m.min())
            for near in self._link_points()
            if float(near.distances_m.min()) < _WITHIN_M
        }
        within = set(deep_m)
        for mesh in (region for region in regions if region.shape == "mesh"):
            links = {link for link, name in deep_m if name == mesh.name}
            if links:
                touching = links_touching(self.arm.body, links, mesh, _WITHIN_M, self._client)
                within -= {(link, mesh.name) for link in links - touching}
        granted_m = {key: _WITHIN_M - deep_m[key] for key in deep_m.keys() - within}
        return within, granted_m

    def _link_points(self) -> Iterator[_LinkPoints]:
        """Yield where links are near regions: each link and region once."""
        for region, bodies in self._regions.items():
            points = [
                point
                for body in bodies
                for point in pybullet.getClosestPoints(
                    self.arm.body, body, _LINKS_WITHIN_M, physicsClientId=self._client
                )
            ]
            for link in sorted({point[3] for point in points} & self.arm.moving_links):
                own = [point for point in points if point[3] == link]
                yield _LinkPoints(
                    link,
                    region,
                    np.array([point[8] for point in own]),
                    np.array([point[5] for point in own]),
                    np.array([point[7] for point in own]),
                )

    def _meeting_links(self, positions: Array) -> Iterator[Touch]:
        for one, other in self.arm.apart:
            for point in pybullet.getClosestPoints(
                self.arm.body,
                self.arm.body,
                _SELF_MARGIN_M,
                one,
                other,
                physicsClientId=self._client,
            ):
                normal = np.array(point[7])
                parting = self.arm.separation_per_joint(
                    one, np.array(point[5]), normal, positions
                ) - self.arm.separation_per_joint(other, np.array(point[6]), normal, positions)
                yield Touch(ITSELF, parting)


def start_posture(robot: str, start: Pose) -> Array:
    """Return the joint positions, rad, shape (n,), that bring the tool of `robot` to `start`.

    Raises UnreachablePoseError.
    """
    client = _connect(gui=False)
    try:
        model = ROBOTS[robot]
        return inverse_kinematics(Arm(model, client), robot, start, np.array(model.home))
    finally:
        pybullet.disconnect(physicsClientId=client)


def _connect(gui: bool) -> int:
    try:
        client: int = pybullet.connect(pybullet.GUI if gui else pybullet.DIRECT)
    except pybullet.error as error:
        raise UserError(f"no window could be opened ({error}): run without gui") from error
    if client < 0:
        raise UserError("no window could be opened: is there a display? Run without gui")
    return client
