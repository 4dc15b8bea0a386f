"""The shrunk covariance is scikit-learn's, and discriminants are Gaussians that share it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs_laboratory.single_gestemes.shrinkage import (
    Discriminants,
    class_means,
    ledoit_wolf,
    shared_covariance,
)

covariance_module = pytest.importorskip("sklearn.covariance")


@settings(max_examples=50)
@given(st.integers(0, 10_000), st.integers(2, 60), st.integers(1, 8))
def test_the_shrunk_covariance_agrees_with_scikit_learn(seed: int, n: int, features: int) -> None:
    rng = np.random.default_rng(seed)
    vectors = rng.normal(size=(n, features)) * rng.uniform(0.1, 3.0, features)
    theirs, shrinkage = covariance_module.ledoit_wolf(vectors, assume_centered=True)
    ours = ledoit_wolf(vectors)
    np.testing.assert_allclose(ours.covariance, theirs, atol=1e-12)
    assert ours.shrinkage == pytest.approx(shrinkage, abs=1e-12)


def test_few_examples_are_shrunk_and_many_are_not() -> None:
    rng = np.random.default_rng(0)
    spread = np.array([1.0, 2.0, 3.0])
    assert ledoit_wolf(rng.normal(size=(5, 3)) * spread).shrinkage > 0.2
    assert ledoit_wolf(rng.normal(size=(50_000, 3)) * spread).shrinkage < 0.01


def test_the_covariance_about_the_means_of_classes_is_found_whatever_the_units() -> None:
    rng = np.random.default_rng(1)
    truth = np.array([[1.0, 0.6], [0.6, 2.0]])
    classes = np.repeat([0, 1, 2], 4_000)
    means = np.array([[0.0, 0.0], [50.0, 5.0], [-9.0, 70.0]])
    vectors = means[classes] + rng.multivariate_normal([0, 0], truth, len(classes))
    for units in (np.array([1.0, 1.0]), np.array([1e3, 1e-3])):
        found = shared_covariance(vectors * units, classes)
        assert found is not None
        np.testing.assert_allclose(found / np.outer(units, units), truth, atol=0.08)
    np.testing.assert_allclose(class_means(vectors, classes), means, atol=0.1)


def test_where_nothing_varies_there_is_no_covariance() -> None:
    assert shared_covariance(np.ones((4, 2)), np.array([0, 0, 1, 1])) is None


def test_scores_are_log_densities_but_for_what_classes_share() -> None:
    rng = np.random.default_rng(2)
    covariance = np.array([[2.0, 0.3], [0.3, 1.0]])
    known = Discriminants(rng.normal(size=(3, 2)), np.linalg.inv(covariance))
    vectors = rng.normal(size=(5, 2))
    apart = vectors[:, None] - known.means
    exact = np.exp(-0.5 * (apart @ np.linalg.inv(covariance) * apart).sum(axis=2))
    np.testing.assert_allclose(np.exp(known.scores(vectors)), exact)
