"""Hidden Markov models of hmmlearn, one a gesteme, on directions."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sklearn.cluster import KMeans

from hmcs.arrays import Array
from hmcs_laboratory.methods.features import directions, flat
from hmcs_laboratory.methods.libraries import peer
from hmcs_laboratory.methods.whole import Examples

STATES = 5
ITERATIONS = 20
SYMBOLS = 25
EMISSION_FLOOR = 1e-3
VARIANCE_FLOOR = 1e-2


@dataclass(frozen=True)
class GaussianHmms:
    """A left-right Gaussian HMM a gesteme."""

    models: tuple[Any, ...]

    def classify(self, positions: Array, *, complete: bool) -> Array:
        """Return the log-likelihood under each model, shape (G,)."""
        observed = directions(positions)
        return np.array([model.score(observed) for model in self.models])


@dataclass(frozen=True)
class SymbolHmms:
    """A left-right HMM on k-means symbols of directions a gesteme: the thesis' OD HMM."""

    codebook: Any
    models: tuple[Any, ...]

    def classify(self, positions: Array, *, complete: bool) -> Array:
        """Return the log-likelihood under each model, shape (G,)."""
        symbols = self.codebook.predict(directions(positions))[:, None]
        return np.array([model.score(symbols) for model in self.models])


def prepare(_examples: Examples) -> None:
    """Import hmmlearn."""
    peer("hmmlearn.hmm")


def fit_gaussian(examples: Examples, rng: np.random.Generator) -> GaussianHmms:
    """Fit a `GaussianHMM` with diagonal covariances for each gesteme."""
    hmm = peer("hmmlearn.hmm")
    models = []
    for own in examples:
        observed = [directions(positions) for positions in own]
        states = min(STATES, min(map(len, observed)))
        model = hmm.GaussianHMM(
            states,
            "diag",
            n_iter=ITERATIONS,
            init_params="",
            params="tmc",
            min_covar=VARIANCE_FLOOR,
            random_state=_seed(rng),
        )
        model.startprob_, model.transmat_ = _left_right(states)
        cut = [_pieces(each, states) for each in observed]
        stacked = [np.concatenate(piece) for piece in zip(*cut, strict=True)]
        model.means_ = np.stack([piece.mean(axis=0) for piece in stacked])
        model.covars_ = np.stack([piece.var(axis=0) + VARIANCE_FLOOR for piece in stacked])
        models.append(_fitted(model, observed))
    return GaussianHmms(tuple(models))


def fit_symbols(examples: Examples, rng: np.random.Generator) -> SymbolHmms:
    """Fit a `CategoricalHMM` for each gesteme, on symbols found by k-means in all directions."""
    hmm = peer("hmmlearn.hmm")
    everything = np.concatenate([directions(positions) for positions in flat(examples)])
    symbols = min(SYMBOLS, len(np.unique(everything, axis=0)))
    codebook = KMeans(symbols, n_init=1, random_state=_seed(rng)).fit(everything)
    models = []
    for own in examples:
        observed = [codebook.predict(directions(positions))[:, None] for positions in own]
        states = min(STATES, min(map(len, observed)))
        model = hmm.CategoricalHMM(
            states,
            n_iter=ITERATIONS,
            init_params="",
            params="te",
            n_features=symbols,
            random_state=_seed(rng),
        )
        model.startprob_, model.transmat_ = _left_right(states)
        cut = [_pieces(each, states) for each in observed]
        counts = [
            np.bincount(np.concatenate(piece)[:, 0], minlength=symbols)
            for piece in zip(*cut, strict=True)
        ]
        model.emissionprob_ = _floored(np.array(counts, dtype=float))
        model = _fitted(model, observed)
        model.emissionprob_ = _floored(model.emissionprob_)
        models.append(model)
    return SymbolHmms(codebook, tuple(models))


def _left_right(states: int) -> tuple[Array, Array]:
    transition = 0.8 * np.eye(states) + 0.2 * np.eye(states, k=1)
    transition[-1, -1] = 1.0
    return np.eye(states)[0], transition


def _pieces(observed: Array, count: int) -> list[Array]:
    return np.array_split(observed, count)


def _fitted(model: Any, observed: Sequence[Array]) -> Any:
    # It warns of few data: that they are few is what is studied.
    logging.getLogger("hmmlearn").setLevel(logging.ERROR)
    model.fit(np.concatenate(observed), [len(each) for each in observed])
    # A state that is never left, for it is never reached or only at the end, loses its row in
    # re-estimation, and hmmlearn then refuses to score with its own model.
    lost = ~model.transmat_.any(axis=1)
    model.transmat_[lost, lost] = 1.0
    return model


def _floored(emission: Array) -> Array:
    raised = emission / emission.sum(axis=1, keepdims=True) + EMISSION_FLOOR
    return np.asarray(raised / raised.sum(axis=1, keepdims=True))


def _seed(rng: np.random.Generator) -> int:
    return int(rng.integers(2**31))
