from __future__ import annotations

from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.motion.operators import Operator, follow, joined
from hmcs.recognition.hmm import inference
from hmcs.recognition.hmm.topologies import fully_connected
from hmcs.recognition.serialization import from_arrays, to_arrays
from hmcs_baselines.direction_states import (
    DirectionFilter,
    DirectionStates,
    DirectionStateSettings,
    check_direction_states,
    counted_chain,
    learn_directions,
    thesis_settings,
)
from hmcs_baselines.directions import DirectionError
from hmcs_baselines.estimators import likelihoods

NOMINAL = np.array([[1.0, 0, 0], [0, 0.6, 0.8], [0, -1.0, 0], [-0.6, 0, 0.8]])
ORDER = (2, 0, 1, 3)
"""As in the example of 3.1.5, where the states 3, 1, 2, 4 follow one another."""


def performed(seed: int, noise: float = 0.15) -> tuple[Array, NDArray[Any]]:
    """Steps along lines one meter long, and the line of each."""
    reference, owners = joined([np.outer([0.0, 1.0], NOMINAL[k]) for k in ORDER], 0.025)
    trace = follow(reference, Operator(noise=noise), np.random.default_rng(seed), owners)
    return np.diff(trace.positions, axis=0), np.array(ORDER)[trace.segments[:-1]]


@cache
def learned(chosen: DirectionStateSettings) -> DirectionStates:
    shown = [performed(seed) for seed in range(6)]
    rng = np.random.default_rng(0)
    return learn_directions([d for d, _ in shown], chosen, rng, [s for _, s in shown])


def filtered(known: DirectionStates, moved: Array) -> Array:
    follower = DirectionFilter(known)
    return np.array([follower.step(step) for step in moved])


DEFAULT = DirectionStateSettings()
EVERY = [
    DEFAULT,
    DEFAULT._replace(discovery="recurring-chords"),
    DEFAULT._replace(discovery="labels"),
    DEFAULT._replace(discovery="labels", chain="baum-welch"),
    DEFAULT._replace(estimator=DEFAULT.estimator._replace(kind="svm")),
    thesis_settings(),
]


@pytest.mark.parametrize("chosen", EVERY)
def test_the_nominal_directions_and_their_order_are_found(chosen: DirectionStateSettings) -> None:
    known = learned(chosen)
    nearest = (known.directions @ NOMINAL.T).argmax(axis=1)
    assert sorted(nearest) == [0, 1, 2, 3]
    angle = np.arccos(np.clip((known.directions * NOMINAL[nearest]).sum(axis=1), -1, 1))
    assert np.degrees(angle).max() < 10
    where = nearest.argsort()[list(ORDER)]
    assert known.initial.argmax() == where[0]
    for before, after in pairwise(where):
        leaving = np.where(np.arange(4) == before, 0.0, known.transition[before])
        assert leaving.argmax() == after


@pytest.mark.parametrize("discovery", ["chords", "recurring-chords", "labels"])
def test_directions_of_a_hand_without_noise_are_exact(discovery: Any) -> None:
    moved = np.repeat(NOMINAL[list(ORDER)], 20, axis=0) * 0.05
    lines = np.repeat(ORDER, 20)
    chosen = DEFAULT._replace(
        discovery=discovery, estimator=DEFAULT.estimator._replace(least_ratio=0.0)
    )
    known = learn_directions([moved] * 2, chosen, np.random.default_rng(0), [lines] * 2)
    assert len(known.directions) == 4
    np.testing.assert_allclose((known.directions @ NOMINAL.T).max(axis=1), 1.0, atol=1e-9)
    nearest = (NOMINAL @ known.directions.T).argmax(axis=1)
    np.testing.assert_array_equal(filtered(known, moved).argmax(axis=1), nearest[lines])


@pytest.mark.parametrize("chosen", EVERY)
def test_the_filter_is_the_forward_algorithm(chosen: DirectionStateSettings) -> None:
    known, (moved, _) = learned(chosen), performed(50)
    units = moved / np.linalg.norm(moved, axis=1, keepdims=True)
    log_emission = np.log(likelihoods(known.estimator, units))
    alpha = inference.forward(known.initial, known.transition, log_emission)
    expected = np.exp(alpha - np.logaddexp.reduce(alpha, axis=1)[:, None])
    np.testing.assert_allclose(filtered(known, moved), expected, atol=1e-9)


def test_a_filter_asks_for_directions_not_for_lengths() -> None:
    known, (moved, _) = learned(DEFAULT), performed(51)
    np.testing.assert_allclose(filtered(known, 3.0 * moved), filtered(known, moved), atol=1e-12)
    still = filtered(known, np.vstack([moved[:5], np.zeros((1, 3))]))
    assert np.isfinite(still).all()


def test_changes_are_reported_soon_and_surely() -> None:
    late, false, steps = [], 0, 0
    known = learned(DEFAULT)
    where = (NOMINAL @ known.directions.T).argmax(axis=1)
    for seed in range(100, 110):
        moved, lines = performed(seed)
        true, belief = where[lines], filtered(known, moved)
        changes = [*(np.flatnonzero(np.diff(true)) + 1), len(true)]
        for begin, end in pairwise(changes):
            sure = np.flatnonzero(belief[begin:end, true[begin]] > 0.95)
            late.append(sure[0] if len(sure) else end - begin)
        false += int((np.diff(belief.argmax(axis=1)) != 0).sum()) - 3
        steps += len(true)
    assert np.median(late) <= 3
    assert 1000 * false / steps < 10


def test_one_step_astray_does_not_change_the_belief() -> None:
    known = learned(DEFAULT)
    moved = np.repeat(NOMINAL[[ORDER[0]]], 20, axis=0)
    moved[10] = NOMINAL[ORDER[2]]
    belief = filtered(known, moved)
    assert (belief.argmax(axis=1) == belief[5].argmax()).all()


def test_transitions_are_counted_and_what_is_never_left_leads_anywhere() -> None:
    labels = [np.array([0, 0, 1, 1, 1, 2]), np.array([0, 0, 0, 1, 2, 2])]
    initial, transition = counted_chain(labels, 3, 0.1)
    np.testing.assert_array_equal(initial, [1, 0, 0])
    by_hand = np.array([[3 / 5, 2 / 5, 0], [0, 2 / 4, 2 / 4], [0.05, 0.05, 0.9]])
    np.testing.assert_allclose(transition, by_hand)
    np.testing.assert_array_equal(counted_chain([np.zeros(5, dtype=int)], 1, 0.1)[1], [[1.0]])


def test_baum_welch_starts_from_3_4() -> None:
    chosen = thesis_settings()._replace(iterations=0, any_direction=0.0, stay=0.6)
    known = learned(chosen)
    np.testing.assert_allclose(known.transition, fully_connected(len(known.directions), 0.6))


@settings(max_examples=20)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 4),
    st.sampled_from(["gaussian", "svm"]),
    st.sampled_from(["kmeans-cusum", "labels"]),
)
def test_tiny_data_are_survived(seed: int, steps: int, estimator: Any, discovery: Any) -> None:
    rng = np.random.default_rng(seed)
    moved = [rng.integers(-1, 2, (steps, 2)).astype(float) for _ in range(2)]
    moved[0][0] = [1.0, 0.0]
    moved[1][0] = [0.0, 1.0]
    chosen = DEFAULT._replace(
        discovery=discovery, estimator=DEFAULT.estimator._replace(kind=estimator)
    )
    labels = [np.zeros(steps, int), np.ones(steps, int)]
    try:
        known = learn_directions(moved, chosen, rng, labels)
    except DirectionError as error:
        assert "cancel out" in str(error)  # noqa: PT017  only where steps are opposite
        return
    check_direction_states(known, 2)
    belief = filtered(known, moved[0])
    np.testing.assert_allclose(belief.sum(axis=1), 1.0)


def test_labels_that_are_missing_are_asked_for() -> None:
    chosen = DEFAULT._replace(discovery="labels")
    moved, _ = performed(1)
    with pytest.raises(DirectionError, match="no labels"):
        learn_directions([moved], chosen, np.random.default_rng(0))
    with pytest.raises(DirectionError, match="no step has a label"):
        learn_directions([moved], chosen, np.random.default_rng(0), [np.full(len(moved), -1)])


@pytest.mark.parametrize("chosen", EVERY)
def test_knowledge_is_plain_data(chosen: DirectionStateSettings) -> None:
    known, (moved, _) = learned(chosen), performed(52)
    again = from_arrays(DirectionStates, to_arrays(known))
    assert type(again.estimator) is type(known.estimator)
    check_direction_states(again, 3)
    np.testing.assert_array_equal(filtered(again, moved), filtered(known, moved))
    with pytest.raises(ValueError, match="shape"):
        check_direction_states(again._replace(support=np.ones(7)), 3)
    with pytest.raises(ValueError, match="sum to one"):
        check_direction_states(again._replace(initial=2 * again.initial), 3)
