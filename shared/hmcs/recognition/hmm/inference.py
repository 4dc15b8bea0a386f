"""Evaluation and decoding of hidden Markov models (thesis 2.1.2), in logarithms.

Shapes: N states, T observations, F observation dimensions. A structural zero is a probability of
exactly zero (log −inf).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class ImpossibleSequenceError(ValueError):
    """An observation sequence that the model gives no probability; names the first such step."""


class Smoothed(NamedTuple):
    """Posteriors over hidden states given a whole observation sequence."""

    states: Array
    """γ: P(state i at t | all observations), shape (T, N)."""
    transitions: Array
    """Σ_t ξ: expected number of transitions i to j, shape (N, N)."""
    log_likelihood: float
    """log P(observations)."""


def forward(initial: Array, transition: Array, log_emission: Array) -> Array:
    """Return log α, shape (T, N): the joint log P(o_1..o_t, state i at t) (2.5 as a joint).

    `log_emission` is log P(o_t | state i), shape (T, N).
    """
    log_transition = _log(transition)
    log_alpha = np.empty_like(log_emission)
    log_alpha[0] = _log(initial) + log_emission[0]
    for t in range(1, len(log_emission)):
        log_alpha[t] = (
            _log_sum(log_alpha[t - 1][:, None] + log_transition, axis=0) + log_emission[t]
        )
    return log_alpha


def backward(transition: Array, log_emission: Array) -> Array:
    """Return log β, shape (T, N): log P(o_{t+1}..o_T | state i at t)."""
    log_transition = _log(transition)
    log_beta = np.zeros_like(log_emission)
    for t in range(len(log_emission) - 2, -1, -1):
        log_beta[t] = _log_sum(
            log_transition + (log_emission[t + 1] + log_beta[t + 1])[None, :], axis=1
        )
    return log_beta


def log_likelihood(initial: Array, transition: Array, log_emission: Array) -> float:
    """Return log P(o_1..o_T)."""
    return float(_log_sum(forward(initial, transition, log_emission)[-1], axis=0))


def smooth(initial: Array, transition: Array, log_emission: Array) -> Smoothed:
    """Return the posteriors over states and transitions given the whole sequence.

    Raises ImpossibleSequenceError when the sequence has no probability under the model.
    """
    log_alpha = forward(initial, transition, log_emission)
    log_beta = backward(transition, log_emission)
    total = float(_log_sum(log_alpha[-1], axis=0))
    if not np.isfinite(total):
        dead = int(np.argmax(~np.isfinite(log_alpha).any(axis=1)))
        raise ImpossibleSequenceError(
            f"the sequence is impossible under the model from its observation {dead} on: "
            "check structural zeros and emission floors"
        )
    log_transition = _log(transition)
    log_xi = (
        log_alpha[:-1, :, None]
        + log_transition[None, :, :]
        + (log_emission[1:] + log_beta[1:])[:, None, :]
        - total
    )
    return Smoothed(
        np.exp(log_alpha + log_beta - total),
        np.exp(log_xi).sum(axis=0),
        total,
    )


def viterbi(
    initial: Array, transition: Array, log_emission: Array
) -> tuple[NDArray[np.int64], float]:
    """Return the most probable state path, shape (T,), and its joint log probability."""
    log_transition = _log(transition)
    steps = len(log_emission)
    best = _log(initial) + log_emission[0]
    came_from = np.zeros(log_emission.shape, dtype=np.int64)
    for t in range(1, steps):
        candidates = best[:, None] + log_transition
        came_from[t] = candidates.argmax(axis=0)
        best = candidates.max(axis=0) + log_emission[t]
    path = np.empty(steps, dtype=np.int64)
    path[-1] = int(best.argmax())
    for t in range(steps - 1, 0, -1):
        path[t - 1] = came_from[t, path[t]]
    return path, float(best.max())


def _log(probabilities: Array) -> Array:
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(probabilities))


def _log_sum(values: Array, axis: int) -> Array:
    top = values.max(axis=axis, keepdims=True)
    safe = np.where(np.isfinite(top), top, 0.0)
    with np.errstate(divide="ignore"):
        total = np.log(np.exp(values - safe).sum(axis=axis, keepdims=True)) + safe
    return np.asarray(total.squeeze(axis=axis))
