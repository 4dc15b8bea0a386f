"""Learning hidden Markov models from observation sequences (thesis 2.1.2).

Baum–Welch raises P(observations | model), segmental k-means P(observations, best path | model)
(Juang and Rabiner 1990); both find a local maximum that depends on the start. A structural zero
of the initial or transition probabilities stays zero; what a transition row lacks to one (the
probability of leaving) stays too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Generic, NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.recognition.hmm.emissions import ModelError, ObservationError, Observations
from hmcs.recognition.hmm.inference import Smoothed, log_likelihood, shortest_path, smooth
from hmcs.recognition.hmm.model import (
    E,
    Hmm,
    log_emission,
    naming_the_observation,
    validate,
)


class Parts(NamedTuple):
    """Which parts of a model are learned; the others stay as they are."""

    initial: bool = True
    transition: bool = True
    emission: bool = True


ALL = Parts()
CHAIN = Parts(emission=False)
"""Initial and transition probabilities with the observation probabilities fixed (4.1.2)."""
EMISSION = Parts(initial=False, transition=False)


class Learned(NamedTuple, Generic[E]):
    """A model and how it came to be."""

    model: Hmm[E]
    log_likelihoods: tuple[float, ...]
    """Of all sequences together, before each iteration and after the last, nats. Of the best
    paths jointly with the observations for segmental k-means."""


def baum_welch(
    model: Hmm[E],
    sequences: Sequence[Observations],
    *,
    learn: Parts = ALL,
    max_iterations: int = 20,
    tolerance: float = 1e-4,
    end_states: Sequence[int] | None = None,
) -> Learned[E]:
    """Return the model re-estimated from several observation sequences (2.8–2.13).

    Numerators and denominators are summed over sequences. Stops when the log-likelihood rises by
    less than `tolerance`, nats, or after `max_iterations`. With `end_states` every sequence is
    known to end in one of these states.
    Raises ModelError when the model is none; ObservationError when there are no sequences, one is
    not of the model's kind or too short, or they determine no emission; ImpossibleSequenceError
    when a sequence has no probability under the model. All say which sequence.
    """
    emissions = checked_sequences(model, sequences, learn, end_states)
    history: list[float] = []
    for iteration in range(max_iterations + 1):
        if iteration and learn.emission:
            emissions = _log_emissions(model, sequences, end_states)
        if iteration == max_iterations:
            history.append(
                sum(log_likelihood(model.initial, model.transition, e) for e in emissions)
            )
            break
        smoothed = [
            _smoothed(model, k, sequence, emission)
            for k, (sequence, emission) in enumerate(zip(sequences, emissions, strict=True))
        ]
        history.append(sum(s.log_likelihood for s in smoothed))
        if len(history) > 1 and history[-1] - history[-2] < tolerance:
            break
        model = _reestimated(model, sequences, smoothed, learn)
    return Learned(model, tuple(history))


def segmental_k_means(
    model: Hmm[E],
    sequences: Sequence[Observations],
    *,
    learn: Parts = ALL,
    max_iterations: int = 20,
    tolerance: float = 1e-4,
    end_states: Sequence[int] | None = None,
) -> Learned[E]:
    """Return the model re-estimated from its most probable paths, as `baum_welch` otherwise.

    Each iteration aligns all sequences by Viterbi and counts along the paths. Stops when the joint
    log probability of paths and observations rises by less than `tolerance`, nats.
    """
    emissions = checked_sequences(model, sequences, learn, end_states)
    history: list[float] = []
    for iteration in range(max_iterations + 1):
        if iteration and learn.emission:
            emissions = _log_emissions(model, sequences, end_states)
        aligned = [
            _aligned(model, k, sequence, emission)
            for k, (sequence, emission) in enumerate(zip(sequences, emissions, strict=True))
        ]
        history.append(sum(a.log_likelihood for a in aligned))
        risen = len(history) == 1 or history[-1] - history[-2] >= tolerance
        if not risen or iteration == max_iterations:
            break
        model = _reestimated(model, sequences, aligned, learn)
    return Learned(model, tuple(history))


def checked_sequences(
    model: Hmm[E],
    sequences: Sequence[Observations],
    learn: Parts = ALL,
    end_states: Sequence[int] | None = None,
) -> list[Array]:
    """Return log P(o_t | state i) of each sequence, shape (T, N), if they can be learned from.

    Raises what `baum_welch` raises of a model and sequences that do not fit.
    """
    validate(model)
    if not len(sequences):
        raise ObservationError("no sequences to learn from: give at least one")
    if end_states is not None:
        foreign = [state for state in end_states if not 0 <= state < len(model.initial)]
        if foreign or not end_states:
            raise ModelError(
                f"end states {list(end_states)}: name some of 0 to {len(model.initial) - 1}"
            )
    emissions = _log_emissions(model, sequences, end_states)
    at_least = 2 if learn.transition else 1
    needed = 1 if end_states is None else _steps_to(end_states, model)
    for k, emission in enumerate(emissions):
        if len(emission) < at_least:
            raise ObservationError(
                f"sequence {k} has a single observation and so no transition to learn from: leave "
                "it out, or learn emissions only"
            )
        if len(emission) < needed:
            raise ObservationError(
                f"sequence {k} has {len(emission)} observations, but the model needs {needed} to "
                f"get to end state {' or '.join(map(str, end_states or ()))}: use fewer states, "
                "allow skips, or leave the sequence out"
            )
    return emissions


def renormalized(counts: Array, transition: Array) -> Array:
    """Return A from expected transitions (2.13), both (…, N, N); a state never left keeps its row.

    Each row keeps its sum.
    """
    leaving = counts.sum(axis=-1, keepdims=True)
    stays_inside = transition.sum(axis=-1, keepdims=True)
    return np.where(leaving > 0, counts / np.maximum(leaving, 1e-300) * stays_inside, transition)


def _log_emissions(
    model: Hmm[E], sequences: Sequence[Observations], end_states: Sequence[int] | None
) -> list[Array]:
    emissions = []
    for k, sequence in enumerate(sequences):
        try:
            emission = log_emission(model, sequence)
        except ObservationError as error:
            raise ObservationError(f"sequence {k}: {error}") from error
        if end_states is not None:
            allowed = np.isin(np.arange(len(model.initial)), end_states)
            emission = np.vstack([emission[:-1], np.where(allowed, emission[-1], -np.inf)])
        emissions.append(emission)
    return emissions


def _steps_to(end_states: Sequence[int], model: Hmm[E]) -> int:
    """Observations of the shortest sequence that ends in one of the states; 1 if none can."""
    reached = model.initial > 0
    for steps in range(1, len(reached) + 1):
        if reached[list(end_states)].any():
            return steps
        reached = reached | (model.transition[reached] > 0).any(axis=0)
    return 1


def _smoothed(model: Hmm[E], k: int, sequence: Observations, emission: Array) -> Smoothed:
    with naming_the_observation(sequence, k):
        return smooth(model.initial, model.transition, emission)


def _aligned(model: Hmm[E], k: int, sequence: Observations, emission: Array) -> Smoothed:
    """All weight on the best path."""
    with naming_the_observation(sequence, k):
        path, cost, _, _ = shortest_path(model.initial, model.transition, emission)
    transitions = np.zeros_like(model.transition)
    np.add.at(transitions, (path[:-1], path[1:]), 1.0)
    return Smoothed(np.eye(len(model.initial))[path], transitions, -cost)


def _reestimated(
    model: Hmm[E],
    sequences: Sequence[Observations],
    smoothed: Sequence[Smoothed],
    learn: Parts,
) -> Hmm[E]:
    initial, transition, emission = model
    if learn.initial:
        initial = np.mean([s.states[0] for s in smoothed], axis=0)
    if learn.transition:
        counts = np.sum([s.transitions for s in smoothed], axis=0)
        transition = renormalized(counts, transition)
    if learn.emission:
        emission = emission.reestimated(sequences, [s.states for s in smoothed])
    return Hmm(initial, transition, emission)
