"""Evaluation and decoding of hidden Markov models (thesis 2.1.2), in logarithms and scaled.

Shapes: N states, T observations. A structural zero is a probability of exactly zero (log −inf).
`log_emission` is log P(o_t | state i), shape (T, N), T ≥ 1. The rows of a transition matrix may
sum to less than one: what is missing is the probability of leaving the model. All take O(N²T).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.errors import UserError

Array = NDArray[np.float64]
Path = NDArray[np.int64]

LOST = 1e-300
"""A scaled probability below this counts as zero, so that its inverse still is a double."""


class ImpossibleSequenceError(UserError, ValueError):
    """An observation sequence that the model gives no probability; names the first such step."""

    def __init__(self, message: str, step: int | None = None) -> None:
        super().__init__(message)
        self.step = step
        """The first observation that cannot follow those before it, counted from 0."""


class Smoothed(NamedTuple):
    """Posteriors over hidden states given a whole observation sequence."""

    states: Array
    """γ: P(state i at t | all observations), shape (T, N)."""
    transitions: Array
    """Σ_t ξ: expected number of transitions i to j, shape (N, N)."""
    log_likelihood: float
    """log P(observations)."""


class ScaledForward(NamedTuple):
    """The forward variable, each step divided by its sum."""

    states: Array
    """P(state i at t | o_1..o_t), shape (T, N); α is this times the product of scales up to t."""
    log_scales: Array
    """log P(o_t | o_1..o_{t−1}), shape (T,); their sum is log P(observations)."""


class Decoded(NamedTuple):
    """The most probable state path as the shortest path through a graph."""

    path: Path
    """q*, shape (T,)."""
    cost: float
    """P* = min_i δ_i(T), nats: the path and the observations have the probability exp(−cost)."""
    costs: Array
    """δ: the cost of the cheapest path that ends in state i at t, shape (T, N)."""
    predecessors: Path
    """ψ: the state before state j at t on that path, shape (T, N); 0 at the first step."""


def forward(initial: Array, transition: Array, log_emission: Array) -> Array:
    """Return log α, shape (T, N): the joint log P(o_1..o_t, state i at t) (2.5 as a joint, 2.6)."""
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


def forward_scaled(initial: Array, transition: Array, log_emission: Array) -> ScaledForward:
    """Return α as (2.6) gives it, divided by its sum at each step.

    Cheaper than `forward`, but a state whose probability falls below 1e-300 is lost from there on.
    Raises ImpossibleSequenceError when the sequence has no probability under the model.
    """
    states = np.zeros_like(log_emission)
    log_scales = np.empty(len(log_emission))
    predicted = initial
    for t, emission in enumerate(log_emission):
        predicted = np.where(predicted < LOST, 0.0, predicted)
        top = float(emission.max(initial=-np.inf, where=predicted > 0))
        if not np.isfinite(top):
            raise _impossible(log_emission, t)
        joint = predicted * np.exp(np.minimum(emission - top, 0.0))
        total = float(joint.sum())
        states[t] = np.where(joint < LOST * total, 0.0, joint / total)
        log_scales[t] = np.log(total) + top
        predicted = states[t] @ transition
    return ScaledForward(states, log_scales)


def backward_scaled(transition: Array, log_emission: Array, scaled: ScaledForward) -> Array:
    """Return β, shape (T, N), divided by the scales of all later steps.

    Times `scaled.states` it is γ. It is zero for states that the forward pass rules out.
    """
    beta = (scaled.states > 0).astype(np.float64)
    for t in range(len(log_emission) - 2, -1, -1):
        shifted = log_emission[t + 1] - scaled.log_scales[t + 1]
        ahead = beta[t + 1] * np.exp(np.where(beta[t + 1] > 0, shifted, 0.0))
        beta[t] *= transition @ ahead
    return beta


def log_likelihood(initial: Array, transition: Array, log_emission: Array) -> float:
    """Return log P(o_1..o_T) (2.7); −inf for an impossible sequence."""
    return float(_log_sum(forward(initial, transition, log_emission)[-1], axis=0))


def smooth(initial: Array, transition: Array, log_emission: Array) -> Smoothed:
    """Return γ and the sum of ξ (2.11–2.12), given the whole sequence.

    Raises ImpossibleSequenceError when the sequence has no probability under the model.
    """
    log_alpha = forward(initial, transition, log_emission)
    total = float(_log_sum(log_alpha[-1], axis=0))
    if not np.isfinite(total):
        dead = int(np.argmax(~np.isfinite(log_alpha).any(axis=1)))
        raise _impossible(log_emission, dead)
    log_beta = backward(transition, log_emission)
    log_xi = (
        log_alpha[:-1, :, None]
        + _log(transition)[None, :, :]
        + (log_emission[1:] + log_beta[1:])[:, None, :]
        - total
    )
    return Smoothed(
        np.exp(log_alpha + log_beta - total),
        np.exp(log_xi).sum(axis=0),
        total,
    )


def shortest_path(initial: Array, transition: Array, log_emission: Array) -> Decoded:
    """Return the path of least cost −ln P(path, observations) (Viterbi; δ, ψ, P* of 2.1.2).

    Of paths of equal cost the one through states of smaller index wins, from the end backward.
    Raises ImpossibleSequenceError when the sequence has no probability under the model.
    """
    transition_cost = -_log(transition)
    costs = np.empty_like(log_emission)
    predecessors = np.zeros(log_emission.shape, dtype=np.int64)
    costs[0] = -_log(initial) - log_emission[0]
    for t in range(1, len(log_emission)):
        ways = costs[t - 1][:, None] + transition_cost
        predecessors[t] = ways.argmin(axis=0)
        costs[t] = ways.min(axis=0) - log_emission[t]
    dead = ~np.isfinite(costs).any(axis=1)
    if dead.any():
        raise _impossible(log_emission, int(dead.argmax()))
    path = np.empty(len(log_emission), dtype=np.int64)
    path[-1] = costs[-1].argmin()
    for t in range(len(log_emission) - 1, 0, -1):
        path[t - 1] = predecessors[t, path[t]]
    return Decoded(path, float(costs[-1].min()), costs, predecessors)


def viterbi(initial: Array, transition: Array, log_emission: Array) -> tuple[Path, float]:
    """Return the most probable state path, shape (T,), and its joint log probability, nats.

    Raises ImpossibleSequenceError when the sequence has no probability under the model.
    """
    decoded = shortest_path(initial, transition, log_emission)
    return decoded.path, -decoded.cost


def _impossible(log_emission: Array, step: int) -> ImpossibleSequenceError:
    if not np.isfinite(log_emission[step]).any():
        why = "no state gives it any probability: give the emissions a floor"
    else:
        possible = np.flatnonzero(np.isfinite(log_emission[step]))
        why = (
            f"states that explain it ({', '.join(map(str, possible[:5]))}"
            f"{', …' if len(possible) > 5 else ''}) cannot be reached there: check the zeros of "
            "the initial and transition probabilities, or give the emissions a floor"
        )
    return ImpossibleSequenceError(
        f"the sequence is impossible under the model from its observation {step} on; {why}", step
    )


def _log(probabilities: Array) -> Array:
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(probabilities))


def _log_sum(values: Array, axis: int) -> Array:
    top = values.max(axis=axis, keepdims=True)
    safe = np.where(np.isfinite(top), top, 0.0)
    with np.errstate(divide="ignore"):
        total = np.log(np.exp(values - safe).sum(axis=axis, keepdims=True)) + safe
    return np.asarray(total.squeeze(axis=axis))
