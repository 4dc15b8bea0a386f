from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
import pytest

from hmcs.motion.quaternions import rotation_matrix
from hmcs_robot.engine import Cell
from hmcs_robot.robots import ROBOTS
from hmcs_robot_mujoco.engine import MujocoEngine
from support.puma560 import CONFIGURATIONS, gravity_torques, mass_matrix, tool_frame


@pytest.fixture
def puma() -> Iterator[MujocoEngine]:
    engine = MujocoEngine(Cell(ROBOTS["puma560"], (), ()), 1 / 240, gui=False)
    yield engine
    engine.close()


def test_forward_kinematics_is_the_dh_product(puma: MujocoEngine) -> None:
    for q in CONFIGURATIONS:
        puma.place(q)
        tool, expected = puma.tool(), tool_frame(q)
        assert np.abs(tool.position - expected[:3, 3]).max() < 1e-9
        assert np.abs(rotation_matrix(tool.orientation) - expected[:3, :3]).max() < 1e-9


def test_gravity_torques_are_the_gradient_of_the_potential_energy(puma: MujocoEngine) -> None:
    for q in CONFIGURATIONS:
        puma.place(q)
        assert np.abs(puma._data.qfrc_bias - gravity_torques(q)).max() < 1e-6


def test_mass_matrix_is_that_of_the_published_masses_and_inertias(puma: MujocoEngine) -> None:
    found = np.zeros((6, 6))
    for q in CONFIGURATIONS:
        puma.place(q)
        mujoco.mj_fullM(puma._model, puma._data, found)
        assert np.abs(found - mass_matrix(q)).max() < 1e-6
