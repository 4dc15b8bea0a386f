"""Baum–Welch of many hidden Markov models at once, vectorized over models and sequences.

Shapes: M models of N states each; K sequences of a model at most, T observations of a sequence at
most (fewer and shorter ones are padded); F dimensions, S symbols. Recursions over time run on
(T, M, K, N), everything else on (M, N, T·K), whose last axis is long.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs.recognition.hmm.emissions import (
    Discrete,
    Gaussian,
    ModelError,
    ObservationError,
    Observations,
    check_spread,
)
from hmcs.recognition.hmm.inference import log_likelihood, smooth
from hmcs.recognition.hmm.learning import ALL, Learned, Parts, checked_sequences, renormalized
from hmcs.recognition.hmm.model import Hmm, naming_the_observation
from hmcs_baselines.hmm.stacked import (
    Integers,
    Mask,
    StackedEmissions,
    parameters_of,
    stacked,
)

B = TypeVar("B", Discrete, Gaussian)

_TRUSTED_NATS = 600.0
"""With each step's likelihoods divided by their largest, no factor is above one. A path lost to
underflow is below exp(−708) then, and where the sequence as a whole is above minus this, below
exp(−108) of it. Any other sequence is smoothed in logarithms, by itself and more slowly."""


def baum_welch_many(
    models: Sequence[Hmm[B]],
    sequences: Sequence[Sequence[Observations]],
    *,
    learn: Parts = ALL,
    max_iterations: int = 20,
    tolerance: float = 1e-4,
) -> tuple[Learned[B], ...]:
    """Return what `baum_welch` returns of each model with its own sequences.

    All models have the same kind of emission and the same number of states and of dimensions or
    symbols. Each stops by itself. Raises what `baum_welch` raises, naming the model too.
    """
    if len(models) != len(sequences):
        raise ObservationError(
            f"{len(models)} models but lists of sequences for {len(sequences)}: give one for each"
        )
    if not models:
        return ()
    for m, (model, own) in enumerate(zip(models, sequences, strict=True)):
        _check(m, model, models[0], own, learn)
    batch = _batch(models, sequences)
    histories: list[list[float]] = [[] for _ in models]
    final: list[Hmm[B]] = list(models)
    emission: Array | None = None
    for iteration in range(max_iterations + 1):
        if emission is None:
            emission = batch.emissions.log_likelihood(batch.observations)
        passed = _forward(batch, emission)
        for m, value in zip(batch.numbers, passed.log_likelihoods.sum(axis=1), strict=True):
            histories[m].append(float(value))
        going = np.array(
            [
                iteration < max_iterations
                and (len(histories[m]) == 1 or histories[m][-1] - histories[m][-2] >= tolerance)
                for m in batch.numbers
            ]
        )
        for at in np.flatnonzero(~going):
            m = batch.numbers[at]
            final[m] = Hmm(
                batch.initial[at],
                batch.transition[at],
                batch.emissions.of_model(int(at), models[m].emission),
            )
        if not going.any():
            break
        if not going.all():
            batch, passed, emission = batch.only(going), passed.only(going), emission[going]
        batch = _reestimated(batch, _expected(batch, passed, emission), learn)
        if learn.emission:
            emission = None
    return tuple(Learned(*pair) for pair in zip(final, map(tuple, histories), strict=True))


class _Batch(NamedTuple):
    """Models still learning, and their sequences."""

    numbers: Integers
    """Which of the given models these are, shape (M,)."""
    initial: Array
    transition: Array
    emissions: StackedEmissions
    observations: NDArray[Any]
    """Shape (M, T·K) or (M, F, T·K), zero in padding."""
    lengths: Integers
    """Shape (M, K), zero for a sequence that is none."""

    def sequence(self, values: NDArray[Any], m: int, k: int) -> NDArray[Any]:
        """Of values of shape (M, …, T·K) those of one sequence, time first."""
        sequences = self.lengths.shape[1]
        in_time = np.moveaxis(values[m], -1, 0)[k::sequences]
        return np.asarray(in_time[: self.lengths[m, k]])

    def only(self, kept: Mask) -> _Batch:
        return _Batch(
            self.numbers[kept],
            self.initial[kept],
            self.transition[kept],
            self.emissions.only(kept),
            self.observations[kept],
            self.lengths[kept],
        )


class _Forward(NamedTuple):
    """Forward variables; of a sequence not trusted they mean nothing."""

    likelihood: Array
    """P(o_t | state i) divided by the largest of all states, shape (T, M, K, N); 0 in padding."""
    joint: Array
    """α with these likelihoods, shape (T, M, K, N); 0 in padding."""
    total: Array
    """P of each sequence with these likelihoods, shape (M, K); 1 of one that is none."""
    trusted: Mask
    """Shape (M, K)."""
    log_likelihoods: Array
    """log P of each sequence, shape (M, K); 0 of one that is none."""

    def only(self, kept: Mask) -> _Forward:
        return _Forward(
            self.likelihood[:, kept],
            self.joint[:, kept],
            self.total[kept],
            self.trusted[kept],
            self.log_likelihoods[kept],
        )


class _Expected(NamedTuple):
    states: Array
    """γ, shape (M, N, T·K); 0 in padding."""
    transitions: Array
    """Σ ξ over time and sequences, shape (M, N, N)."""


def _check(
    m: int, model: Hmm[B], first: Hmm[B], sequences: Sequence[Observations], learn: Parts
) -> None:
    try:
        checked_sequences(model, sequences, learn)
        if isinstance(model.emission, Gaussian) and learn.emission:
            check_spread(sequences, model.emission.variance_floor)
    except (ModelError, ObservationError) as error:
        raise type(error)(f"model {m}: {error}") from error
    shapes = [parameters_of(each.emission).shape for each in (model, first)]
    if type(model.emission) is not type(first.emission) or shapes[0] != shapes[1]:
        raise ModelError(
            f"model {m} has {type(model.emission).__name__} emissions of shape {shapes[0]}, model "
            f"0 {type(first.emission).__name__} of {shapes[1]}: learn models of different shape "
            "in calls of their own"
        )


def _batch(models: Sequence[Hmm[Any]], sequences: Sequence[Sequence[Observations]]) -> _Batch:
    lengths = np.zeros((len(models), max(len(own) for own in sequences)), dtype=np.int64)
    for m, own in enumerate(sequences):
        lengths[m, : len(own)] = [len(sequence) for sequence in own]
    given = [np.asarray(sequence) for own in sequences for sequence in own]
    shape = (int(lengths.max()), *lengths.shape, *given[0].shape[1:])
    observations: NDArray[Any] = np.zeros(shape, np.result_type(*given))
    for m, own in enumerate(sequences):
        for k, sequence in enumerate(own):
            observations[: len(sequence), m, k] = sequence
    last_axis = np.moveaxis(observations, 1, 0).reshape(len(models), -1, *given[0].shape[1:])
    return _Batch(
        np.arange(len(models)),
        np.stack([model.initial for model in models]),
        np.stack([model.transition for model in models]),
        stacked([model.emission for model in models]),
        np.ascontiguousarray(np.moveaxis(last_axis, 1, -1)),
        lengths,
    )


def _forward(batch: _Batch, log_emission: Array) -> _Forward:
    """Filter all sequences of all models side by side, unscaled: that is what makes a batch quick.

    A sequence too improbable for that is filtered alone, in logarithms.
    """
    models, states, _ = log_emission.shape
    sequences = batch.lengths.shape[1]
    steps = log_emission.shape[2] // sequences
    present = np.arange(steps)[:, None] < batch.lengths[:, None]
    present = present.reshape(models, steps * sequences)
    top = log_emission.max(axis=1)
    top = np.where(present & np.isfinite(top), top, 0.0)
    ratio = log_emission - top[:, None]
    np.exp(ratio, out=ratio)
    ratio *= present[:, None]
    in_time = ratio.reshape(models, states, steps, sequences).transpose(2, 0, 3, 1)
    likelihood = np.ascontiguousarray(in_time)
    joint = np.empty_like(likelihood)
    np.multiply(batch.initial[:, None], likelihood[0], out=joint[0])
    for t in range(1, steps):
        np.matmul(joint[t - 1], batch.transition, out=joint[t])
        joint[t] *= likelihood[t]
    end = joint[batch.lengths - 1, np.arange(models)[:, None], np.arange(sequences)]
    total = np.where(batch.lengths > 0, end.sum(axis=2), 1.0)
    with np.errstate(divide="ignore"):
        log_total = np.log(total)
    trusted = log_total > -_TRUSTED_NATS
    log_likelihoods = log_total + top.reshape(models, steps, sequences).sum(axis=1)
    for m, k in np.argwhere(~trusted):
        log_likelihoods[m, k] = log_likelihood(
            batch.initial[m], batch.transition[m], batch.sequence(log_emission, m, k)
        )
    return _Forward(likelihood, joint, total, trusted, log_likelihoods)


def _expected(batch: _Batch, passed: _Forward, log_emission: Array) -> _Expected:
    steps, models, _, count = passed.joint.shape
    # What would come next in padding has no likelihood, so that β ends where its sequence does.
    last = np.arange(1, steps + 1)[:, None, None] == batch.lengths
    end = (last & passed.trusted) / np.where(passed.trusted, passed.total, 1.0)
    backward_transition = np.ascontiguousarray(batch.transition.swapaxes(1, 2))
    beta = np.empty_like(passed.joint)
    ahead = np.zeros_like(passed.joint)
    beta[-1] = end[-1, ..., None]
    for t in range(steps - 2, -1, -1):
        np.multiply(passed.likelihood[t + 1], beta[t + 1], out=ahead[t])
        np.matmul(ahead[t], backward_transition, out=beta[t])
        beta[t] += end[t, ..., None]
    beta *= passed.joint
    states = np.ascontiguousarray(beta.transpose(1, 3, 0, 2)).reshape(models, count, -1)
    transitions = batch.transition * (_by_model(passed.joint).swapaxes(1, 2) @ _by_model(ahead))
    for m, k in np.argwhere(~passed.trusted):
        try:
            with naming_the_observation(batch.sequence(batch.observations, m, k), int(k)):
                smoothed = smooth(
                    batch.initial[m], batch.transition[m], batch.sequence(log_emission, m, k)
                )
        except UserError as error:
            raise type(error)(f"model {batch.numbers[m]}: {error}") from error
        batch.sequence(states, m, k)[...] = smoothed.states
        transitions[m] += smoothed.transitions
    return _Expected(states, transitions)


def _reestimated(batch: _Batch, expected: _Expected, learn: Parts) -> _Batch:
    if learn.initial:
        first = expected.states[:, :, : batch.lengths.shape[1]].sum(axis=2)
        sequences = (batch.lengths > 0).sum(axis=1, keepdims=True)
        batch = batch._replace(initial=first / sequences)
    if learn.transition:
        batch = batch._replace(transition=renormalized(expected.transitions, batch.transition))
    if learn.emission:
        emissions = batch.emissions.reestimated(batch.observations, expected.states, batch.numbers)
        batch = batch._replace(emissions=emissions)
    return batch


def _by_model(values: NDArray[Any]) -> NDArray[Any]:
    """(T, M, K, X) as (M, T·K, X)."""
    return values.swapaxes(0, 1).reshape(values.shape[1], -1, values.shape[3])
