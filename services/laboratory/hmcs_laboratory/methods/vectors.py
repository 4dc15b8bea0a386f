"""scikit-learn classifiers: of a whole gesteme as one vector, and of windows sample by sample."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVC

from hmcs.arrays import Array
from hmcs_laboratory.methods.features import flat, labels, shape_and_length
from hmcs_laboratory.methods.whole import Examples, TooFewError
from hmcs_laboratory.methods.windows import FROM_START, fit_window_trees, log_shares


@dataclass(frozen=True)
class OfVectors:
    """A classifier of `shape_and_length`."""

    classifier: Any

    def classify(self, positions: Array, *, complete: bool) -> Array:
        """Return the decision function, or log-probability, of each gesteme, shape (G,)."""
        scores = self.classifier.decision_function(shape_and_length(positions)[None])[0]
        # scikit-learn gives two classes one number.
        return np.asarray(scores if np.ndim(scores) else np.array([-scores, scores]))


@dataclass(frozen=True)
class OfWindows:
    """Extremely randomised trees on windows; the log-probabilities of all windows are added up."""

    trees: Any

    def classify(self, positions: Array, *, complete: bool) -> Array:
        """Return the sum of log-probabilities of each gesteme over the samples, shape (G,)."""
        return np.asarray(log_shares(self.trees, _windows(positions)).sum(axis=0))


def fit_svm(examples: Examples, _rng: np.random.Generator) -> OfVectors:
    """Fit `SVC` with a radial basis function to standardized vectors."""
    return _fitted(make_pipeline(StandardScaler(), SVC(C=10.0)), examples)


def fit_lda(examples: Examples, _rng: np.random.Generator) -> OfVectors:
    """Fit `LinearDiscriminantAnalysis` with Ledoit–Wolf shrinkage.

    Raises TooFewError with one example of each gesteme: nothing varies within a class then.
    """
    if all(len(own) == 1 for own in examples):
        raise TooFewError("one example of each gesteme, expected two of one at least")
    return _fitted(LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto"), examples)


def fit_trees(examples: Examples, rng: np.random.Generator) -> OfWindows:
    """Fit extremely randomised trees to the windows of all examples."""
    everything = [_windows(positions) for positions in flat(examples)]
    gestemes = np.repeat(labels(examples), [len(windows) for windows in everything])
    return OfWindows(fit_window_trees(np.concatenate(everything), gestemes, rng))


def _windows(positions: Array) -> Array:
    return FROM_START.features(positions, positions[0])


def _fitted(classifier: Any, examples: Examples) -> OfVectors:
    vectors = np.stack([shape_and_length(positions) for positions in flat(examples)])
    return OfVectors(classifier.fit(vectors, labels(examples)))
