"""Evaluation and decoding of hidden Markov models (thesis 2.1.2), in logarithms and scaled.

Shapes: N states, T observations. A structural zero is a probability of exactly zero (log −inf).
`log_emission` is log P(o_t | state i), shape (T, N), T ≥ 1. The rows of a transition matrix may
sum to less than one: what is missing is the probability of leaving the model. All take O(N²T).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs.recognition.hmm.log_transitions import LogTransitions, log_of, log_sum

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
    ways = LogTransitions(transition)
    log_alpha = np.empty_like(log_emission)
    log_alpha[0] = log_of(initial) + log_emission[0]
    for t in range(1, len(log_emission)):
        log_alpha[t] = ways.ahead(log_alpha[t - 1]) + log_emission[t]
    return log_alpha


def backward(transition: Array, log_emission: Array) -> Array:
    """Return log β, shape (T, N): log P(o_{t+1}..o_T | state i at t)."""
    ways = LogTransitions(transition)
    log_beta = np.zeros_like(log_emission)
    for t in range(len(log_emission) - 2, -1, -1):
        log_beta[t] = ways.back(log_emission[t + 1] + log_beta[t + 1])
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
        possible = beta[t + 1] > 0
        shifted = log_emission[t + 1] - log_emission[t + 1].max(initial=-np.inf, where=possible)
        ahead = beta[t + 1] * np.exp(np.where(possible, shifted, 0.0))
        beta[t] *= transition @ ahead
        # The same as the scales, but exact where likelihoods are large numbers.
        total = float(scaled.states[t] @ beta[t])
        beta[t] /= total if total > 0 else 1.0
    return beta


def log_likelihood(initial: Array, transition: Array, log_emission: Array) -> float:
    """Return log P(o_1..o_T) (2.7); −inf for an impossible sequence."""
    try:
        passed = _log_filtered(initial, LogTransitions(transition), log_emission)
    except ImpossibleSequenceError:
        return -np.inf
    return float(passed.log_scales.sum())


def smooth(initial: Array, transition: Array, log_emission: Array) -> Smoothed:
    """Return γ and the sum of ξ (2.11–2.12), given the whole sequence.

    Each step is scaled by itself, so that probabilities sum to one however improbable what is
    observed. Raises ImpossibleSequenceError when the sequence has no probability under the model.
    """
    ways = LogTransitions(transition)
    log_alpha, log_scales, tops = _log_filtered(initial, ways, log_emission)
    reachable = np.isfinite(log_alpha)
    # What is shown to the step before: log P(o_t, …, o_T | state at t), but for a factor.
    log_next = np.where(reachable, log_emission - tops[:, None], -np.inf)
    log_beta = np.zeros_like(log_alpha)
    log_totals = np.zeros(len(log_alpha))
    for t in range(len(log_alpha) - 2, -1, -1):
        log_next[t + 1] += log_beta[t + 1]
        back = ways.back(log_next[t + 1])
        scale = float(back.max(initial=-np.inf, where=reachable[t]))
        log_beta[t] = back - scale
        log_totals[t] = scale + float(log_sum(log_alpha[t] + log_beta[t], axis=0))
    states = log_alpha + log_beta
    states = np.exp(states - states.max(axis=1, keepdims=True))
    return Smoothed(
        states / states.sum(axis=1, keepdims=True),
        ways.summed(log_alpha[:-1] - log_totals[:-1, None], log_next[1:]),
        float(log_scales.sum()),
    )


class _LogFiltered(NamedTuple):
    log_states: Array
    """log P(state i at t | o_1..o_t), shape (T, N)."""
    log_scales: Array
    """log P(o_t | o_1..o_{t−1}), shape (T,)."""
    tops: Array
    """Largest log P(o_t | state) of the states that can be reached, shape (T,)."""


def _log_filtered(initial: Array, ways: LogTransitions, log_emission: Array) -> _LogFiltered:
    """Filter in logarithms, each step by its own scale; raises ImpossibleSequenceError."""
    log_states = np.empty_like(log_emission)
    log_scales, tops = np.empty((2, len(log_emission)))
    predicted = log_of(initial)
    for t, emission in enumerate(log_emission):
        top = float(emission.max(initial=-np.inf, where=np.isfinite(predicted)))
        if not np.isfinite(top):
            raise _impossible(log_emission, t)
        # Far from all states the likelihoods are large numbers, and their differences tell.
        joint = predicted + (emission - top)
        scale = float(log_sum(joint, axis=0))
        log_states[t] = joint - scale
        log_scales[t], tops[t] = scale + top, top
        predicted = ways.ahead(log_states[t])
    return _LogFiltered(log_states, log_scales, tops)


def shortest_path(initial: Array, transition: Array, log_emission: Array) -> Decoded:
    """Return the path of least cost −ln P(path, observations) (Viterbi; δ, ψ, P* of 2.1.2).

    Of paths of equal cost the one through states of smaller index wins, from the end backward.
    Raises ImpossibleSequenceError when the sequence has no probability under the model.
    """
    transition_cost = -log_of(transition)
    costs = np.empty_like(log_emission)
    predecessors = np.zeros(log_emission.shape, dtype=np.int64)
    least = np.empty((len(log_emission), 1))
    reached = -log_of(initial)
    for t, emission in enumerate(log_emission):
        if t:
            ways = costs[t - 1][:, None] + transition_cost
            predecessors[t] = ways.argmin(axis=0)
            reached = ways.min(axis=0)
        costs[t] = reached - emission
        least[t] = costs[t].min()
        if not np.isfinite(least[t]):
            raise _impossible(log_emission, t)
        # What all paths have in common is added last: beside it the differences would be lost.
        costs[t] -= least[t]
    path = np.empty(len(log_emission), dtype=np.int64)
    path[-1] = costs[-1].argmin()
    for t in range(len(log_emission) - 1, 0, -1):
        path[t - 1] = predecessors[t, path[t]]
    costs += least.cumsum(axis=0)
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
