"""Operators who see the robot and steer it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hmcs.motion.closed_loop_operators import PRESETS, STEADY, ClosedLoopOperator, Habits
from hmcs.motion.paths import Path

PERIOD_S = 0.01
CORNER = Path(np.array([[0.0, 0, 0], [0.2, 0, 0], [0.2, 0.2, 0.1]]))
NOISELESS = replace(STEADY, speed_noise=0.0, wander_m_s=0.0, tremor_m_s=0.0)


def performed(habits: Habits, path: Path = CORNER, seed: int = 0, lag_ticks: int = 0):
    """Where a robot that follows the hand was, m, (T, 3); the velocities; whether it arrived."""
    operator = ClosedLoopOperator(habits, path, np.random.default_rng(seed), period_s=PERIOD_S)
    robot, trail, velocities = path.points[0].copy(), [], [np.zeros(3)] * lag_ticks
    for _ in range(6000):
        motion = operator.step(robot)
        if motion.arrived:
            break
        velocities.append(motion.velocity)
        robot = robot + velocities[-1 - lag_ticks] * PERIOD_S
        trail.append(robot)
    return np.array(trail), np.array(velocities), motion.arrived


def off_m(points: np.ndarray, path: Path) -> np.ndarray:
    return np.array([np.linalg.norm(path.at(path.project(p)) - p) for p in points])


@pytest.mark.parametrize("name", PRESETS)
def test_every_operator_arrives(name: str) -> None:
    for seed in range(3):
        trail, _, arrived = performed(PRESETS[name], seed=seed)
        assert arrived
        assert np.linalg.norm(trail[-1] - CORNER.points[-1]) < 0.01


def test_without_noise_the_path_is_followed_closely() -> None:
    trail, _, arrived = performed(NOISELESS)
    assert arrived
    assert off_m(trail, CORNER).max() < 0.006


def test_noise_makes_errors_and_novices_make_larger_ones() -> None:
    def error(habits: Habits) -> float:
        trails = [performed(habits, seed=seed)[0] for seed in range(3)]
        return float(np.mean([off_m(trail, CORNER).mean() for trail in trails]))

    assert error(NOISELESS) < error(STEADY) < error(PRESETS["novice"])


def test_a_robot_that_answers_late_is_still_steered() -> None:
    trail, _, arrived = performed(NOISELESS, lag_ticks=10)
    assert arrived
    assert off_m(trail, CORNER).max() < 0.02


def test_hands_slow_down_in_corners() -> None:
    trail, velocities, _ = performed(NOISELESS)
    speed = np.linalg.norm(velocities, axis=1)
    near = np.linalg.norm(trail - CORNER.points[1], axis=1) < 0.01
    far = np.abs(np.linalg.norm(trail - CORNER.points[1], axis=1) - 0.1) < 0.02
    assert speed[near].mean() < 0.7 * speed[far].mean()
    assert speed.max() <= NOISELESS.speed_m_s * (1 + 1e-9)


def test_tremor_has_its_strength_in_its_band() -> None:
    habits = replace(NOISELESS, tremor_m_s=0.03)
    line = Path(np.array([[0.0, 0, 0], [3.0, 0, 0]]))
    _, velocities, _ = performed(habits, line)
    across = velocities[:, 1:]
    power = np.abs(np.fft.rfft(across, axis=0)) ** 2
    hz = np.fft.rfftfreq(len(across), PERIOD_S)
    band = (hz > 6.0) & (hz < 14.0)
    assert power[band].sum() > 0.9 * power.sum()
    # Two of three axes.
    assert np.sqrt((across**2).sum(axis=1).mean()) == pytest.approx(0.03 * np.sqrt(2 / 3), rel=0.3)


def test_a_change_of_mind_goes_back_and_then_on() -> None:
    line = Path(np.array([[0.0, 0, 0], [1.0, 0, 0]]))
    habits = replace(NOISELESS, changes_of_mind_per_m=4.0)
    trail, _, arrived = performed(habits, line, seed=3)
    assert arrived
    back = np.maximum.accumulate(trail[:, 0]) - trail[:, 0]
    assert back.max() > 0.5 * habits.goes_back_m


def test_equal_seeds_make_equal_hands() -> None:
    np.testing.assert_array_equal(performed(STEADY, seed=5)[0], performed(STEADY, seed=5)[0])


@pytest.mark.parametrize(
    "wrong",
    [
        {"speed_m_s": 0.0},
        {"delay_s": -0.1},
        {"tremor_band_hz": (12.0, 8.0)},
        {"speed_noise": float("nan")},
    ],
)
def test_habits_that_cannot_be_are_refused(wrong: dict) -> None:
    with pytest.raises(ValueError, match="expected"):
        replace(STEADY, **wrong)
