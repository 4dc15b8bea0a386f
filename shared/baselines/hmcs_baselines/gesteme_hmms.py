"""A hidden Markov model for each gesteme, left to right, learned by Baum–Welch (thesis 4.1.1).

Shapes: M gestemes, N states of the longest model, T observations, D symbols at a time of K kinds,
F dimensions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.recognition.checking import (
    LARGEST,
    LEAST_SPREAD,
    check_distributions,
    check_shapes,
    check_spreads,
    check_within,
)
from hmcs.recognition.hmm.emissions import Discrete, Gaussian, MultiDiscrete, Observations
from hmcs.recognition.hmm.learning import baum_welch
from hmcs.recognition.hmm.model import Hmm
from hmcs.recognition.hmm.topologies import left_right, start_in
from hmcs_baselines.hmm.bank import GaussianScores
from hmcs_baselines.hmm.batch import baum_welch_many
from hmcs_baselines.restarting import GestemeChains


class GestemeHmmSettings(NamedTuple):
    """How gesteme HMMs are learned."""

    states: int = 5
    """N of each gesteme. A gesteme whose shortest demonstration makes fewer observations has only
    as many, so that each of its states can be passed in each demonstration; only half as many
    where a gesteme is over once its last state was reached, so that it may be performed in half
    the steps, too."""
    emission_floor: float = 0.01
    """No symbol is less probable than this in any state, or than a tenth of an even share of all
    symbols if that is less. The thesis has none; it matters more than any other choice."""
    variance_floor: float = 0.01
    """Least variance of each dimension of continuous observations, in their unit squared."""
    iterations: int = 20
    """Of Baum–Welch, at most."""


class SymbolTables(NamedTuple):
    """What gesteme HMMs emit: D symbols at a time, independent given the state."""

    probabilities: Array
    """P(symbol k in dimension d | state i of gesteme m), shape (M, N, D, K)."""


class Normals(NamedTuple):
    """What gesteme HMMs emit: vectors with a diagonal Gaussian in each state."""

    means: Array
    """Shape (M, N, F)."""
    variances: Array
    """Shape (M, N, F); in padding 1."""


class GestemeHmms(NamedTuple):
    """The hidden Markov models of all gestemes, in the order of the task."""

    chains: GestemeChains
    emissions: SymbolTables | Normals


def learn_gesteme_hmms(
    by_gesteme: Sequence[Sequence[Observations]],
    symbols: int | None,
    settings: GestemeHmmSettings,
    *,
    complete: bool,
) -> GestemeHmms:
    """Return the HMM of each gesteme from its observation sequences.

    With `symbols` they are integers below it, shape (T, D); without, vectors, shape (T, F).
    Learning starts from states of equal duration. With `complete` every sequence is known to end
    in the last state, as it must where the last state says that the gesteme is over.
    """
    models: list[Hmm[Any]] = [_started(own, symbols, settings, complete) for own in by_gesteme]
    for count in {len(model.initial) for model in models} - {1}:
        alike = [m for m, model in enumerate(models) if len(model.initial) == count]
        improved = _improved(
            [models[m] for m in alike],
            [by_gesteme[m] for m in alike],
            settings.iterations,
            complete=complete,
        )
        for m, model in zip(alike, improved, strict=True):
            models[m] = model
    return _padded(models)


class GestemeScores:
    """The log-likelihood of one observation under all states of all gestemes."""

    def __init__(self, hmms: GestemeHmms) -> None:
        self._normals: GaussianScores | None = None
        if isinstance(hmms.emissions, Normals):
            self._normals = GaussianScores(*hmms.emissions)
        else:
            tables = np.moveaxis(hmms.emissions.probabilities, (2, 3), (0, 1))
            self._log_tables = np.log(np.ascontiguousarray(tables))
            self._dimensions = np.arange(len(tables))

    def log_emission(self, observation: NDArray[Any]) -> Array:
        """Return log P(observation | state i of gesteme m), shape (M, N); anything in padding.

        An observation is D symbols, shape (D,), or a vector, shape (F,), as the HMMs learned it.
        """
        if self._normals is not None:
            return self._normals.log_emission(observation)
        return np.asarray(self._log_tables[self._dimensions, observation].sum(axis=0))


def normals_of(hmms: GestemeHmms) -> Normals:
    """Return the Gaussians of HMMs that observe vectors; raises ValueError for symbols."""
    if not isinstance(hmms.emissions, Normals):
        raise ValueError("the gesteme HMMs observe symbols, expected Gaussians")
    return hmms.emissions


def check_gesteme_hmms(hmms: GestemeHmms, gestemes: int) -> None:
    """Raise ValueError where the arrays do not fit together, or not so many gestemes, or hold no
    probabilities or widths."""
    chains, emissions = hmms
    states = chains.initial.shape[-1] if chains.initial.ndim == 2 else 0
    first = next(iter(emissions))
    emitted = dict.fromkeys(emissions._fields, (gestemes, states, *first.shape[2:]))
    check_shapes(
        {**chains._asdict(), **emissions._asdict()},
        {"initial": (gestemes, states), "transition": (gestemes, states, states), **emitted},
    )
    check_shapes(chains._asdict(), {"states": (gestemes,)}, np.int64)
    check_within("states of a gesteme", chains.states, 1, states)
    if isinstance(emissions, Normals):
        if first.ndim != 3:
            raise ValueError(f"means are of shape {first.shape}, expected a vector for each state")
        check_within("means", emissions.means, -LARGEST, LARGEST)
        check_spreads("variances", emissions.variances)
    else:
        if first.ndim != 4:
            raise ValueError(f"symbols of shape {first.shape}, expected a table for each state")
        check_within("probabilities", first, LEAST_SPREAD, 1.0)
        check_distributions("probabilities", first)
    _check_chains(chains)


def _check_chains(chains: GestemeChains) -> None:
    """Refuse chains whose own states are no Markov chain, or whose padding can be reached."""
    for initial, transition, count in zip(*chains, strict=True):
        check_distributions("initial", initial[:count])
        check_distributions("transition", transition[:count, :count])
        if initial[count:].any() or transition[count:].any() or transition[:, count:].any():
            raise ValueError("arrays 'initial' and 'transition' lead into states that are none")


def _started(
    sequences: Sequence[Observations],
    symbols: int | None,
    settings: GestemeHmmSettings,
    complete: bool,
) -> Hmm[Any]:
    """States of equal duration, and what is observed in them."""
    lengths = [len(sequence) for sequence in sequences]
    count = min(settings.states, max(1, min(lengths) // (2 if complete else 1)))
    if symbols is None and (np.concatenate(sequences) == sequences[0][0]).all():
        # States that emit the same are one, and no variance can be learned of them.
        count = 1
    at = [np.arange(length) * count // length for length in lengths]
    passed = [np.eye(count)[states] for states in at]
    chain = left_right(count, count / (float(np.mean(lengths)) + 1.0))
    emission = _emission(sequences, passed, symbols, settings)
    return Hmm(start_in(count), chain, emission)


def _emission(
    sequences: Sequence[Observations],
    passed: Sequence[Array],
    symbols: int | None,
    settings: GestemeHmmSettings,
) -> Discrete | MultiDiscrete | Gaussian:
    states = passed[0].shape[1]
    if symbols is None:
        stacked, weights = np.concatenate(sequences), np.concatenate(passed)
        weights = weights / weights.sum(axis=0)
        means = weights.T @ stacked
        variances = np.einsum("tn,tnf->nf", weights, (stacked[:, None] - means) ** 2)
        floor = settings.variance_floor
        return Gaussian(means, np.maximum(variances, floor), floor)
    even = Discrete(
        np.full((states, symbols), 1.0 / symbols), min(settings.emission_floor, 0.5 / symbols)
    )
    if sequences[0].shape[1] == 1:
        return even.reestimated([sequence[:, 0] for sequence in sequences], passed)
    return MultiDiscrete((even,) * sequences[0].shape[1]).reestimated(sequences, passed)


def _improved(
    models: Sequence[Hmm[Any]],
    sequences: Sequence[Sequence[Observations]],
    iterations: int,
    *,
    complete: bool,
) -> list[Hmm[Any]]:
    emission = models[0].emission
    if isinstance(emission, Discrete):
        sequences = [[sequence[:, 0] for sequence in own] for own in sequences]
    if complete or isinstance(emission, MultiDiscrete):
        end = [len(models[0].initial) - 1] if complete else None
        return [
            baum_welch(model, own, max_iterations=iterations, end_states=end).model
            for model, own in zip(models, sequences, strict=True)
        ]
    return [each.model for each in baum_welch_many(models, sequences, max_iterations=iterations)]


def _padded(models: Sequence[Hmm[Any]]) -> GestemeHmms:
    counts = np.array([len(model.initial) for model in models], dtype=np.int64)
    shape = (len(models), int(counts.max()))
    initial, transition = np.zeros(shape), np.zeros((*shape, shape[1]))
    for m, (model, count) in enumerate(zip(models, counts, strict=True)):
        initial[m, :count] = model.initial
        transition[m, :count, :count] = model.transition
    emissions: SymbolTables | Normals
    if isinstance(models[0].emission, Gaussian):
        means = _stacked([model.emission.means for model in models], shape, 0.0)
        emissions = Normals(
            means, _stacked([model.emission.variances for model in models], shape, 1.0)
        )
    else:
        tables = [_tables(model.emission) for model in models]
        # Padding is any distribution: no state of it is ever reached.
        emissions = SymbolTables(_stacked(tables, shape, 1.0 / tables[0].shape[2]))
    return GestemeHmms(GestemeChains(initial, transition, counts), emissions)


def _tables(emission: Discrete | MultiDiscrete) -> Array:
    """P(symbol k in dimension d | state i), shape (N, D, K)."""
    dimensions = emission.dimensions if isinstance(emission, MultiDiscrete) else (emission,)
    return np.stack([each.probabilities for each in dimensions], axis=1)


def _stacked(parts: Sequence[Array], shape: tuple[int, int], padding: float) -> Array:
    """Parts of shape (N_m, …) in one array of shape (M, N, …)."""
    stacked = np.full((*shape, *parts[0].shape[1:]), padding)
    for m, part in enumerate(parts):
        stacked[m, : len(part)] = part
    return stacked
