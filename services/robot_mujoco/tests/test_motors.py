"""Motors that hold joint velocities with the torque they have."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hmcs_robot_mujoco.motors import torques_for


def drawn(seed: int, joints: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a mass matrix, a bias and an acceleration that is asked for."""
    random = np.random.default_rng(seed)
    root = random.normal(size=(joints, joints))
    mass = root @ root.T + 0.1 * np.eye(joints)
    return mass, 5.0 * random.normal(size=joints), 20.0 * random.normal(size=joints)


@given(st.integers(0, 10_000), st.integers(1, 7))
def test_strong_motors_accelerate_every_joint_as_asked(seed: int, joints: int) -> None:
    mass, bias, asked = drawn(seed, joints)
    torques = torques_for(asked, mass, bias, np.full(joints, 1e9))
    np.testing.assert_allclose(np.linalg.solve(mass, torques - bias), asked, atol=1e-6)


@given(st.integers(0, 10_000), st.integers(2, 7), st.floats(0.1, 50.0))
def test_a_motor_gives_no_more_than_it_has_and_those_with_some_left_do_as_asked(
    seed: int, joints: int, most: float
) -> None:
    mass, bias, asked = drawn(seed, joints)
    torques = torques_for(asked, mass, bias, np.full(joints, most))
    assert (np.abs(torques) <= most + 1e-9).all()
    reached = np.linalg.solve(mass, torques - bias)
    spare = np.abs(torques) < most * (1 - 1e-9)
    np.testing.assert_allclose(reached[spare], asked[spare], atol=1e-6 * (1 + np.abs(asked).max()))
