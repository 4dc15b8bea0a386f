"""An arm loaded into PyBullet: its joints, its tool frame and its Jacobian.

PyBullet measures the points whose Jacobian it gives in a frame of its own, counts joints that are
no part of the arm (fingers), and crashes on ndarrays; all of that ends here.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pybullet

from hmcs.arrays import Array
from hmcs.fixtures.regions.closest import cross
from hmcs.motion import quaternions
from hmcs_robot.driver import JointLimits, Pose
from hmcs_robot.engine import CLEAR_AT_HOME_M, JOINTS_BETWEEN
from hmcs_robot.robots import RobotModel

BASE_LINK = -1


class Arm:
    """One arm, fixed at the origin of a PyBullet client."""

    def __init__(self, model: RobotModel, client: int) -> None:
        self._client = client
        self.body: int = pybullet.loadURDF(
            str(model.urdf),
            useFixedBase=True,
            flags=pybullet.URDF_USE_INERTIA_FROM_FILE,
            physicsClientId=client,
        )
        infos = [
            pybullet.getJointInfo(self.body, index, physicsClientId=client)
            for index in range(pybullet.getNumJoints(self.body, physicsClientId=client))
        ]
        movable = [info for info in infos if info[2] != pybullet.JOINT_FIXED]
        turning = [info for info in movable if info[2] == pybullet.JOINT_REVOLUTE]
        self.joints: list[int] = [info[0] for info in turning]
        self.other_joints: list[int] = [info[0] for info in movable if info not in turning]
        self.joint_names = tuple(info[1].decode() for info in turning)
        self.torques: list[float] = [info[10] for info in turning]
        speeds = model.joint_speed_rad_s or [info[11] for info in turning]
        self.limits = JointLimits(
            np.array([info[8] for info in turning]),
            np.array([info[9] for info in turning]),
            np.array(speeds, dtype=float),
        )
        self._link_names: dict[int, str] = {info[0]: info[12].decode() for info in infos}
        self._movable = len(movable)
        self._tool_link = next(info[0] for info in infos if info[12].decode() == model.tool_link)
        self._inertial = [_inertial_frame(self.body, info[0], client) for info in infos]
        joints_below = {BASE_LINK: 0}
        for info in infos:
            joints_below[info[0]] = joints_below[info[16]] + (info in turning)
        self.moving_links = frozenset(link for link, below in joints_below.items() if below)
        self.apart = self._far_links(joints_below, model)
        inertial = self._inertial[self._tool_link]
        in_link = np.array([0.0, 0.0, model.tool_offset_m]) - inertial.position
        self._tool_from_mass: Array = _matrix(inertial).T @ in_link

    def _far_links(self, joints_below: dict[int, int], model: RobotModel) -> list[tuple[int, int]]:
        """Pairs of links with so many joints between them that they may meet but do not at home."""
        self.place(np.array(model.home))
        links = sorted(joints_below)
        return [
            (one, other)
            for one, other in combinations(links, 2)
            if abs(joints_below[one] - joints_below[other]) >= JOINTS_BETWEEN
            and not pybullet.getClosestPoints(
                self.body, self.body, CLEAR_AT_HOME_M, one, other, physicsClientId=self._client
            )
        ]

    def link_name(self, link: int) -> str:
        """Return the name of a link, as in the URDF."""
        return self._link_names.get(link, "base")

    def place(self, joint_positions: Array) -> None:
        """Put the arm at `joint_positions`, rad, shape (n,), at rest."""
        for joint, position in zip(self.joints, joint_positions.tolist(), strict=True):
            pybullet.resetJointState(self.body, joint, position, physicsClientId=self._client)

    def tool(self) -> Pose:
        """Return the pose of the tool frame where the arm is now."""
        state = pybullet.getLinkState(
            self.body, self._tool_link, computeForwardKinematics=True, physicsClientId=self._client
        )
        # The link's own frame (4, 5) has the digits of a float32, that of its mass has them all.
        mass = Pose(np.array(state[0]), np.array(state[1]))
        back = quaternions.inverse(self._inertial[self._tool_link].orientation)
        return Pose(
            mass.position + _matrix(mass) @ self._tool_from_mass,
            quaternions.product(mass.orientation, back),
        )

    def jacobian(self, joint_positions: Array) -> Array:
        """Return the Jacobian of the tool frame, base frame, linear part first, shape (6, n)."""
        return self._jacobian(self._tool_link, self._tool_from_mass, joint_positions)

    def separation_per_joint(
        self, link: int, points: Array, normals: Array, joint_positions: Array
    ) -> Array:
        """Return how points of `link`, m, base frame, move along `normals`, m/rad.

        One point and normal have shape (3,), the answer (n,); k of them (k, 3), the answer (k, n).
        """
        if link == BASE_LINK:
            return np.zeros((*points.shape[:-1], len(self.joints)))
        state = pybullet.getLinkState(
            self.body, link, computeForwardKinematics=True, physicsClientId=self._client
        )
        mass = Pose(np.array(state[0]), np.array(state[1]))
        jacobian = self._jacobian(link, np.zeros(3), joint_positions)
        # n·(v + ω × r) = n·v + (r × n)·ω, r from the mass to the point.
        turning = cross(points - mass.position, normals)
        speeds: Array = normals @ jacobian[:3] + turning @ jacobian[3:]
        return speeds

    def _jacobian(self, link: int, from_mass: Array, joint_positions: Array) -> Array:
        """Return the Jacobian of a point given in the frame of the link's mass."""
        inertial = self._inertial[link]
        # PyBullet counts along the axes of the mass, but from the origin of the link.
        point = from_mass + _matrix(inertial).T @ inertial.position
        still = [0.0] * self._movable
        # The arm's joints come before those of its fingers.
        positions = joint_positions.tolist() + still[len(self.joints) :]
        parts = pybullet.calculateJacobian(
            self.body,
            link,
            point.tolist(),
            positions,
            still,
            still,
            physicsClientId=self._client,
        )
        return np.vstack(parts)[:, : len(self.joints)]


def _inertial_frame(body: int, link: int, client: int) -> Pose:
    """Return the frame of a link's mass in the link's own frame."""
    info = pybullet.getDynamicsInfo(body, link, physicsClientId=client)
    return Pose(np.array(info[3]), np.array(info[4]))


def _matrix(pose: Pose) -> Array:
    return np.array(pybullet.getMatrixFromQuaternion(pose.orientation.tolist())).reshape(3, 3)
