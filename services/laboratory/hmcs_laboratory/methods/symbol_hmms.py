"""The thesis' gesteme classifiers: OD, MD and FFT HMMs of symbols (4.1.1), all begun at the start.

Shapes: M gestemes of N states; T observations of D symbols at a time, of K kinds each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.recognition.hmm.emissions import Discrete, MultiDiscrete
from hmcs.recognition.hmm.learning import baum_welch
from hmcs.recognition.hmm.model import Hmm
from hmcs.recognition.hmm.topologies import left_right, start_in
from hmcs_baselines.hmm.bank import ForwardBank
from hmcs_baselines.hmm.batch import baum_welch_many
from hmcs_baselines.symbols import (
    Bins,
    Codebook,
    Fourier,
    direction_bins,
    fit_bins,
    fit_codebook,
    fourier_features,
)
from hmcs_laboratory.methods.features import directions, flat
from hmcs_laboratory.methods.whole import Examples, WholeMethod

Integers = NDArray[np.intp]

Observed = Literal["od", "md", "fft"]
"""Directions through a code book; each component of them in bins; their Fourier coefficients in
bins."""

_UNROLLED_DIMENSIONS = 3
"""Up to so many symbols at a time learning them in turn is faster than together."""
_EVEN_SHARE = 0.1
"""Of the probabilities that learning starts from: without it what a state does not see in the
first place would stay impossible where there is no floor."""


class SymbolHmmSettings(NamedTuple):
    """How the gesteme HMMs are made; the defaults are those of the notes to the thesis."""

    states: int = 5
    """N, from left to right."""
    floor: float = 0.001
    """Least probability of a symbol in a state. The thesis has none (0)."""
    symbols: int = 25
    """Centers of the code book (OD)."""
    bins: int = 10
    """Of each dimension (MD, FFT)."""
    iterations: int = 20
    """Of Baum–Welch, at most."""
    restarts: int = 1
    """Starts of k-means (OD)."""


@dataclass(frozen=True)
class SymbolHmms:
    """The HMMs of all gestemes, and how a motion becomes their symbols."""

    encoder: Codebook | Bins
    fourier: Fourier | None
    """Of windows of directions; None for directions as they are."""
    initial: Array
    """Shape (M, N)."""
    transition: Array
    """Shape (M, N, N)."""
    log_tables: Array
    """log P(symbol k in dimension d | state i of gesteme m), shape (D, K, M, N)."""

    def classify(self, positions: Array, *, complete: bool) -> Array:
        """Return log P(all symbols | gesteme), shape (M,)."""
        bank = ForwardBank(self.initial, self.transition)
        seen = encoded(positions, self.encoder, self.fourier)
        for log_emission in self.log_tables[np.arange(seen.shape[1]), seen].sum(axis=1):
            bank.step(log_emission)
        return bank.log_likelihood


def fit_symbol_hmms(
    examples: Examples,
    rng: np.random.Generator,
    *,
    observed: Observed,
    settings: SymbolHmmSettings = SymbolHmmSettings(),  # noqa: B008  frozen
) -> SymbolHmms:
    """Learn an HMM of each gesteme by Baum–Welch from states of equal duration."""
    fourier = Fourier() if observed == "fft" else None
    encoder = _encoder(examples, rng, observed, settings)
    sequences = [[encoded(positions, encoder, fourier) for positions in own] for own in examples]
    kinds = settings.symbols if observed == "od" else settings.bins
    if isinstance(encoder, Codebook):
        kinds = len(encoder.centers)
    # Baum–Welch needs a transition.
    sequences = [
        [symbols if len(symbols) > 1 else symbols.repeat(2, axis=0) for symbols in own]
        for own in sequences
    ]
    models = [_started(own, kinds, settings) for own in sequences]
    learned = _learned(models, sequences, settings.iterations)
    tables = [
        np.stack([each.probabilities for each in model.emission.dimensions]) for model in learned
    ]
    with np.errstate(divide="ignore"):
        log_tables = np.log(np.array(tables)).transpose(1, 3, 0, 2)
    return SymbolHmms(
        encoder,
        fourier,
        np.stack([model.initial for model in learned]),
        np.stack([model.transition for model in learned]),
        np.ascontiguousarray(log_tables),
    )


def encoded(positions: Array, encoder: Codebook | Bins, fourier: Fourier | None) -> Integers:
    """Return the symbols of a motion, m, shape (T, axes), as integers of shape (T', D)."""
    symbols = encoder.encode(_features(positions, fourier))
    return symbols[:, None] if symbols.ndim == 1 else symbols


def symbol_method(observed: Observed, *, floored: bool) -> WholeMethod:
    """Return the method `OBSERVED-hmm`, or `OBSERVED-hmm-no-floor`, with default settings."""
    settings = SymbolHmmSettings() if floored else SymbolHmmSettings(floor=0.0)
    return WholeMethod(
        f"{observed}-hmm" if floored else f"{observed}-hmm-no-floor",
        f"Aarno 2007, 4.1.1: {observed.upper()} HMM"
        + (f", probabilities of symbols at least {settings.floor:g}" if floored else ""),
        partial(fit_symbol_hmms, observed=observed, settings=settings),
    )


def with_symbols(method: WholeMethod, count: int) -> WholeMethod:
    """Return the method with so many symbols: centers (OD), or bins of each dimension.

    A method that has none is returned as it is.
    """
    fit = method.fit
    if not isinstance(fit, partial) or fit.func is not fit_symbol_hmms:
        return method
    settings = fit.keywords["settings"]._replace(symbols=count, bins=count)
    return replace(method, fit=partial(fit, settings=settings))


SYMBOL_METHODS = tuple(
    symbol_method(observed, floored=floored)
    for floored in (True, False)
    for observed in ("od", "md", "fft")
)


def _features(positions: Array, fourier: Fourier | None) -> Array:
    seen = directions(positions)
    return seen if fourier is None else fourier_features(seen, fourier)


def _encoder(
    examples: Examples, rng: np.random.Generator, observed: Observed, settings: SymbolHmmSettings
) -> Codebook | Bins:
    motions = flat(examples)
    if observed == "md":
        return direction_bins(motions[0].shape[1], settings.bins)
    if observed == "fft":
        return fit_bins([_features(motion, Fourier()) for motion in motions], settings.bins)
    seen = [directions(motion) for motion in motions]
    distinct = len(np.unique(np.concatenate(seen), axis=0))
    count = min(settings.symbols, distinct)
    return fit_codebook(seen, rng, symbols=count, restarts=settings.restarts)


def _started(
    sequences: Sequence[Integers], kinds: int, settings: SymbolHmmSettings
) -> Hmm[MultiDiscrete]:
    count, even = settings.states, np.full((settings.states, kinds), 1.0 / kinds)
    passed = [np.eye(count)[np.arange(len(own)) * count // len(own)] for own in sequences]
    floor = min(settings.floor, 0.5 / kinds)
    dimensions = []
    for column in range(sequences[0].shape[1]):
        counted = Discrete(even).reestimated([own[:, column] for own in sequences], passed)
        mixed = (1.0 - _EVEN_SHARE) * counted.probabilities + _EVEN_SHARE * even
        dimensions.append(Discrete(mixed, floor))
    mean_length = float(np.mean([len(own) for own in sequences]))
    chain = left_right(count, min(0.5, count / (mean_length + 1.0)))
    return Hmm(start_in(count), chain, MultiDiscrete(tuple(dimensions)))


def _learned(
    models: Sequence[Hmm[MultiDiscrete]], sequences: Sequence[Sequence[Integers]], iterations: int
) -> list[Hmm[MultiDiscrete]]:
    dimensions = len(models[0].emission.dimensions)
    if dimensions > _UNROLLED_DIMENSIONS:
        return [
            baum_welch(model, own, max_iterations=iterations).model
            for model, own in zip(models, sequences, strict=True)
        ]
    learned = baum_welch_many(
        [_unrolled(model) for model in models],
        [[symbols.ravel() for symbols in own] for own in sequences],
        max_iterations=iterations,
    )
    return [_rolled(each.model, dimensions) for each in learned]


def _unrolled(model: Hmm[MultiDiscrete]) -> Hmm[Discrete]:
    """The same model, saying the symbols of a time one after another, in a state for each."""
    tables = np.stack([each.probabilities for each in model.emission.dimensions], axis=1)
    count, dimensions, kinds = tables.shape
    first = np.arange(count) * dimensions
    transition = np.diag((np.arange(count * dimensions - 1) + 1) % dimensions != 0, 1).astype(float)
    transition[np.ix_(first + dimensions - 1, first)] = model.transition
    initial = np.zeros(count * dimensions)
    initial[first] = model.initial
    emission = Discrete(
        tables.reshape(count * dimensions, kinds), model.emission.dimensions[0].floor
    )
    return Hmm(initial, transition, emission)


def _rolled(model: Hmm[Discrete], dimensions: int) -> Hmm[MultiDiscrete]:
    """What was unrolled."""
    first = slice(None, None, dimensions)
    last = slice(dimensions - 1, None, dimensions)
    emission: Any = tuple(
        replace(model.emission, probabilities=model.emission.probabilities[d::dimensions])
        for d in range(dimensions)
    )
    return Hmm(model.initial[first], model.transition[last, first], MultiDiscrete(emission))
