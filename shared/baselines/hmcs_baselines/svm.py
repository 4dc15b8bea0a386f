"""Support vector machines as probability estimators of a task's states (thesis 2.1.4, 3.1.3).

One machine for each state tells it from all others; what lies how far on which side of its margin
becomes a probability. Fitting takes scikit-learn; fitted machines are arrays that numpy evaluates.
Shapes: n samples, F features, K states, V support vectors of all machines.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hmcs.arrays import Array
from hmcs.errors import UserError


class SvmError(UserError):
    """Data that machines cannot be fitted to or evaluated on; says why, and what to do."""


class LearningMissingError(UserError):
    """scikit-learn is not installed."""


class SvmSettings(NamedTuple):
    """The choices of chapter 3."""

    rbf_width: float = 2.0
    """σ of the kernel exp(−|x − x′|² / 2σ²)."""
    slack_penalty: float = 1.0
    """C: what a training sample on the wrong side of the margin costs; not given in the thesis."""
    sigmoid_slope: float = 0.5
    """σ of the sigmoid in (3.2)."""


class Machines(NamedTuple):
    """One machine for each state, one-vs-all: plain arrays, to be stored as such."""

    vectors: Array
    """Training samples that support at least one machine, shape (V, F)."""
    dual: Array
    """α_i·y_i of each vector in each machine, zero where it does not support it, shape (K, V)."""
    intercepts: Array
    """b, shape (K,)."""
    rbf_width: float
    """σ of the kernel."""
    sigmoid_slope: float
    """σ of the sigmoid."""
    priors: Array
    """Share of each state in the training samples, shape (K,)."""


def fit_machines(
    samples: ArrayLike,
    labels: ArrayLike,
    settings: SvmSettings = SvmSettings(),  # noqa: B008  frozen
) -> Machines:
    """Return the machines of samples (n, F), labeled with their states 0..K−1, shape (n,).

    Raises SvmError when samples and labels do not fit together, a value is not finite, or there
    are fewer than two states or a state without samples; LearningMissingError without
    scikit-learn; ValueError for settings that are not positive.
    """
    if min(settings) <= 0:
        raise ValueError(f"{settings}: expected positive numbers")
    seen, states = _checked(samples, None), np.asarray(labels)
    if states.shape != (len(seen),) or not np.issubdtype(states.dtype, np.integer):
        raise SvmError(
            f"{len(seen)} samples with labels of shape {states.shape} and type {states.dtype}: "
            "give one whole number for each"
        )
    if not len(states) or states.min() < 0:
        raise SvmError("no samples, or a label below 0: label samples with states 0, 1, …")
    sizes = np.bincount(states)
    if len(sizes) < 2 or not sizes.all():
        raise SvmError(
            f"states have {', '.join(map(str, sizes))} samples: there must be two states at least, "
            "and a sample of each"
        )
    try:
        from sklearn.svm import SVC
    except ImportError as error:
        raise LearningMissingError(
            "support vector machines are fitted by scikit-learn, which is not installed: "
            "install hmcs-baselines[learning]"
        ) from error
    dual = np.zeros((len(sizes), len(seen)))
    intercepts = np.zeros(len(sizes))
    for k in range(len(sizes)):
        machine = SVC(
            C=settings.slack_penalty, kernel="rbf", gamma=_precision(settings.rbf_width)
        ).fit(seen, np.where(states == k, 1, -1))
        dual[k, machine.support_] = machine.dual_coef_[0]
        intercepts[k] = machine.intercept_[0]
    support = dual.any(axis=0)
    return Machines(
        seen[support],
        dual[:, support],
        intercepts,
        settings.rbf_width,
        settings.sigmoid_slope,
        sizes / len(seen),
    )


def decisions(machines: Machines, samples: ArrayLike) -> Array:
    """Return f_k(x) (3.1) of samples (n, F), shape (n, K): positive on the state's side.

    Raises SvmError when samples have other features or are not finite.
    """
    seen = _checked(samples, machines.vectors.shape[1])
    squared = np.zeros((len(seen), len(machines.vectors)))
    for feature in range(seen.shape[1]):
        squared += (seen[:, feature, None] - machines.vectors[None, :, feature]) ** 2
    kernel = np.exp(-_precision(machines.rbf_width) * squared)
    return np.asarray(kernel @ machines.dual.T + machines.intercepts)


def log_product_rule(decision: ArrayLike, sigmoid_slope: float) -> Array:
    """Return log P(state | x) of decisions f_k(x), shape (…, K), by (3.2), normalized.

    g_k · Π_{j≠k} (1 − g_j) with the sigmoid g is proportional to g_k / (1 − g_k) = exp(σ·f_k), so
    nothing is lost to underflow however sure the machines are.
    """
    exponent = sigmoid_slope * np.asarray(decision, dtype=float)
    exponent = exponent - exponent.max(axis=-1, keepdims=True)
    return np.asarray(exponent - np.log(np.exp(exponent).sum(axis=-1, keepdims=True)))


def state_probabilities(machines: Machines, samples: ArrayLike) -> Array:
    """Return P(state | x) of samples (n, F), shape (n, K). Raises as `decisions`."""
    return np.exp(log_product_rule(decisions(machines, samples), machines.sigmoid_slope))


def log_observations(machines: Machines, samples: ArrayLike) -> Array:
    """Return log P(x | state) up to a term of x alone, shape (n, K): Bayes' inversion.

    P(x | state) ∝ P(state | x) / P(state). Raises as `decisions`.
    """
    log_probability = log_product_rule(decisions(machines, samples), machines.sigmoid_slope)
    return np.asarray(log_probability - np.log(machines.priors))


def _precision(width: float) -> float:
    """γ of exp(−γ·|x − x′|²)."""
    return 1.0 / (2.0 * width**2)


def _checked(samples: ArrayLike, features: int | None) -> Array:
    seen = np.asarray(samples, dtype=float)
    if seen.ndim != 2 or (features is not None and seen.shape[1] != features):
        wanted = "(n, F)" if features is None else f"(n, {features})"
        raise SvmError(f"samples have shape {seen.shape}: give them as {wanted}")
    finite = np.isfinite(seen).all(axis=1)
    if not finite.all():
        raise SvmError(f"sample {int((~finite).argmax())} is not finite: leave it out or mend it")
    return seen
