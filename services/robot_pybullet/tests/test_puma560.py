"""The URDF against the published tables, computed here a second time from the DH parameters.

P. I. Corke, B. Armstrong-Hélouvry: A search for consensus among model parameters reported for the
PUMA 560 robot. IEEE ICRA 1994; B. Armstrong, O. Khatib, J. Burdick, IEEE ICRA 1986.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pybullet
import pytest

from hmcs_robot.description.described import describe
from hmcs_robot.robots import ROBOTS
from hmcs_robot_pybullet.arm import Arm
from support.puma560 import (
    CENTER,
    CONFIGURATIONS,
    MASS,
    RANGES_DEG,
    dh_frames,
    gravity_torques,
    mass_matrix,
    tool_frame,
)


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
    arm = Arm(describe(ROBOTS["puma560"]), client)
    for q in CONFIGURATIONS:
        arm.place(q)
        tool = arm.tool()
        expected = tool_frame(q)
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
        assert np.abs(np.array(found) - gravity_torques(q)).max() < 1e-8


def test_mass_matrix_is_that_of_the_published_masses_and_inertias(puma: int, client: int) -> None:
    for q in CONFIGURATIONS:
        found = pybullet.calculateMassMatrix(puma, q.tolist(), physicsClientId=client)
        assert np.abs(np.array(found) - mass_matrix(q)).max() < 1e-6


def test_joint_ranges_are_the_published_ones_and_hold_the_elbow_down_pose(
    puma: int, client: int
) -> None:
    infos = [pybullet.getJointInfo(puma, joint, physicsClientId=client) for joint in range(6)]
    ranges = np.array([info[8:10] for info in infos])
    assert np.abs(ranges - np.radians(RANGES_DEG)).max() < 1e-5
    assert infos[2][8] < -3.9
    assert all(info[10] > 0 and info[11] > 0 for info in infos)
