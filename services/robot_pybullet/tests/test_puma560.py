"""The URDF against the published tables, computed here a second time from the DH parameters.

P. I. Corke, B. Armstrong-Hélouvry: A search for consensus among model parameters reported for the
PUMA 560 robot. IEEE ICRA 1994; B. Armstrong, O. Khatib, J. Burdick, IEEE ICRA 1986.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pybullet
import pytest

from hmcs_robot.robots import ROBOTS
from hmcs_robot_pybullet.arm import Arm

D = [0.672, 0, 0.15005, 0.4318, 0, 0]
A = [0, 0.4318, 0.0203, 0, 0, 0]
ALPHA = [np.pi / 2, 0, -np.pi / 2, np.pi / 2, -np.pi / 2, 0]
MASS = [13.0, 17.4, 4.8, 0.82, 0.34, 0.09]
"""kg; that of link 1 was never published and no torque depends on it."""
CENTER = [
    (0, 0, 0),
    (-0.3638, 0.006, 0.2275),
    (-0.0203, -0.0141, 0.070),
    (0, 0.019, 0),
    (0, 0, 0),
    (0, 0, 0.032),
]
"""Centers of mass in DH frame i, m."""
INERTIA = [
    (0.35, 0.35, 0.35),
    (0.13, 0.524, 0.539),
    (0.066, 0.0784, 0.0125),
    (1.8e-3, 1.3e-3, 1.8e-3),
    (0.3e-3, 0.4e-3, 0.3e-3),
    (0.15e-3, 0.15e-3, 0.04e-3),
]
"""About the centers of mass, axes of DH frame i, kg·m²; 0.0784 is 0.086 in the publication."""
RANGES_DEG = [(-160, 160), (-45, 225), (-225, 45), (-110, 170), (-100, 100), (-266, 266)]
RNG = np.random.default_rng(560)
LOWER, UPPER = np.radians(RANGES_DEG).T
CONFIGURATIONS = RNG.uniform(LOWER, UPPER, size=(50, 6))


def dh_frames(q: np.ndarray) -> list[np.ndarray]:
    frames = [np.eye(4)]
    for angle, d, a, alpha in zip(q, D, A, ALPHA, strict=True):
        c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(alpha), np.sin(alpha)
        step = [
            [c, -s * ca, s * sa, a * c],
            [s, c * ca, -c * sa, a * s],
            [0, sa, ca, d],
            [0, 0, 0, 1],
        ]
        frames.append(frames[-1] @ np.array(step))
    return frames


def center_jacobians(q: np.ndarray) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return the linear and angular Jacobian of each center of mass, and each link's rotation."""
    frames = dh_frames(q)
    result = []
    for link in range(6):
        turn, center = frames[link + 1][:3, :3], frames[link + 1] @ [*CENTER[link], 1]
        linear, angular = np.zeros((3, 6)), np.zeros((3, 6))
        for joint in range(link + 1):
            axis, origin = frames[joint][:3, 2], frames[joint][:3, 3]
            linear[:, joint] = np.cross(axis, center[:3] - origin)
            angular[:, joint] = axis
        result.append((linear, angular, turn))
    return result


@pytest.fixture
def client() -> Iterator[int]:
    """A PyBullet client with gravity."""
    number = pybullet.connect(pybullet.DIRECT)
    pybullet.setGravity(0, 0, -9.81, physicsClientId=number)
    yield number
    pybullet.disconnect(physicsClientId=number)


@pytest.fixture
def puma(client: int) -> int:
    return int(
        pybullet.loadURDF(
            str(ROBOTS["puma560"].urdf),
            useFixedBase=True,
            flags=pybullet.URDF_USE_INERTIA_FROM_FILE,
            physicsClientId=client,
        )
    )


def test_forward_kinematics_is_the_dh_product(client: int) -> None:
    arm = Arm(ROBOTS["puma560"], client)
    pen = np.eye(4)
    pen[2, 3] = 0.05625 + 0.12
    for q in CONFIGURATIONS:
        arm.place(q)
        tool = arm.tool()
        expected = dh_frames(q)[-1] @ pen
        turn = np.array(pybullet.getMatrixFromQuaternion(tool.orientation)).reshape(3, 3)
        assert np.abs(tool.position - expected[:3, 3]).max() < 1e-9
        assert np.abs(turn - expected[:3, :3]).max() < 1e-9


def test_masses_and_centers_of_mass_are_the_published_ones(puma: int, client: int) -> None:
    for joint in range(6):
        pybullet.resetJointState(puma, joint, CONFIGURATIONS[0][joint], physicsClientId=client)
    frames = dh_frames(CONFIGURATIONS[0])
    for link in range(6):
        mass = pybullet.getDynamicsInfo(puma, link, physicsClientId=client)[0]
        state = pybullet.getLinkState(
            puma, link, computeForwardKinematics=True, physicsClientId=client
        )
        assert mass == MASS[link]
        assert state[0] == pytest.approx((frames[link + 1] @ [*CENTER[link], 1])[:3], abs=1e-12)


def test_gravity_torques_are_the_gradient_of_the_potential_energy(puma: int, client: int) -> None:
    for q in CONFIGURATIONS:
        found = pybullet.calculateInverseDynamics(
            puma, q.tolist(), [0.0] * 6, [0.0] * 6, physicsClientId=client
        )
        expected = sum(
            mass * 9.81 * linear[2]
            for mass, (linear, _, _) in zip(MASS, center_jacobians(q), strict=True)
        )
        assert np.abs(np.array(found) - expected).max() < 1e-8


def test_mass_matrix_is_that_of_the_published_masses_and_inertias(puma: int, client: int) -> None:
    for q in CONFIGURATIONS:
        expected = np.zeros((6, 6))
        for mass, inertia, (linear, angular, turn) in zip(
            MASS, INERTIA, center_jacobians(q), strict=True
        ):
            expected += mass * linear.T @ linear
            expected += angular.T @ turn @ np.diag(inertia) @ turn.T @ angular
        found = pybullet.calculateMassMatrix(puma, q.tolist(), physicsClientId=client)
        assert np.abs(np.array(found) - expected).max() < 1e-6


def test_joint_ranges_are_the_published_ones_and_hold_the_elbow_down_pose(
    puma: int, client: int
) -> None:
    infos = [pybullet.getJointInfo(puma, joint, physicsClientId=client) for joint in range(6)]
    ranges = np.array([info[8:10] for info in infos])
    assert np.abs(ranges - np.radians(RANGES_DEG)).max() < 1e-5
    assert infos[2][8] < -3.9
    assert all(info[10] > 0 and info[11] > 0 for info in infos)
