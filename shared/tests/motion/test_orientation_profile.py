"""How the hand turns along a path."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hmcs.motion.orientation_profile import OrientationProfile, mean_orientation_profile
from hmcs.motion.quaternions import between


def turning(begun: Rotation, rate_rad_per_m: float, count: int = 50):
    """A straight motion of 0.3 m that turns evenly about z of the base."""
    points = np.linspace([0.0, 0, 0], [0.3, 0, 0], count)
    turns = Rotation.from_rotvec(rate_rad_per_m * points[:, :1] * [0, 0, 1.0])
    return points, (turns * begun).as_quat()


@pytest.fixture
def begun() -> list[Rotation]:
    return list(Rotation.random(4, rng=np.random.default_rng(1)))


def test_the_mean_turn_does_not_depend_on_how_the_hand_was_held_at_first(begun):
    shown = [turning(each, 2.0, count) for each, count in zip(begun, (20, 35, 50, 80), strict=True)]
    turns = OrientationProfile(
        mean_orientation_profile([p for p, _ in shown], [q for _, q in shown])
    )
    for progress in (0.0, 0.25, 0.5, 1.0):
        wanted = Rotation.from_rotvec([0, 0, 2.0 * 0.3 * progress]).as_quat()
        assert np.linalg.norm(between(turns.at(progress), wanted)) < 1e-3


def test_the_sign_of_a_quaternion_says_nothing(begun):
    points, turned = turning(begun[0], 3.0)
    flipped = turned * np.where(np.arange(len(turned)) % 3, 1.0, -1.0)[:, None]
    np.testing.assert_allclose(
        mean_orientation_profile([points], [turned]),
        mean_orientation_profile([points], [flipped]),
        atol=1e-12,
    )


def test_the_mean_of_two_turns_is_half_way(begun):
    shown = [turning(begun[0], 1.0), turning(begun[1], 2.0)]
    turns = OrientationProfile(
        mean_orientation_profile([p for p, _ in shown], [q for _, q in shown])
    )
    half = Rotation.from_rotvec([0, 0, 1.5 * 0.3]).as_quat()
    assert np.linalg.norm(between(turns.at(1.0), half)) < 1e-6


def test_a_hand_that_does_not_move_has_no_turns_along_its_way():
    with pytest.raises(ValueError, match="does not move"):
        mean_orientation_profile([np.zeros((5, 3))], [np.tile([0.0, 0, 0, 1], (5, 1))])
    with pytest.raises(ValueError, match="no performance"):
        mean_orientation_profile([], [])
