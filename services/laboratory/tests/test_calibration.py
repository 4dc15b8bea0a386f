"""Calibration: against its definition term by term, and on sources whose error is known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs_laboratory.calibration import (
    all_classes_error,
    brier_score,
    event_reliability,
    reliability,
)


def calibrated(seed, count, classes=4, sharpness=0.5):
    """Probabilities, and classes that come true with just these."""
    rng = np.random.default_rng(seed)
    said = rng.dirichlet([sharpness] * classes, count)
    true = (rng.random((count, 1)) > said.cumsum(axis=1)).sum(axis=1)
    return said, np.minimum(true, classes - 1)


def test_a_calibrated_source_has_almost_no_error():
    said, true = calibrated(0, 100_000)
    assert reliability(said, true).error < 0.01
    assert all_classes_error(said, true) < 0.005


@pytest.mark.parametrize(("said", "share"), [(0.9, 0.5), (0.99, 0.8), (0.6, 0.9)])
def test_the_error_of_a_source_that_says_always_the_same_is_the_gap(said, share):
    right = np.arange(1000) < 1000 * share
    probabilities = np.tile([said, 1 - said], (1000, 1))
    found = reliability(probabilities, np.where(right, 0, 1))
    assert found.error == pytest.approx(abs(said - share))
    (filled,) = np.flatnonzero(found.counts)
    assert found.came_true[filled] == pytest.approx(share)
    assert np.isnan(found.said[found.counts == 0]).all()


def test_overconfidence_has_its_known_error():
    """Halved distances from certainty: said 1 − (1 − p) / 2 where p would have been right."""
    rng = np.random.default_rng(1)
    p = rng.uniform(0.5, 1.0, 200_000)
    said = 1 - (1 - p) / 2
    assert event_reliability(said, rng.random(len(p)) < p).error == pytest.approx(0.125, abs=0.004)


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6), bins=st.integers(1, 20))
def test_bins_are_what_their_definition_says(seed, bins):
    said, true = calibrated(seed, 60)
    best = said.argmax(axis=1)
    found = reliability(said, true, bins)
    error = 0.0
    for b in range(bins):
        own = [i for i in range(60) if b / bins < said[i, best[i]] <= (b + 1) / bins]
        assert found.counts[b] == len(own)
        if own:
            mean = np.mean([said[i, best[i]] for i in own])
            share = np.mean([best[i] == true[i] for i in own])
            assert found.said[b] == pytest.approx(mean)
            assert found.came_true[b] == pytest.approx(share)
            error += len(own) / 60 * abs(mean - share)
    assert found.error == pytest.approx(error)


def test_certainty_and_impossibility_have_bins_too():
    found = event_reliability([0.0, 1.0, 1.0], [False, True, True], 4)
    assert found.counts.tolist() == [1, 0, 0, 2]
    assert found.error == 0


@settings(max_examples=10)
@given(seed=st.integers(0, 10**6))
def test_the_brier_score_is_least_for_the_true_probabilities(seed):
    said, true = calibrated(seed, 4000)
    sure = np.eye(4)[said.argmax(axis=1)]
    assert 0 <= brier_score(said, true) < brier_score(sure, true)
    assert brier_score(np.eye(4)[true], true) == 0
    assert brier_score(sure, true) == pytest.approx(2 * np.mean(said.argmax(axis=1) != true))


def test_probability_of_no_class_counts_as_said():
    """Half of the belief lies outside the classes, though the first is always true."""
    assert reliability([[0.5, 0.0]] * 10, [0] * 10).error == pytest.approx(0.5)
    assert all_classes_error([[0.5, 0.0]] * 10, [0] * 10) == pytest.approx(0.25)


@pytest.mark.parametrize(
    ("probabilities", "true", "says"),
    [
        (np.zeros((0, 3)), [], "empty"),
        ([[0.5, 0.5]], [0, 1], "shape"),
        ([0.5], [0], "shape"),
        ([[0.5, 0.5]], [2], "true classes"),
        ([[0.5, 0.5]], [-1], "leave out"),
        ([[1.5, 0.5]], [0], "between 0 and 1"),
        ([[np.nan, 0.5]], [0], "between 0 and 1"),
    ],
)
def test_what_are_no_probabilities_is_refused(probabilities, true, says):
    for function in (reliability, all_classes_error, brier_score):
        with pytest.raises(ValueError, match=says):
            function(probabilities, true)


def test_events_need_outcomes_and_bins():
    with pytest.raises(ValueError, match="outcomes"):
        event_reliability([0.5], [True, False])
    with pytest.raises(ValueError, match="bins"):
        event_reliability([0.5], [True], 0)
