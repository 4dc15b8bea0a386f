"""Playing a demonstration: pure, the time is passed in."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import DeadZone, Step, steps_of, steps_of_demonstration
from hmcs_input_device.playback import PRESSED_S, Passes, Playback

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
            zone.lift(pedal=sample.pedal)
            continue
        step = zone.push(
            sample.position,
            orientation=sample.orientation,
            wrench=sample.wrench,
            pedal=sample.pedal,
        )
        if step is not None:
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
def test_it_plays_as_often_as_asked_and_then_ends(repeat: int) -> None:
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


# --- orientation, wrench and pedal ----------------------------------------------------------------

TURN = 1.5 * TIME_S
FELT = CURVE._replace(
    # Every second quaternion has the other sign, as some devices send it.
    orientations=np.stack([0 * TURN, np.sin(TURN / 2), 0 * TURN, np.cos(TURN / 2)], axis=1)
    * np.where(np.arange(len(TURN)) % 2, -1.0, 1.0)[:, None],
    wrenches=np.outer(TIME_S, np.arange(1.0, 7.0)),
    states=("a",) * 50 + ("b",) * 70 + ("a",) * (len(TIME_S) - 120),
)


@given(st.floats(0, 1.99))
def test_the_hand_turns_and_pushes_as_it_was_recorded_between_samples_too(moved_s: float) -> None:
    sample = Playback(FELT, Passes(lead_in_s=0.5)).sample(0.5 + moved_s)
    half = 1.5 * moved_s / 2
    assert sample.orientation is not None
    assert abs(sample.orientation @ (0, np.sin(half), 0, np.cos(half))) == pytest.approx(1)
    assert np.linalg.norm(sample.orientation) == pytest.approx(1, abs=1e-12)
    np.testing.assert_allclose(sample.wrench, moved_s * np.arange(1.0, 7.0), atol=1e-8)


def test_at_rest_the_hand_keeps_its_orientation_and_does_not_push() -> None:
    source = Playback(FELT, Passes(lead_in_s=0.5))
    for elapsed_s, index in ((None, 0), (0.2, 0), (2.6, -1)):
        sample = source.sample(elapsed_s)
        assert FELT.orientations is not None
        assert abs(sample.orientation @ FELT.orientations[index]) == pytest.approx(1)
        np.testing.assert_array_equal(sample.wrench, np.zeros(6))


def test_a_recording_without_further_senses_plays_none() -> None:
    sample = Playback(CURVE, Passes(lead_in_s=0.5)).sample(1.0)
    assert (sample.orientation, sample.wrench, sample.pedal) == (None, None, False)


@pytest.mark.parametrize("repeat", [1, 3])
def test_played_at_its_own_rate_its_steps_tell_all_that_was_recorded(repeat: int) -> None:
    source = Playback(FELT, Passes(lead_in_s=0.5, repeat=repeat, mark_switches=True))
    played = steps_played(source, 100)
    recorded = steps_of_demonstration(FELT, 0.01, mark_switches=True)
    # The hand is lifted on the last sample of a pass: the step it would end goes on in the next.
    count = len(recorded) - 1
    for step, same in zip(played[:count], recorded[:count], strict=True):
        assert abs(step.orientation @ same.orientation) == pytest.approx(1)
        np.testing.assert_allclose(step.wrench, same.wrench, atol=1e-9)
        assert step.mark == same.mark
    assert sum(step.mark for step in recorded) == 3
    assert sum(step.mark for step in played) == 3 * repeat
    for before, after in itertools.pairwise(played[: len(recorded)]):
        assert before.orientation @ after.orientation > 0


def presses(source: Playback, rate_hz: float) -> list[float]:
    """When the pedal goes down, s."""
    times_s = np.arange(int(source.duration_s * rate_hz)) / rate_hz
    down = np.array([source.sample(t).pedal for t in times_s])
    return list(times_s[np.flatnonzero(np.diff(down.astype(int), prepend=0) > 0)])


@pytest.mark.parametrize("speed", [0.25, 0.5, 0.8])
def test_the_pedal_goes_down_where_a_label_begins_and_comes_up_soon(speed: float) -> None:
    source = Playback(FELT, Passes(speed, lead_in_s=0.5, mark_switches=True))
    expected = [0.5 + t / speed for t in (0.0, 0.5, 1.2)]
    np.testing.assert_allclose(presses(source, 1000), expected, atol=1.1e-3)
    for t in expected:
        assert source.sample(t + 0.9 * PRESSED_S).pedal
        assert not source.sample(t + 1.1 * PRESSED_S).pedal


def test_switches_closer_than_a_press_are_marked_one_by_one() -> None:
    states = tuple("ab"[k // 4 % 2] for k in range(len(TIME_S)))
    source = Playback(FELT._replace(states=states), Passes(lead_in_s=0.5, mark_switches=True))
    np.testing.assert_allclose(presses(source, 100), 0.5 + TIME_S[::4][:-1], atol=1e-9)


def test_the_pedal_stays_up_without_labels_and_when_not_asked_to_mark() -> None:
    unlabeled = FELT._replace(states=(None,) * len(TIME_S))
    assert presses(Playback(unlabeled, Passes(mark_switches=True)), 100) == []
    assert presses(Playback(FELT, Passes()), 100) == []
