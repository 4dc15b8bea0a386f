"""The engine `pybullet`: an arm among what stands in its cell, simulated by PyBullet."""

from __future__ import annotations

from collections.abc import Collection, Iterator

import numpy as np
import pybullet

from hmcs.arms.state import Pose
from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs.task import ForbiddenRegion
from hmcs_robot.description.described import describe
from hmcs_robot.engine import Cell, Meeting, Near
from hmcs_robot_pybullet.arm import Arm
from hmcs_robot_pybullet.bodies import add_obstacle, add_region, links_touching

_GRAVITY_M_S2 = 9.81


class PyBulletEngine:
    """An arm in a client of PyBullet of its own; see `hmcs_robot.engine.Engine`.

    Raises UserError where no window opens or PyBullet cannot load the arm.
    """

    def __init__(self, cell: Cell, period_s: float, *, gui: bool) -> None:
        self._client = _connect(gui)
        pybullet.setGravity(0, 0, -_GRAVITY_M_S2, physicsClientId=self._client)
        pybullet.setTimeStep(period_s, physicsClientId=self._client)
        self._arm = Arm(describe(cell.model), self._client)
        self.limits = self._arm.limits
        self.joint_names = self._arm.joint_names
        self.moving_links = self._arm.moving_links
        for link in range(pybullet.getNumJoints(self._arm.body, physicsClientId=self._client)):
            pybullet.changeDynamics(
                self._arm.body,
                link,
                linearDamping=0,
                angularDamping=0,
                jointDamping=0,
                physicsClientId=self._client,
            )
        self._obstacles = {
            add_obstacle(obstacle, self._client): obstacle.name for obstacle in cell.obstacles
        }
        self._regions = {region.name: add_region(region, self._client) for region in cell.forbidden}

    def link_name(self, link: int) -> str:
        """Return the name of a link, as in the URDF."""
        return self._arm.link_name(link)

    def place(self, joint_positions: Array) -> None:
        """Put the arm at `joint_positions`, rad, shape (n,), at rest."""
        self._arm.place(joint_positions)

    def tool(self) -> Pose:
        """Return the pose of the tool frame where the arm is now."""
        return self._arm.tool()

    def jacobian(self, joint_positions: Array) -> Array:
        """Return the Jacobian of the tool frame, base frame, linear part first, shape (6, n)."""
        return self._arm.jacobian(joint_positions)

    def joints(self) -> tuple[Array, Array]:
        """Return joint positions, rad, and velocities, rad/s, both of shape (n,)."""
        states = pybullet.getJointStates(
            self._arm.body, self._arm.joints, physicsClientId=self._client
        )
        return np.array([state[0] for state in states]), np.array([state[1] for state in states])

    def separation_per_joint(
        self, link: int, points: Array, normals: Array, joint_positions: Array
    ) -> Array:
        """Return how points of `link` move along `normals`, m/rad, shape (n,) or (k, n)."""
        return self._arm.separation_per_joint(link, points, normals, joint_positions)

    def near_obstacles(self, within_m: float) -> Iterator[Near]:
        """Yield where links are so near to obstacles."""
        for body, name in self._obstacles.items():
            yield from self._near(name, (body,), within_m)

    def near_regions(self, within_m: float) -> Iterator[Near]:
        """Yield where moving links are so near to regions: each link and region once."""
        for name, bodies in self._regions.items():
            yield from self._near(name, bodies, within_m)

    def links_touching(
        self, links: Collection[int], mesh: ForbiddenRegion, within_m: float
    ) -> frozenset[int]:
        """Return which of the links are so near to a mesh, asked triangle by triangle."""
        return links_touching(self._arm.body, links, mesh, within_m, self._client)

    def near_itself(self, within_m: float) -> Iterator[Meeting]:
        """Yield where links that can meet are so near to each other."""
        body = self._arm.body
        for one, other in self._arm.apart:
            for point in pybullet.getClosestPoints(
                body, body, within_m, one, other, physicsClientId=self._client
            ):
                yield Meeting(
                    one, other, np.array(point[5]), np.array(point[6]), np.array(point[7])
                )

    def step(self, joint_velocities: Array) -> None:
        """Advance the physics by one period, with the motors at `joint_velocities`, rad/s, (n,)."""
        pybullet.setJointMotorControlArray(
            self._arm.body,
            self._arm.moving_joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=self._arm.velocities(joint_velocities),
            forces=self._arm.efforts,
            physicsClientId=self._client,
        )
        pybullet.stepSimulation(physicsClientId=self._client)

    def close(self) -> None:
        """End the simulation."""
        if pybullet.isConnected(physicsClientId=self._client):
            pybullet.disconnect(physicsClientId=self._client)

    def _near(self, name: str, bodies: tuple[int, ...], within_m: float) -> Iterator[Near]:
        points = [
            point
            for body in bodies
            for point in pybullet.getClosestPoints(
                self._arm.body, body, within_m, physicsClientId=self._client
            )
        ]
        for link in sorted({point[3] for point in points} & self.moving_links):
            own = [point for point in points if point[3] == link]
            yield Near(
                link,
                name,
                np.array([point[8] for point in own]),
                np.array([point[5] for point in own]),
                np.array([point[7] for point in own]),
            )


def _connect(gui: bool) -> int:
    try:
        client: int = pybullet.connect(pybullet.GUI if gui else pybullet.DIRECT)
    except pybullet.error as error:
        raise UserError(f"no window could be opened ({error}): run without gui") from error
    if client < 0:
        raise UserError("no window could be opened: is there a display? Run without gui")
    return client
