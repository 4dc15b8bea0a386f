"""Playing a demonstration: pure, the time is passed in."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import DeadZone, Step, steps_of
from hmcs_input_device.playback import Passes, Playback

TIME_S = np.arange(0, 2.0001, 0.01)
CURVE = Demonstration(
    "curve",
    TIME_S,
    0.1 * np.stack([np.sin(3 * TIME_S), np.cos(2 * TIME_S), TIME_S], axis=1),
    (None,) * len(TIME_S),
)


def steps_played(source: Playback, rate_hz: float) -> list[Step]:
    """What the service makes of a source, tick by tick."""
    zone, made = DeadZone(0.01), []
    for tick in range(int((source.duration_s + 1) * rate_hz)):
        sample = source.sample(tick / rate_hz)
        if not sample.dead_man:
            zone.lift()
        elif (step := zone.push(sample.position)) is not None:
            made.append(step)
    return made


def test_the_device_rests_with_the_dead_man_released_before_and_after() -> None:
    source = Playback(CURVE, Passes(lead_in_s=0.5))
    for elapsed_s, index in ((None, 0), (0.0, 0), (0.49, 0), (2.51, -1), (1e9, -1)):
        sample = source.sample(elapsed_s)
        assert not sample.dead_man
        np.testing.assert_array_equal(sample.position, CURVE.positions[index])
        np.testing.assert_array_equal(sample.velocity, 0)


@given(st.floats(0, 2), st.floats(0.1, 10))
def test_while_it_moves_the_hand_is_where_the_recording_was(moved_s: float, speed: float) -> None:
    source = Playback(CURVE, Passes(speed=speed, lead_in_s=0.5))
    sample = source.sample(0.5 + moved_s / speed * 0.999)
    assert sample.dead_man
    expected = [np.interp(moved_s * 0.999, TIME_S, CURVE.positions[:, k]) for k in range(3)]
    np.testing.assert_allclose(sample.position, expected, atol=1e-9)


@given(st.floats(0.05, 1.95), st.floats(0.1, 5))
def test_velocity_is_the_derivative_at_the_speed_it_is_played(t: float, speed: float) -> None:
    window_s = 0.02 / speed
    source = Playback(CURVE, Passes(speed, lead_in_s=0.1, velocity_window_s=window_s))
    derivative = 0.1 * np.array([3 * np.cos(3 * t), -2 * np.sin(2 * t), 1]) * speed
    seen = source.sample(0.1 + t / speed).velocity
    np.testing.assert_allclose(seen, derivative, atol=2e-3 * speed)


def test_velocities_add_up_to_the_motion() -> None:
    source = Playback(CURVE, Passes(lead_in_s=0.1))
    samples = [source.sample(0.1 + k / 1000) for k in range(2001)]
    travelled = sum(sample.velocity for sample in samples) / 1000
    np.testing.assert_allclose(travelled, CURVE.positions[-1] - CURVE.positions[0], atol=5e-3)


def test_played_at_its_own_rate_its_steps_are_those_of_the_recording() -> None:
    source = Playback(CURVE, Passes(lead_in_s=0.5))
    assert source.rate_hz == pytest.approx(100)
    played, recorded = steps_played(source, 100), steps_of(CURVE.positions, 0.01)
    assert len(played) == len(recorded) > 30
    for step, same in zip(played, recorded, strict=True):
        np.testing.assert_allclose(step.position, same.position, atol=1e-9)


def test_passes_join_into_one_path_without_a_jump() -> None:
    once = steps_played(Playback(CURVE, Passes(lead_in_s=0.2)), 100)
    thrice = steps_played(Playback(CURVE, Passes(lead_in_s=0.2, repeat=3)), 100)
    assert abs(len(thrice) - 3 * len(once)) <= 3
    assert max(np.linalg.norm(step.displacement) for step in thrice) < 0.02


@pytest.mark.parametrize("repeat", [1, 2, 5])
def test_it_plays_as_often_as_told_and_then_ends(repeat: int) -> None:
    source = Playback(CURVE, Passes(lead_in_s=0.5, repeat=repeat))
    assert source.duration_s == pytest.approx(2.5 * repeat)
    held = [source.sample(t).dead_man for t in np.arange(0, source.duration_s + 2, 0.01)]
    assert int(np.diff(np.array(held, dtype=int)).clip(0).sum()) == repeat
    last = source.sample(source.duration_s)
    np.testing.assert_allclose(last.position, CURVE.positions[-1])


def test_for_ever_has_no_end() -> None:
    source = Playback(CURVE, Passes(lead_in_s=0.5, repeat=0))
    assert np.isinf(source.duration_s)
    assert source.sample(2.5 * 1000 + 1.5).dead_man


@pytest.mark.parametrize(("recorded_hz", "own_hz"), [(5, 30), (200, 200), (5000, 1000)])
def test_its_own_rate_is_kept_within_what_a_device_has(recorded_hz: float, own_hz: float) -> None:
    time_s = np.arange(50) / recorded_hz
    slow = Demonstration("d", time_s, np.random.default_rng(0).normal(size=(50, 3)), (None,) * 50)
    assert Playback(slow, Passes()).rate_hz == pytest.approx(own_hz)


def test_reach_is_how_far_it_goes_and_not_how_long_it_is() -> None:
    there_and_back = Demonstration(
        "d", np.arange(3.0), np.array([[0, 0, 0], [0.1, 0, 0], [0, 0, 0]]), (None,) * 3
    )
    assert Playback(there_and_back, Passes()).reach_m == pytest.approx(0.1)
