"""Steps after the dead zone: invariants over random motions."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.quaternions import continuous, unit_quaternion
from hmcs.motion.steps import DeadZone, Step, steps_of, steps_of_demonstration

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


def test_a_hand_that_is_exactly_the_dead_zone_away_makes_a_step() -> None:
    zone = DeadZone(0.5)
    zone.push((0, 0, 0))
    assert zone.push((np.nextafter(0.5, 0), 0, 0)) is None
    step = zone.push((0.5, 0, 0))
    assert step is not None
    np.testing.assert_array_equal(step.displacement, (0.5, 0, 0))


def test_motion_below_the_dead_zone_makes_no_step() -> None:
    assert steps_of(np.random.default_rng(0).uniform(-0.04, 0.04, (1000, 3)), 0.2) == []


@pytest.mark.parametrize("bad", [(np.nan, 0, 0), (0, np.inf, 0), (0, 0), (0, 0, 0, 0)])
def test_a_position_that_is_none_is_refused_and_changes_nothing(bad: tuple[float, ...]) -> None:
    zone = DeadZone(0.01)
    zone.push((0, 0, 0))
    with pytest.raises(ValueError, match="3 finite numbers"):
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


# --- orientation, wrench and mark -----------------------------------------------------------------


def ends_of(motion: np.ndarray, steps: list[Step]) -> list[int]:
    """The samples that end each step of a motion that is nowhere twice."""
    return [int(np.abs(motion - s.position - s.displacement).max(axis=1).argmin()) for s in steps]


@pytest.fixture
def felt() -> Demonstration:
    """A hand that turns, pushes and goes on with another part at sample 40."""
    rng = np.random.default_rng(1)
    angle = np.linspace(0, 3, 100)
    axis = np.array([[0.6, 0.0, 0.8]])
    return Demonstration(
        "felt",
        np.arange(100) / 100,
        np.cumsum(rng.uniform(0, 0.01, (100, 3)), axis=0),
        ("reach",) * 40 + ("press",) * 60,
        np.hstack([np.sin(angle)[:, None] * axis, np.cos(angle)[:, None]]),
        rng.normal(size=(100, 6)),
    )


def test_a_step_tells_the_orientation_it_ends_with_and_the_mean_wrench_of_its_samples(
    felt: Demonstration,
) -> None:
    assert felt.orientations is not None
    assert felt.wrenches is not None
    steps = steps_of_demonstration(felt, 0.03)
    assert len(steps) > 10
    begin = 0
    for step, end in zip(steps, ends_of(felt.positions, steps), strict=True):
        np.testing.assert_allclose(step.orientation, felt.orientations[end], atol=1e-12)
        np.testing.assert_allclose(step.wrench, felt.wrenches[begin : end + 1].mean(axis=0))
        begin = end + 1


def test_the_sign_of_orientations_does_not_jump(felt: Demonstration) -> None:
    assert felt.orientations is not None
    signs = np.random.default_rng(2).choice([-1.0, 1.0], (100, 1))
    jumping = felt._replace(orientations=signs * felt.orientations)
    quaternions = [step.orientation for step in steps_of_demonstration(jumping, 0.03)]
    for before, after in itertools.pairwise(quaternions):
        assert before @ after > 0
    known = [step.orientation for step in steps_of_demonstration(felt, 0.03)]
    np.testing.assert_allclose(np.abs(np.sum(np.multiply(known, quaternions), axis=1)), 1)


@given(
    st.integers(1, 20).flatmap(lambda n: arrays(float, (n, 4), elements=st.floats(0.1, 1))),
    st.integers(0, 2**32 - 1),
)
def test_continuous_quaternions_are_the_same_rotations_without_jumps(
    quaternions: np.ndarray, seed: int
) -> None:
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], (len(quaternions), 1))
    smooth = continuous(signs * quaternions)
    np.testing.assert_array_equal(np.abs(smooth), np.abs(quaternions))
    np.testing.assert_array_equal(smooth, signs[0] * quaternions)


def test_a_motion_without_further_senses_has_none_in_its_steps() -> None:
    for step in steps_of(np.arange(30.0).reshape(10, 3), 0.1):
        assert step.orientation is None
        assert step.wrench is None
        assert not step.mark


def test_marks_stand_on_the_steps_in_which_a_label_begins(felt: Demonstration) -> None:
    steps = steps_of_demonstration(felt, 0.03, mark_switches=True)
    begins = [0, *ends_of(felt.positions, steps)[:-1]]
    holding = max(t for t, begin in enumerate(begins) if begin <= 40)
    assert [step.index for step in steps if step.mark] == [0, holding]
    assert not any(step.mark for step in steps_of_demonstration(felt, 0.03))


def along_x(count: int) -> np.ndarray:
    """Samples each of which ends a step."""
    return np.outer(np.arange(count), (1.0, 0, 0))


def test_a_pedal_that_goes_down_where_a_step_ends_marks_the_one_that_begins_there() -> None:
    steps = steps_of(along_x(6), 0.5, pedals=[False, False, True, True, False, True])
    assert [step.index for step in steps if step.mark] == [2]
    steps = steps_of(along_x(6), 0.5, pedals=[True, False, True, False, True, False])
    assert [step.index for step in steps if step.mark] == [0, 2, 4]


def test_a_pedal_that_goes_down_while_the_hand_is_lifted_marks_the_next_step() -> None:
    zone = DeadZone(0.5)
    zone.lift(pedal=False)
    assert zone.push((0, 0, 0)) is None
    zone.lift(pedal=True)
    zone.lift(pedal=False)
    assert zone.push((9, 0, 0)) is None
    made = [zone.push((9 + k, 0, 0), pedal=False) for k in (1, 2)]
    assert [step.mark for step in made if step is not None] == [True, False]


def test_a_pedal_held_down_through_a_lift_marks_once() -> None:
    zone = DeadZone(0.5)
    zone.push((0, 0, 0), pedal=True)
    zone.lift(pedal=True)
    zone.push((5, 0, 0), pedal=True)
    made = [zone.push((5 + k, 0, 0), pedal=True) for k in (1, 2)]
    assert [step.mark for step in made if step is not None] == [True, False]


BAD_SENSES = [
    ({"orientation": (0, 0, 0, 1.1)}, "unit quaternion"),
    ({"orientation": (0, 0, 0, 0)}, "unit quaternion"),
    ({"orientation": (0, 0, 1)}, "unit quaternion"),
    ({"orientation": (0, 0, np.nan, 1)}, "unit quaternion"),
    ({"wrench": (0, 0, 0)}, "6 finite numbers"),
    ({"wrench": (0, 0, 0, 0, 0, np.inf)}, "6 finite numbers"),
]


@pytest.mark.parametrize(("bad", "said"), BAD_SENSES)
def test_a_sense_that_is_none_is_refused_and_changes_nothing(
    bad: dict[str, tuple[float, ...]], said: str
) -> None:
    refusing, other = DeadZone(0.5), DeadZone(0.5)
    good = {"orientation": (0, 0, 0, 1), "wrench": np.ones(6)}
    for x_m in (0.0, 0.4, 0.8):
        with pytest.raises(ValueError, match=said):
            refusing.push((x_m + 0.2, 0, 0), **{**good, **bad}, pedal=True)
        one, same = (zone.push((x_m, 0, 0), **good) for zone in (refusing, other))
    assert one is not None
    assert same is not None
    assert not one.mark
    for name in Step._fields:
        np.testing.assert_array_equal(getattr(one, name), getattr(same, name))


def test_rounding_in_a_quaternion_is_undone() -> None:
    assert np.linalg.norm(unit_quaternion((0, 0.6, 0, 0.8005))) == pytest.approx(1, abs=1e-15)


def test_as_many_samples_of_every_sense_are_needed() -> None:
    with pytest.raises(ValueError, match="shorter"):
        steps_of(along_x(6), 0.5, wrenches=np.zeros((5, 6)))


def test_changing_a_wrench_afterwards_does_not_change_a_step() -> None:
    wrench = np.ones(6)
    zone = DeadZone(0.5)
    zone.push((0, 0, 0), wrench=wrench)
    wrench[:] = 3
    step = zone.push((1, 0, 0), wrench=wrench)
    assert step is not None
    np.testing.assert_array_equal(step.wrench, np.full(6, 2.0))
