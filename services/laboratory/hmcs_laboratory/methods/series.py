"""Time-series classifiers of aeon on positions: nearest neighbor under DTW, and MiniRocket."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs_laboratory.methods.features import flat, labels
from hmcs_laboratory.methods.libraries import peer
from hmcs_laboratory.methods.whole import Examples
from hmcs_laboratory.single_gestemes.even_points import evenly

LEAST_SAMPLES = 9
"""MiniRocket takes no series shorter than this."""


@dataclass(frozen=True)
class NearestByDtw:
    """The nearest training example under dynamic time warping of displacements."""

    examples: tuple[Array, ...]
    """Shape (D, T) each."""
    gestemes: NDArray[np.int64]

    def classify(self, positions: Array, *, complete: bool) -> Array:
        """Return minus the distance to the nearest example of each gesteme, shape (G,)."""
        distances = peer("aeon.distances").dtw_pairwise_distance(
            list(self.examples), [_series(positions)]
        )[:, 0]
        count = int(self.gestemes.max()) + 1
        return np.array([-distances[self.gestemes == g].min() for g in range(count)])


@dataclass(frozen=True)
class Rocket:
    """MiniRocket features of displacements, and a ridge classifier."""

    classifier: Any
    samples: int
    """All series are resampled to so many."""
    gestemes: int

    def classify(self, positions: Array, *, complete: bool) -> Array:
        """Return one for the gesteme decided for and zero for others, shape (G,)."""
        decided = self.classifier.predict(_resampled(positions, self.samples)[None])
        return np.asarray(np.eye(self.gestemes)[int(decided[0])])


def prepare_dtw(examples: Examples) -> None:
    """Have aeon compile its distance for positions of that dimension."""
    _compile_dtw(examples[0][0].shape[1])


def prepare_rocket(examples: Examples) -> None:
    """Have aeon compile its kernels for positions of that dimension."""
    _compile_rocket(examples[0][0].shape[1])


def fit_dtw(examples: Examples, _rng: np.random.Generator) -> NearestByDtw:
    """Keep the examples."""
    return NearestByDtw(tuple(map(_series, flat(examples))), labels(examples))


def fit_rocket(examples: Examples, rng: np.random.Generator) -> Rocket:
    """Fit aeon's `MiniRocketClassifier` to the examples, resampled to their mean length."""
    everything = flat(examples)
    samples = max(LEAST_SAMPLES, round(float(np.mean([len(each) for each in everything]))))
    classifier = _rocket_classifier(int(rng.integers(2**31)))
    classifier.fit(np.stack([_resampled(each, samples) for each in everything]), labels(examples))
    return Rocket(classifier, samples, len(examples))


def _series(positions: Array) -> Array:
    return np.ascontiguousarray((positions - positions[0]).T)


def _resampled(positions: Array, samples: int) -> Array:
    return _series(evenly(positions, samples))


def _rocket_classifier(seed: int) -> Any:
    rocket = peer("aeon.classification.convolution_based")
    return rocket.MiniRocketClassifier(n_jobs=1, random_state=seed)


@cache
def _compile_dtw(dimensions: int) -> None:
    series = [np.zeros((dimensions, length)) for length in (9, 10)]
    with warnings.catch_warnings():
        # Numba warns of a cast of indices inside aeon.
        warnings.simplefilter("ignore")
        peer("aeon.distances").dtw_pairwise_distance(series, [series[0]])


@cache
def _compile_rocket(dimensions: int) -> None:
    noise = np.random.default_rng(0).standard_normal((4, dimensions, 12))
    classifier = _rocket_classifier(0)
    classifier.fit(noise, np.arange(4) % 2)
    classifier.predict(noise[:1])
