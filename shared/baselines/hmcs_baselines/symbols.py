"""Observation symbols of motion directions: OD, MD and FFT (thesis 4.1.1).

OD: the nearest of a code book of directions. MD: each component of the direction in equal bins.
FFT: the direction's components Fourier-transformed in overlapping windows, then in bins. Yu's
Fourier features (Yu et al. 2005) are the same windows through a code book.
Shapes: T directions, D axes, W windows, F features, K symbols.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs_baselines.clustering import assign, k_means

Integers = NDArray[np.intp]


class SymbolError(UserError):
    """Directions that cannot become symbols; says why, and what to do."""


class Codebook(NamedTuple):
    """What one-dimensional symbols stand for."""

    centers: Array
    """Shape (K, F)."""

    def encode(self, features: ArrayLike) -> Integers:
        """Return the nearest center of each of the features (T, F), shape (T,).

        Raises SymbolError when features are of another number or not finite.
        """
        return assign(_checked(features, self.centers.shape[1]), self.centers)


class Bins(NamedTuple):
    """Equal bins for every feature."""

    lower: Array
    """Where the first bin begins, shape (F,)."""
    upper: Array
    """Where the last bin ends, shape (F,)."""
    count: int  # type: ignore[assignment]  # tuple.count is of no use here
    """K, of every feature."""

    def encode(self, features: ArrayLike) -> Integers:
        """Return the bin of every feature (T, F), from 0 to K − 1, shape (T, F).

        What lies outside counts as in the first or the last bin. Raises as `Codebook.encode`.
        """
        seen = _checked(features, len(self.lower))
        share = (seen - self.lower) / (self.upper - self.lower)
        return np.asarray(np.clip(np.floor(share * self.count), 0, self.count - 1).astype(np.intp))


class Fourier(NamedTuple):
    """Windows of directions and what is kept of their Fourier transform."""

    window_steps: int = 6
    """Length of the Hamming window."""
    hop_steps: int = 3
    """From one window to the next: 3 of 6 are an overlap of 50 %."""
    kept: Literal["complex", "magnitude"] = "complex"
    """Real and imaginary parts, but those that are always zero, or absolute values. The thesis
    does not say; absolute values know no direction of motion and are far worse."""


def fit_codebook(
    features: Sequence[ArrayLike],
    rng: np.random.Generator,
    *,
    symbols: int = 25,
    restarts: int = 1,
) -> Codebook:
    """Return the code book of training sequences of directions or features, shapes (T_i, F).

    k-means over all of them together. Raises SymbolError when there are none, and ClusteringError
    when there are fewer distinct ones than symbols.
    """
    return Codebook(k_means(_joined(features), symbols, rng, restarts=restarts).centers)


def direction_bins(axes: int, count: int = 10) -> Bins:
    """Return MD's bins of unit vectors: `count` over [−1, 1] for each axis, of width 2/count."""
    return Bins(-np.ones(axes), np.ones(axes), count)


def fit_bins(features: Sequence[ArrayLike], count: int = 10) -> Bins:
    """Return `count` equal bins over the range of each feature in training, shapes (T_i, F).

    A feature that is the same everywhere gets bins of a width of 1/count around it, so that it is
    always in one. Raises SymbolError when there are no features.
    """
    seen = _joined(features)
    lower, upper = seen.min(axis=0), seen.max(axis=0)
    half = np.where(upper > lower, 0.0, 0.5)
    return Bins(lower - half, upper + half, count)


def fourier_features(directions: ArrayLike, fourier: Fourier = Fourier()) -> Array:  # noqa: B008  frozen
    """Return the features of every window of a sequence of directions (T, D), shape (W, F).

    A window ends at steps 0, hop, 2·hop, … so W = ⌈T / hop⌉; before the first step the motion is
    taken to have had its direction. So every sequence, however short, and the first steps of any
    have features, and they need no later step: the windows of a part are those of the whole.
    Each axis under the Hamming window is Fourier-transformed; features are those of the first
    axis, then of the next. Raises SymbolError when there is no direction or one is not finite.
    """
    seen = _checked(directions, None)
    if not len(seen):
        raise SymbolError("no directions to transform: give one at least")
    padded = np.concatenate([np.repeat(seen[:1], fourier.window_steps - 1, axis=0), seen])
    windows = np.lib.stride_tricks.sliding_window_view(padded, fourier.window_steps, axis=0)
    return _transformed(windows[:: fourier.hop_steps], fourier)


class FourierWindow:
    """The same features step by step."""

    def __init__(self, fourier: Fourier = Fourier()) -> None:  # noqa: B008  frozen
        self._fourier = fourier
        self.reset()

    def reset(self) -> None:
        """Forget everything: the next direction is the first."""
        self._window: Array | None = None
        self._count = 0

    def push(self, direction: ArrayLike) -> Array | None:
        """Take a direction, shape (D,); return the features (F,) of the window it ends, if any.

        Raises SymbolError when it is not finite or has other axes than the one before; nothing
        changes then.
        """
        axes = None if self._window is None else self._window.shape[1]
        seen = _checked(np.asarray(direction, dtype=float)[None], axes)
        if self._window is None:
            self._window = np.repeat(seen, self._fourier.window_steps, axis=0)
        else:
            self._window = np.concatenate([self._window[1:], seen])
        due = self._count % self._fourier.hop_steps == 0
        self._count += 1
        return _transformed(self._window.T[None], self._fourier)[0] if due else None


def _transformed(windows: Array, fourier: Fourier) -> Array:
    """Features (W, F) of windows (W, D, steps)."""
    size = fourier.window_steps
    spectrum = np.fft.rfft(windows * np.hamming(size), axis=2)
    if fourier.kept == "magnitude":
        parts = np.abs(spectrum)
    else:
        parts = np.concatenate([spectrum.real, spectrum.imag[:, :, 1 : (size + 1) // 2]], axis=2)
    return np.asarray(parts.reshape(len(windows), -1))


def _joined(features: Sequence[ArrayLike]) -> Array:
    sequences = [np.asarray(one, dtype=float) for one in features]
    if not sum(len(one) for one in sequences):
        raise SymbolError("no features to learn symbols from: give one sequence at least")
    return _checked(
        np.concatenate([_checked(one, sequences[0].shape[-1]) for one in sequences]), None
    )


def _checked(features: ArrayLike, wanted: int | None) -> Array:
    seen = np.asarray(features, dtype=float)
    if seen.ndim != 2 or (wanted is not None and seen.shape[1] != wanted):
        expected = "(T, F)" if wanted is None else f"(T, {wanted})"
        raise SymbolError(
            f"directions or features have shape {seen.shape}: give them as {expected}"
        )
    finite = np.isfinite(seen).all(axis=1)
    if not finite.all():
        raise SymbolError(
            f"a value is not finite at step {int((~finite).argmax())}: leave it out or mend it"
        )
    return seen
