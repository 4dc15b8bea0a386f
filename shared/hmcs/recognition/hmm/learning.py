"""Learning hidden Markov models from observation sequences (thesis 2.1.2)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hmcs.recognition.hmm.emissions import log_gaussians
from hmcs.recognition.hmm.inference import Array, Smoothed, log_likelihood, smooth


class GaussianHmm(NamedTuple):
    """An HMM with diagonal Gaussian emissions (2.14 with one mixture component)."""

    initial: Array
    """π, shape (N,)."""
    transition: Array
    """A[i, j] = P(state j next | state i), shape (N, N). A row may sum to less than one: what is
    missing is the probability of leaving the model."""
    means: Array
    """Shape (N, F)."""
    variances: Array
    """Shape (N, F)."""


class Learned(NamedTuple):
    """A model and how it came to be."""

    model: GaussianHmm
    log_likelihoods: tuple[float, ...]
    """Of all sequences, before each iteration and after the last."""


def baum_welch(
    model: GaussianHmm,
    sequences: Sequence[Array],
    *,
    max_iterations: int = 20,
    tolerance: float = 1e-4,
    variance_floor: float = 1e-6,
    learn_chain: bool = True,
) -> Learned:
    """Return the model re-estimated from several observation sequences, each of shape (T, F).

    Numerators and denominators are summed over sequences. Stops when the log-likelihood rises by
    less than `tolerance`, or after `max_iterations`. With `learn_chain` false only means and
    variances are learned and the initial and transition probabilities stay.
    Raises ImpossibleSequenceError when a sequence has no probability under the model.
    """
    history: list[float] = []
    for _ in range(max_iterations):
        stats = [_statistics(model, sequence) for sequence in sequences]
        history.append(sum(s[0].log_likelihood for s in stats))
        if len(history) > 1 and history[-1] - history[-2] < tolerance:
            return Learned(model, tuple(history))
        model = _maximize(model, stats, variance_floor, learn_chain)
    history.append(
        sum(
            log_likelihood(
                model.initial,
                model.transition,
                log_gaussians(model.means, model.variances, sequence),
            )
            for sequence in sequences
        )
    )
    return Learned(model, tuple(history))


def _statistics(model: GaussianHmm, sequence: Array) -> tuple[Smoothed, Array]:
    emission = log_gaussians(model.means, model.variances, sequence)
    return smooth(model.initial, model.transition, emission), sequence


def _maximize(
    model: GaussianHmm,
    stats: Sequence[tuple[Smoothed, Array]],
    variance_floor: float,
    learn_chain: bool,
) -> GaussianHmm:
    initial, transition = model.initial, model.transition
    if learn_chain:
        initial = np.mean([s.states[0] for s, _ in stats], axis=0)
        counts = np.sum([s.transitions for s, _ in stats], axis=0)
        leaving = counts.sum(axis=1, keepdims=True)
        stays_inside = transition.sum(axis=1, keepdims=True)
        transition = np.where(
            leaving > 0, counts / np.maximum(leaving, 1e-300) * stays_inside, transition
        )
    weight = np.sum([s.states.sum(axis=0) for s, _ in stats], axis=0)[:, None]
    seen = weight > 1e-12
    safe = np.where(seen, weight, 1.0)
    means = np.where(seen, np.sum([s.states.T @ o for s, o in stats], axis=0) / safe, model.means)
    spread = np.sum(
        [
            np.einsum("tn,tnf->nf", s.states, (o[:, None, :] - means[None, :, :]) ** 2)
            for s, o in stats
        ],
        axis=0,
    )
    variances = np.where(seen, np.maximum(spread / safe, variance_floor), model.variances)
    return GaussianHmm(initial, transition, means, variances)
