"""Evaluation and decoding of hidden Markov models (thesis 2.1.2), in logarithms.

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
from hmcs.recognition.hmm.log_transitions import LogTransitions, Ways, log_of, log_sum

Path = NDArray[np.int64]


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


class LogFiltered(NamedTuple):
    """What is known of the state while observations come in."""

    log_states: Array
    """log P(state i at t | o_1..o_t), shape (T, N)."""
    log_scales: Array
    """log P(o_t | o_1..o_{t−1}), shape (T,); their sum is log P(observations)."""
    tops: Array
    """Largest log P(o_t | state) of the states that can be reached, shape (T,)."""


class LogBackward(NamedTuple):
    """What later observations tell of the state, but for a factor of each step."""

    log_states: Array
    """log P(o_{t+1}..o_T | state i at t), shape (T, N)."""
    log_next: Array
    """log P(o_t..o_T | state i at t), shape (T, N)."""
    log_totals: Array
    """log Σ_i of the state probabilities at t times both, shape (T,)."""


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
    """Return log α, shape (T, N): the joint log P(o_1..o_t, state i at t) (2.5 as a joint, 2.6).

    Raises ImpossibleSequenceError when the sequence has no probability under the model.
    """
    passed = log_filtered(initial, LogTransitions(transition), log_emission)
    return np.asarray(passed.log_states + passed.log_scales.cumsum()[:, None])


def log_filtered(initial: Array, ways: Ways, log_emission: Array) -> LogFiltered:
    """Filter in logarithms, each step by its own scale, so that no state is lost by its distance.

    Raises ImpossibleSequenceError when the sequence has no probability under the model.
    """
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
    return LogFiltered(log_states, log_scales, tops)


def log_backward(passed: LogFiltered, ways: Ways, log_emission: Array) -> LogBackward:
    """Go back from the last observation through what `log_filtered` passed."""
    log_alpha = passed.log_states
    reachable = np.isfinite(log_alpha)
    log_next = np.where(reachable, log_emission - passed.tops[:, None], -np.inf)
    log_beta = np.zeros_like(log_alpha)
    log_totals = np.zeros(len(log_alpha))
    for t in range(len(log_alpha) - 2, -1, -1):
        log_next[t + 1] += log_beta[t + 1]
        back = ways.back(log_next[t + 1])
        scale = float(back.max(initial=-np.inf, where=reachable[t]))
        log_beta[t] = back - scale
        log_totals[t] = scale + float(log_sum(log_alpha[t] + log_beta[t], axis=0))
    return LogBackward(log_beta, log_next, log_totals)


def log_likelihood(initial: Array, transition: Array, log_emission: Array) -> float:
    """Return log P(o_1..o_T) (2.7); −inf for an impossible sequence."""
    try:
        passed = log_filtered(initial, LogTransitions(transition), log_emission)
    except ImpossibleSequenceError:
        return -np.inf
    return float(passed.log_scales.sum())


def smooth(initial: Array, transition: Array, log_emission: Array) -> Smoothed:
    """Return γ and the sum of ξ (2.11–2.12), given the whole sequence.

    Each step is scaled by itself, so that probabilities sum to one however improbable what is
    observed. Raises ImpossibleSequenceError when the sequence has no probability under the model.
    """
    ways = LogTransitions(transition)
    passed = log_filtered(initial, ways, log_emission)
    later = log_backward(passed, ways, log_emission)
    states = passed.log_states + later.log_states
    states = np.exp(states - states.max(axis=1, keepdims=True))
    return Smoothed(
        states / states.sum(axis=1, keepdims=True),
        ways.summed(passed.log_states[:-1] - later.log_totals[:-1, None], later.log_next[1:]),
        float(passed.log_scales.sum()),
    )


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
