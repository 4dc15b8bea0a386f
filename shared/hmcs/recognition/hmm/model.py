"""A hidden Markov model λ = {π, A, B} and what it says of observations (thesis 2.1.2)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from hmcs.arrays import Array
from hmcs.recognition.hmm import inference
from hmcs.recognition.hmm.emissions import (
    DrawingEmission,
    Emission,
    ModelError,
    ObservationError,
    Observations,
    draw,
)
from hmcs.recognition.hmm.inference import Decoded, ImpossibleSequenceError, Path, Smoothed

E = TypeVar("E", bound=Emission)
D = TypeVar("D", bound=DrawingEmission)

_TOLERANCE = 1e-8
"""How far sums of probabilities may be from one."""


class Hmm(NamedTuple, Generic[E]):
    """A hidden Markov model of N states."""

    initial: Array
    """π, shape (N,)."""
    transition: Array
    """A[i, j] = P(state j next | state i), shape (N, N). A row may sum to less than one: what is
    missing is the probability of leaving the model."""
    emission: E
    """P(observation | state)."""


class Sample(NamedTuple):
    """What a model did, and what was seen of it."""

    path: Path
    """Hidden states, shape (T,)."""
    observations: Observations
    """Shape (T, …)."""


def validate(model: Hmm[E]) -> Hmm[E]:
    """Return the model; raises ModelError when it is none, naming what is wrong where."""
    initial, transition = np.asarray(model.initial), np.asarray(model.transition)
    states = model.emission.states
    if initial.shape != (states,) or transition.shape != (states, states):
        raise ModelError(
            f"initial of shape {initial.shape} and transition of shape {transition.shape} for an "
            f"emission of {states} states: give ({states},) and ({states}, {states})"
        )
    if not ((initial >= 0).all() and abs(initial.sum() - 1.0) <= _TOLERANCE):
        raise ModelError(
            f"initial probabilities {initial} sum to {initial.sum():.10g}: give probabilities "
            "that sum to one"
        )
    # A NaN fails both comparisons.
    sound = (transition >= 0).all(axis=1) & (transition.sum(axis=1) <= 1.0 + _TOLERANCE)
    if not sound.all():
        i = int(sound.argmin())
        raise ModelError(
            f"transition row {i} is {transition[i]} and sums to {transition[i].sum():.10g}: give "
            "probabilities that sum to one, or to less where the model may be left"
        )
    return model


def evaluate(model: Hmm[E], observations: Observations) -> float:
    """Return log P(observations | model) (2.7); −inf for an impossible sequence.

    Raises ObservationError when the observations are not of the model's kind, as do all below.
    """
    chain = model.initial, model.transition
    return inference.log_likelihood(*chain, log_emission(model, observations))


def decode(model: Hmm[E], observations: Observations) -> Decoded:
    """Return the most probable state path and its cost, nats.

    Raises ImpossibleSequenceError naming the first impossible observation.
    """
    seen = log_emission(model, observations)
    with naming_the_observation(observations):
        return inference.shortest_path(model.initial, model.transition, seen)


def posterior(model: Hmm[E], observations: Observations) -> Smoothed:
    """Return γ and the sum of ξ.

    Raises ImpossibleSequenceError naming the first impossible observation.
    """
    seen = log_emission(model, observations)
    with naming_the_observation(observations):
        return inference.smooth(model.initial, model.transition, seen)


def log_emission(model: Hmm[E], observations: Observations) -> Array:
    """Return log P(o_t | state i), shape (T, N), of at least one observation."""
    if not len(observations):
        raise ObservationError("the sequence is empty: give at least one observation")
    return model.emission.log_likelihood(observations)


def sample(model: Hmm[D], steps: int, rng: np.random.Generator) -> Sample:
    """Let the model run for `steps` observations, or until it leaves its states if that is sooner.

    Raises ModelError when `steps` is below 1 or the model is none.
    """
    validate(model)
    if steps < 1:
        raise ModelError(f"{steps} steps to sample: ask for at least one")
    leaving = np.maximum(1.0 - model.transition.sum(axis=1, keepdims=True), 0.0)
    # Rounding leaves a little of a row that sums to one.
    ways = np.hstack([model.transition, np.where(leaving > _TOLERANCE, leaving, 0.0)])
    path = [int(draw(model.initial[None], rng)[0])]
    while len(path) < steps:
        following = int(draw(ways[path[-1]][None], rng)[0])
        if following == len(model.initial):
            break
        path.append(following)
    states = np.array(path, dtype=np.int64)
    return Sample(states, model.emission.drawn(states, rng))


@contextmanager
def naming_the_observation(
    observations: Observations, sequence: int | None = None
) -> Iterator[None]:
    """Let an ImpossibleSequenceError from within say what was observed, and in which sequence."""
    try:
        yield
    except ImpossibleSequenceError as error:
        if error.step is None:
            raise
        where = "" if sequence is None else f"sequence {sequence}: "
        raise ImpossibleSequenceError(
            f"{where}{error} (what was observed there: {observations[error.step]})", error.step
        ) from error
