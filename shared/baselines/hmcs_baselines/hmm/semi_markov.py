"""Explicit durations: how long a state lasts has a distribution of its own (hidden semi-Markov).

A stay in state i of an ordinary HMM lasts d steps with probability A[i, i]^(d−1)·(1 − A[i, i]): the
shortest stay is the most probable. Here a stay is a segment whose duration is drawn on entry, and
the model is an exact HMM over (state, steps that remain). `expand` builds that HMM; `filtered`,
`smoothed` and `decoded` walk its structural zeros directly, O(N² + N·D) a step instead of O(N²·D²).
Source: Rabiner 1989, IV.D.
Shapes: N states, T observations, D the longest duration, steps.
The last segment may go on after the last observation: what is seen of it counts as P(at least so
long).
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hmcs.arrays import Array
from hmcs.recognition.hmm.inference import (
    ImpossibleSequenceError,
    LogFiltered,
    log_backward,
    log_filtered,
)
from hmcs.recognition.hmm.log_transitions import LogTransitions, log_of, log_sum
from hmcs_baselines.hmm.durations import DurationError
from hmcs_baselines.hmm.markov import States, checked_rows


class DurationHmm(NamedTuple):
    """A chain of segments; made and checked by `duration_hmm`."""

    initial: Array
    """P(state of the first segment), shape (N,)."""
    transition: Array
    """P(state of the next segment | state of this one), shape (N, N). A row may sum to less than
    one: what is missing is the probability that the process ends with the segment."""
    durations: Array
    """P(segment lasts d + 1 steps | state), shape (N, D)."""


class Expanded(NamedTuple):
    """The same process as an ordinary HMM over N·D pairs (state, steps that remain)."""

    initial: Array
    """Shape (N·D,)."""
    transition: Array
    """Shape (N·D, N·D)."""
    state: States
    """The state of each pair, shape (N·D,): emissions are those of the state."""
    remaining: States
    """Steps that remain, this one included, shape (N·D,)."""


class Filtered(NamedTuple):
    """What is known while observations come in."""

    states: Array
    """P(state i at t | observations 0..t), shape (T, N)."""
    log_likelihoods: Array
    """log P(observation t | observations 0..t−1), shape (T,)."""


class StateInterval(NamedTuple):
    """A segment of the most probable segmentation."""

    state: int
    first: int
    """Its first step."""
    steps: int
    """How many of the observed steps it covers."""


class Segmentation(NamedTuple):
    """The most probable segmentation."""

    segments: tuple[StateInterval, ...]
    states: States
    """The state at each step, shape (T,)."""
    log_probability: float
    """log P(segments, observations), the duration of the last segment a part of the segmentation
    also where it reaches beyond the observations."""


def duration_hmm(initial: ArrayLike, transition: ArrayLike, durations: ArrayLike) -> DurationHmm:
    """Return the model of initial (N,), transition (N, N) and duration (N, D) probabilities.

    Raises MarkovModelError when a shape is wrong or a row is no probability distribution.
    """
    spread = checked_rows(durations, "durations", columns=None)
    count = len(spread)
    start = checked_rows(np.asarray(initial, dtype=float)[None], "initial", count)[0]
    chain = checked_rows(transition, "transition", count, leaving=True)
    if len(chain) != count:
        raise DurationError(f"transition has {len(chain)} rows, durations {count}: one per state")
    return DurationHmm(start, chain, spread)


def expand(model: DurationHmm) -> Expanded:
    """Return the same process as an HMM with structural zeros: r → r − 1, and out at r = 1."""
    count, longest = model.durations.shape
    initial = (model.initial[:, None] * model.durations).ravel()
    transition = np.zeros((count, longest, count, longest))
    transition[:, 0] = model.transition[:, :, None] * model.durations
    here, below = np.arange(count)[:, None], np.arange(longest - 1)
    transition[here, below + 1, here, below] = 1.0
    state, remaining = np.divmod(np.arange(count * longest), longest)
    return Expanded(
        initial, transition.reshape(count * longest, count * longest), state, remaining + 1
    )


def filtered(model: DurationHmm, log_emission: Array) -> Filtered:
    """Return the state probabilities step by step, given log P(o_t | state i), shape (T, N).

    Raises DurationError for a wrong shape, ImpossibleSequenceError for observations that the model
    gives no probability.
    """
    passed = _passed(model, _Ways(model), log_emission)
    return Filtered(_states_of(passed.log_states, model), passed.log_scales)


def smoothed(model: DurationHmm, log_emission: Array) -> Array:
    """Return γ: P(state i at t | all observations), shape (T, N). Raises as `filtered`."""
    ways = _Ways(model)
    passed = _passed(model, ways, log_emission)
    later = log_backward(passed, ways, _of_pairs(model, log_emission))
    return _states_of(passed.log_states + later.log_states, model)


def decoded(model: DurationHmm, log_emission: Array) -> Segmentation:
    """Return the most probable segmentation; where entering a state is as probable as staying, it
    stays. Raises as `filtered`.
    """
    _check_emission(model, log_emission)
    log_durations, log_transition = log_of(model.durations), log_of(model.transition)
    steps = len(log_emission)
    best, log_probability = log_of(model.initial)[:, None] + log_durations, 0.0
    entered_from = np.full((steps, *best.shape), -1, dtype=np.int64)
    for t in range(steps):
        if t:
            leaving = best[:, :1] + log_transition
            entered = leaving.max(axis=0)[:, None] + log_durations
            stayed = _remaining_less(best)
            entered_from[t] = np.where(entered > stayed, leaving.argmax(axis=0)[:, None], -1)
            best = np.maximum(entered, stayed)
        best = best + log_emission[t][:, None]
        top = float(best.max())
        if not np.isfinite(top):
            raise _impossible(t)
        # What all have in common is set apart: beside it the differences would be lost.
        best, log_probability = best - top, log_probability + top
    state, remaining = divmod(int(best.argmax()), best.shape[1])
    path = np.empty(steps, dtype=np.int64)
    firsts = []
    for t in range(steps - 1, -1, -1):
        path[t] = state
        origin = int(entered_from[t, state, remaining])
        if t == 0 or origin >= 0:
            firsts.append(t)
            state, remaining = origin, 0
        else:
            remaining += 1
    bounds = [*reversed(firsts), steps]
    segments = tuple(
        StateInterval(int(path[first]), first, after - first) for first, after in pairwise(bounds)
    )
    return Segmentation(segments, path, log_probability)


class _Ways:
    """The few ways between pairs (state, steps that remain), in the order of `expand`."""

    def __init__(self, model: DurationHmm) -> None:
        self._log_durations = log_of(model.durations)
        self._segments = LogTransitions(model.transition)

    def ahead(self, log_here: Array) -> Array:
        here = log_here.reshape(self._log_durations.shape)
        entered = self._segments.ahead(here[:, 0])[:, None] + self._log_durations
        return np.asarray(np.logaddexp(entered, _remaining_less(here)).ravel())

    def back(self, log_next: Array) -> Array:
        following = log_next.reshape(self._log_durations.shape)
        ended = self._segments.back(log_sum(self._log_durations + following, axis=1))
        return np.concatenate([ended[:, None], following[:, :-1]], axis=1).ravel()


def _passed(model: DurationHmm, ways: _Ways, log_emission: Array) -> LogFiltered:
    """The pairs (state, steps that remain) filtered, (T, N·D)."""
    _check_emission(model, log_emission)
    initial = (model.initial[:, None] * model.durations).ravel()
    try:
        return log_filtered(initial, ways, _of_pairs(model, log_emission))
    except ImpossibleSequenceError as error:
        raise _impossible(error.step) from None


def _of_pairs(model: DurationHmm, log_emission: Array) -> Array:
    """log P(o_t | pair), shape (T, N·D): emissions are those of the state."""
    return np.repeat(log_emission, model.durations.shape[1], axis=1)


def _states_of(log_joint: Array, model: DurationHmm) -> Array:
    """P(state i at t), shape (T, N), of log joint weights of pairs, shape (T, N·D)."""
    joint = np.exp(log_joint - log_joint.max(axis=1, keepdims=True))
    states = joint.reshape(-1, *model.durations.shape).sum(axis=2)
    return np.asarray(states / states.sum(axis=1, keepdims=True))


def _remaining_less(log_values: Array) -> Array:
    """One step of r → r − 1, shape (N, D): none comes to r = D."""
    nothing = np.full((len(log_values), 1), -np.inf)
    return np.concatenate([log_values[:, 1:], nothing], axis=1)


def _check_emission(model: DurationHmm, log_emission: Array) -> None:
    count = len(model.initial)
    if log_emission.ndim != 2 or log_emission.shape[1] != count or len(log_emission) == 0:
        raise DurationError(
            f"log_emission has shape {log_emission.shape}: (T, {count}) with one observation or "
            "more is expected"
        )
    wrong = np.isnan(log_emission).any(axis=1)
    if wrong.any():
        raise DurationError(
            f"log_emission is not a number at observation {int(np.argmax(wrong))}: "
            "leave out what was not measured"
        )


def _impossible(dead: int | None) -> ImpossibleSequenceError:
    return ImpossibleSequenceError(
        f"the sequence is impossible under the model from its observation {dead} on: "
        "check durations, structural zeros and emission floors",
        dead,
    )
