"""Steps after the dead zone: invariants over random motions."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hmcs.motion.steps import DeadZone, steps_of

coordinates = st.floats(-1, 1, allow_nan=False)
motions = st.integers(1, 60).flatmap(lambda n: arrays(float, (n, 3), elements=coordinates))
dead_zones = st.floats(1e-3, 0.5)


@given(motions, dead_zones)
def test_steps_chain_exactly_and_are_counted_without_gaps(
    motion: np.ndarray, dead_zone_m: float
) -> None:
    steps = steps_of(motion, dead_zone_m)
    assert [step.index for step in steps] == list(range(len(steps)))
    for before, after in itertools.pairwise(steps):
        assert (before.position + before.displacement == after.position).all()


@given(motions, dead_zones)
def test_every_step_is_at_least_the_dead_zone_long(motion: np.ndarray, dead_zone_m: float) -> None:
    for step in steps_of(motion, dead_zone_m):
        assert np.linalg.norm(step.displacement) >= dead_zone_m


@given(motions, dead_zones)
def test_steps_are_those_found_by_searching_the_motion(
    motion: np.ndarray, dead_zone_m: float
) -> None:
    kept = [0]
    for index in range(len(motion)):
        if np.linalg.norm(motion[index] - motion[kept[-1]]) >= dead_zone_m * (1 + 1e-9):
            kept.append(index)
        elif np.linalg.norm(motion[index] - motion[kept[-1]]) >= dead_zone_m * (1 - 1e-9):
            return
    steps = steps_of(motion, dead_zone_m)
    assert len(steps) == len(kept) - 1
    for step, index in zip(steps, kept, strict=False):
        np.testing.assert_allclose(step.position, motion[index], atol=1e-12)


@given(motions, st.integers(1, 59), arrays(float, 3, elements=coordinates))
def test_lifting_the_hand_takes_the_jump_out(
    motion: np.ndarray, lifted_after: int, jump: np.ndarray
) -> None:
    lifted_after = min(lifted_after, len(motion))
    zone = DeadZone(0.1)
    lifted = [zone.push(position) for position in motion[:lifted_after]]
    zone.lift()
    # The hand comes down elsewhere: from the same point of the path, but moved by the jump.
    lifted += [zone.push(position + jump) for position in motion[lifted_after - 1 :]]
    plain = steps_of(motion, 0.1)
    moved = [step for step in lifted if step is not None]
    lengths = [np.linalg.norm(step.displacement) for step in plain]
    if lengths and min(lengths) < 0.1 + 1e-9:
        return
    for before, after in itertools.pairwise(moved):
        assert (before.position + before.displacement == after.position).all()
    for step, same in zip(moved, plain, strict=False):
        np.testing.assert_allclose(step.position, same.position, atol=1e-9)


def test_a_jump_made_while_lifted_makes_no_step() -> None:
    zone = DeadZone(0.01)
    zone.push((0, 0, 0))
    zone.lift()
    assert zone.push((5, 5, 5)) is None
    step = zone.push((5, 5, 5.02))
    assert step is not None
    np.testing.assert_allclose(step.position, (0, 0, 0))
    np.testing.assert_allclose(step.displacement, (0, 0, 0.02))


def test_motion_below_the_dead_zone_makes_no_step() -> None:
    assert steps_of(np.random.default_rng(0).uniform(-0.04, 0.04, (1000, 3)), 0.2) == []


@pytest.mark.parametrize("bad", [(np.nan, 0, 0), (0, np.inf, 0), (0, 0), (0, 0, 0, 0)])
def test_a_position_that_is_none_is_refused_and_changes_nothing(bad: tuple[float, ...]) -> None:
    zone = DeadZone(0.01)
    zone.push((0, 0, 0))
    with pytest.raises(ValueError, match="three finite numbers"):
        zone.push(bad)
    step = zone.push((0.02, 0, 0))
    assert step is not None
    assert step.index == 0


@pytest.mark.parametrize("radius_m", [0, -1, np.nan, np.inf])
def test_a_dead_zone_that_is_no_length_is_refused(radius_m: float) -> None:
    with pytest.raises(ValueError, match="positive"):
        DeadZone(radius_m)


def test_changing_an_array_afterwards_does_not_change_a_step() -> None:
    position = np.zeros(3)
    zone = DeadZone(0.01)
    zone.push(position)
    position[:] = 9
    step = zone.push((0.02, 0, 0))
    assert step is not None
    np.testing.assert_array_equal(step.position, (0, 0, 0))
