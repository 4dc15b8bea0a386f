from __future__ import annotations

import numpy as np
import pytest

from hmcs.motion.steps import Step
from hmcs_baselines.observing import (
    ObservationSettings,
    Observed,
    Observer,
    Observing,
    learn_observing,
    observations,
)
from hmcs_baselines.symbols import Codebook

AXES = (0, 1)


def steps_toward(angles: np.ndarray) -> list[Step]:
    moves = 0.01 * np.stack([np.cos(angles), np.sin(angles), 0.5 + 0 * angles], axis=1)
    ends = np.cumsum(moves, axis=0)
    return [
        Step(k, end - move, move) for k, (end, move) in enumerate(zip(ends, moves, strict=True))
    ]


def some_steps(seed: int, count: int = 40) -> list[Step]:
    return steps_toward(np.random.default_rng(seed).uniform(0, 2 * np.pi, count))


def learned(
    observed: Observed, settings: ObservationSettings | None = None
) -> tuple[list[Step], Observing]:
    steps = some_steps(0)
    observing = learn_observing(
        [steps], AXES, observed, settings or ObservationSettings(), np.random.default_rng(0)
    )
    return steps, observing


def test_a_direction_is_a_unit_vector_on_the_axes_looked_at() -> None:
    steps, observing = learned("direction")
    seen = observations(steps, observing, AXES)
    np.testing.assert_allclose(np.linalg.norm(seen, axis=1), 1.0)
    np.testing.assert_allclose(
        seen[:, 0] * [s.displacement[1] for s in steps],
        seen[:, 1] * [s.displacement[0] for s in steps],
    )


def test_a_step_along_none_of_the_axes_has_no_direction() -> None:
    _, observing = learned("direction")
    up = Step(0, np.zeros(3), np.array([0.0, 0.0, 0.01]))
    np.testing.assert_array_equal(Observer(observing, AXES).step(up), [0.0, 0.0])


def test_od_symbols_are_the_nearest_centers() -> None:
    steps, observing = learned("od", ObservationSettings(symbols=6))
    _, plain = learned("direction")
    assert isinstance(observing.encoding, Codebook)
    assert observing.symbols == 6
    directions = observations(steps, plain, AXES)
    apart = np.linalg.norm(directions[:, None] - observing.encoding.centers, axis=2)
    np.testing.assert_array_equal(observations(steps, observing, AXES)[:, 0], apart.argmin(axis=1))


def test_there_are_no_more_symbols_than_different_directions() -> None:
    steps = steps_toward(np.repeat([0.0, np.pi / 2], 10))
    observing = learn_observing(
        [steps], AXES, "od", ObservationSettings(), np.random.default_rng(0)
    )
    assert observing.symbols == 2


@pytest.mark.parametrize("observed", ["od", "md", "fft", "fourier", "direction"])
def test_motion_that_never_turns_can_be_observed(observed: Observed) -> None:
    steps = steps_toward(np.zeros(2))
    observing = learn_observing(
        [steps], AXES, observed, ObservationSettings(), np.random.default_rng(0)
    )
    assert np.isfinite(observations(steps, observing, AXES)).all()


def test_md_bins_are_equal_parts_from_minus_one_to_one() -> None:
    _, observing = learned("md")
    east, north_west = steps_toward(np.array([0.0, 0.75 * np.pi]))
    observer = Observer(observing, AXES)
    # cos 135° = −0.707: the second bin of width 0.2; 0.707: the ninth.
    np.testing.assert_array_equal(observer.step(east), [9, 5])
    np.testing.assert_array_equal(observer.step(north_west), [1, 8])


def test_windows_overlap_by_half_and_are_full_from_the_first_step_on() -> None:
    steps, observing = learned("fft")
    observer = Observer(observing, AXES)
    seen = [observer.step(step) is not None for step in steps[:8]]
    assert seen == [True, False, False, True, False, False, True, False]


def test_what_begins_afresh_has_forgotten_what_was_before() -> None:
    steps, observing = learned("fft")
    observer = Observer(observing, AXES)
    for step in steps[:8]:
        observer.step(step)
    resumed = [observer.step(step, afresh=k == 0) for k, step in enumerate(steps[8:20])]
    expected = observations(steps[8:20], observing, AXES)
    np.testing.assert_array_equal([o for o in resumed if o is not None], expected)
