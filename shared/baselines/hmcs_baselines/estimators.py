"""What tells classes apart step by step: support vectors as in the text (3.1.3), or Gaussians.

An estimator gives an HMM P(x | class), up to a factor that is the same for all classes.
Shapes: T observations x of F dimensions, K classes.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.recognition.checking import (
    LARGEST,
    LEAST_SPREAD,
    check_shapes,
    check_spreads,
    check_within,
)
from hmcs.recognition.hmm.emissions import log_gaussians
from hmcs_baselines.svm import Machines, SvmSettings, fit_machines, log_observations

Integers = NDArray[np.intp]

LEAST_WIDTH = 1e-9
"""A kernel narrower, or a sigmoid flatter than this, tells nothing apart; its square is a number
that can still be divided by."""


class EstimatorSettings(NamedTuple):
    """How classes are distinguished."""

    kind: Literal["gaussian", "svm"] = "gaussian"
    """Gaussians of one variance, or a support vector machine for each class against all others."""
    least_ratio: float = 0.1
    """Added to the likelihood of every class, as a share of the likeliest one: a single observation
    that errs then changes little. 0 for the text, which has no such floor."""
    least_spread: float = 0.05
    """Least standard deviation of the Gaussians."""
    svm: SvmSettings = SvmSettings(rbf_width=1.0, sigmoid_slope=2.0)
    """Of the support vectors; sharper than the text's."""


class Gaussians(NamedTuple):
    """One Gaussian about the mean of each class."""

    means: Array
    """Shape (K, F)."""
    variance: float
    """Of each dimension."""
    least_ratio: float


class SupportVectors(NamedTuple):
    """One support vector machine for each class against all others."""

    machines: Machines
    least_ratio: float


Estimator = SupportVectors | Gaussians


def learn_estimator(
    observations: Array, classes: Integers, means: Array, settings: EstimatorSettings
) -> Estimator:
    """Return what tells classes apart.

    From observations (T, F), the class of each, (T,), and the mean of each class, (K, F). A single
    class has no others that a machine could tell it from, and gets a Gaussian.
    Raises SvmError for a class without observations, LearningMissingError without scikit-learn.
    """
    if settings.kind == "svm" and len(means) > 1:
        return SupportVectors(
            fit_machines(observations, classes, settings.svm), settings.least_ratio
        )
    variance = float(((observations - means[classes]) ** 2).mean())
    return Gaussians(means, max(variance, settings.least_spread**2), settings.least_ratio)


def likelihoods(estimator: Estimator, observations: Array) -> Array:
    """Return P(x | class), shape (T, K), up to a factor for each observation: rows sum to one."""
    if isinstance(estimator, Gaussians):
        variances = np.full_like(estimator.means, estimator.variance)
        log = log_gaussians(estimator.means, variances, observations)
    else:
        log = log_observations(estimator.machines, observations)
    rows = np.exp(log - log.max(axis=1, keepdims=True)) + estimator.least_ratio
    return np.asarray(rows / rows.sum(axis=1, keepdims=True))


def class_means(observations: Array, classes: Integers, count: int) -> Array:
    """Return the mean of each class, (K, F), from observations (T, F) and their classes, (T,)."""
    return np.array([observations[classes == k].mean(axis=0) for k in range(count)])


def check_estimator(estimator: Estimator, count: int, dimensions: int) -> None:
    """Raise ValueError where it is not an estimator of so many classes and dimensions."""
    check_within("least_ratio", estimator.least_ratio, 0.0, 1.0)
    if isinstance(estimator, Gaussians):
        check_shapes(estimator._asdict(), {"means": (count, dimensions)})
        check_within("means", estimator.means, -LARGEST, LARGEST)
        check_spreads("variance", estimator.variance)
        return
    machines = estimator.machines
    vectors = len(machines.vectors) if machines.vectors.ndim else 0
    check_shapes(
        machines._asdict(),
        {
            "vectors": (vectors, dimensions),
            "dual": (count, vectors),
            "intercepts": (count,),
            "priors": (count,),
        },
    )
    for name in ("vectors", "dual", "intercepts"):
        check_within(name, getattr(machines, name), -LARGEST, LARGEST)
    check_within("priors", machines.priors, LEAST_SPREAD, 1.0)
    check_within("rbf_width", machines.rbf_width, LEAST_WIDTH, LARGEST)
    check_within("sigmoid_slope", machines.sigmoid_slope, LEAST_WIDTH, LARGEST)
