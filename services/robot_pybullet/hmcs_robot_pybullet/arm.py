"""An arm loaded into PyBullet: its joints, its tool frame and its Jacobian.

PyBullet measures the points whose Jacobian it gives in a frame of its own, knows nothing of joints
that follow others, and crashes on ndarrays; all of that ends here.
"""

from __future__ import annotations

import tempfile
from itertools import combinations
from pathlib import Path

import numpy as np
import pybullet

from hmcs.arms.state import Pose
from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs.fixtures.regions.closest import cross
from hmcs.motion import quaternions
from hmcs_robot.description.described import DescribedArm
from hmcs_robot.description.following import CAUGHT_UP_PER_S, followed_by
from hmcs_robot.engine import CLEAR_AT_HOME_M, JOINTS_BETWEEN

BASE_LINK = -1


class Arm:
    """One arm, fixed at the origin of a PyBullet client."""

    def __init__(self, arm: DescribedArm, client: int) -> None:
        self._client = client
        self.body: int = _load(arm, client)
        infos = [
            pybullet.getJointInfo(self.body, index, physicsClientId=client)
            for index in range(pybullet.getNumJoints(self.body, physicsClientId=client))
        ]
        movable = [info for info in infos if info[2] != pybullet.JOINT_FIXED]
        self.moving_joints: list[int] = [info[0] for info in movable]
        """Those of the arm and those that follow them."""
        names = [info[1].decode() for info in movable]
        self._per_joint, self._offsets = followed_by(arm.chain, names)
        self.joint_names = arm.chain.joint_names
        self.joints: list[int] = [
            self.moving_joints[names.index(name)] for name in self.joint_names
        ]
        self.efforts: list[float] = (np.abs(self._per_joint) @ arm.chain.efforts).tolist()
        """Of the moving joints, N·m or N."""
        self.limits = arm.chain.limits
        self._link_names: dict[int, str] = {info[0]: info[12].decode() for info in infos}
        tool_link = arm.tool_link
        self._tool_link = next(info[0] for info in infos if info[12].decode() == tool_link)
        self._inertial = [_inertial_frame(self.body, info[0], client) for info in infos]
        joints_below = {BASE_LINK: 0}
        for info in infos:
            joints_below[info[0]] = joints_below[info[16]] + (info in movable)
        self.moving_links = frozenset(link for link, below in joints_below.items() if below)
        self.apart = self._far_links(joints_below, arm.home)
        inertial = self._inertial[self._tool_link]
        in_link = np.array([0.0, 0.0, arm.model.tool_offset_m]) - inertial.position
        self._tool_from_mass: Array = _matrix(inertial).T @ in_link
        try:
            self.jacobian(arm.home)
        except SystemError as error:
            raise UserError(
                f"{arm.urdf.file}: PyBullet cannot compute its Jacobian, for the inertia of a link "
                "(it says above which): use the engine mujoco, or correct the inertia"
            ) from error

    def _far_links(self, joints_below: dict[int, int], home: Array) -> list[tuple[int, int]]:
        """Pairs of links with so many joints between them that they may meet but do not at home."""
        self.place(home)
        links = [
            link
            for link in sorted(joints_below)
            if pybullet.getCollisionShapeData(self.body, link, physicsClientId=self._client)
        ]
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
        """Put the arm at `joint_positions`, rad or m, shape (n,), at rest."""
        for joint, position in zip(
            self.moving_joints, self._all_moving(joint_positions).tolist(), strict=True
        ):
            pybullet.resetJointState(self.body, joint, position, physicsClientId=self._client)

    def velocities(self, joint_velocities: Array) -> list[float]:
        """Return the velocities of the moving joints, for those of the arm, rad/s or m/s, (n,)."""
        velocities = self._per_joint @ joint_velocities
        if len(self.moving_joints) > len(self.joints):
            states = pybullet.getJointStates(
                self.body, self.moving_joints, physicsClientId=self._client
            )
            at = dict(zip(self.moving_joints, (state[0] for state in states), strict=True))
            wanted = self._all_moving(np.array([at[joint] for joint in self.joints]))
            velocities = velocities + CAUGHT_UP_PER_S * (wanted - list(at.values()))
        followed: list[float] = velocities.tolist()
        return followed

    def _all_moving(self, joint_positions: Array) -> Array:
        positions: Array = self._per_joint @ joint_positions + self._offsets
        return positions

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
        still = [0.0] * len(self.moving_joints)
        positions = self._all_moving(joint_positions).tolist()
        parts = pybullet.calculateJacobian(
            self.body,
            link,
            point.tolist(),
            positions,
            still,
            still,
            physicsClientId=self._client,
        )
        jacobian: Array = np.vstack(parts) @ self._per_joint
        return jacobian


def _load(arm: DescribedArm, client: int) -> int:
    """Load an arm, fixed at the origin; raises UserError where PyBullet does not read it."""
    with tempfile.TemporaryDirectory(prefix="hmcs-arm-") as folder:
        file = Path(folder) / "arm.urdf"
        file.write_text(arm.to_simulate(), encoding="utf-8")
        try:
            body: int = pybullet.loadURDF(
                str(file),
                useFixedBase=True,
                flags=pybullet.URDF_USE_INERTIA_FROM_FILE,
                physicsClientId=client,
            )
        except pybullet.error as error:
            raise UserError(
                f"{arm.urdf.file}: PyBullet cannot load it ({error}): see what it wrote above, and "
                "leave out the shapes it does not read"
            ) from error
    return body


def _inertial_frame(body: int, link: int, client: int) -> Pose:
    """Return the frame of a link's mass in the link's own frame."""
    info = pybullet.getDynamicsInfo(body, link, physicsClientId=client)
    return Pose(np.array(info[3]), np.array(info[4]))


def _matrix(pose: Pose) -> Array:
    return np.array(pybullet.getMatrixFromQuaternion(pose.orientation.tolist())).reshape(3, 3)
