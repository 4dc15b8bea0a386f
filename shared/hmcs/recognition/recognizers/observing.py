"""What gesteme HMMs observe of the motion: its direction, raw or through a window (thesis 4.1.1).

Shapes: F features of an observation, K symbols, D symbols at a time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.motion.steps import Step

Array = NDArray[np.float64]

Observed = Literal["od", "md", "fft", "fourier", "direction"]
"""OD: directions through a code book. MD: each component of the direction in bins. FFT: MD on the
Fourier coefficients of windows of directions. Fourier: the same coefficients through a code book
(Yu 2005). Direction: the unit vector itself."""


class ObservationSettings(NamedTuple):
    """How motion becomes observations."""

    symbols: int = 25
    """K of the code book (OD, Fourier); fewer where there are not so many different directions."""
    bins: int = 10
    """K of each dimension (MD, FFT)."""
    window_steps: int = 6
    """Length of the Hamming window (FFT, Fourier)."""
    hop_steps: int = 3
    """A window begins so many steps after the one before it: 3 of 6 are an overlap of 50 %."""


class Observing(NamedTuple):
    """What a learned model observes."""

    window_steps: int
    """1: directions as they are."""
    hop_steps: int
    codebook: Array
    """The K features that symbols stand for, shape (K, F); (0, F) where there are none."""
    bins: int
    """K of each dimension; 0 where features are not put in bins."""
    lower: Array
    """Where the first bin of each feature begins, shape (F,)."""
    upper: Array
    """Where the last bin of each feature ends, shape (F,)."""

    @property
    def symbols(self) -> int | None:
        """K; None where observations are the features themselves."""
        return len(self.codebook) or self.bins or None


class Observer:
    """Turns steps, one at a time, into observations.

    A window is full from the first step on: before it the motion is taken to have had the
    direction of that step. So a gesteme of two steps can be observed, too.
    """

    def __init__(self, observing: Observing, axes: Sequence[int]) -> None:
        """Look at the `axes` of displacements only."""
        self._observing, self._axes = observing, list(axes)
        self._window = np.zeros((0, len(self._axes)))
        self._waiting = 0

    def step(self, step: Step, *, afresh: bool = False) -> NDArray[Any] | None:
        """Return what is observed with a step, shape (D,) or (F,); None between windows.

        With `afresh` the step is the first of a motion that has nothing to do with what came
        before.
        """
        direction = direction_of(step, self._axes)
        size = self._observing.window_steps
        if afresh or not len(self._window):
            self._window = np.repeat(direction[None], size, axis=0)
            self._waiting = 0
        else:
            self._window = np.concatenate([self._window[1:], direction[None]])
        due = self._waiting == 0
        self._waiting = (self._waiting + 1) % self._observing.hop_steps
        return quantized(features(self._window), self._observing) if due else None


def direction_of(step: Step, axes: Sequence[int]) -> Array:
    """Return the unit vector of a step along the axes, shape (D,); 0 for no motion along them."""
    move = step.displacement[list(axes)]
    length = float(np.linalg.norm(move))
    return np.asarray(move / length if length > 0 else move)


def features(window: Array) -> Array:
    """Return the features of the directions in a window, shape (T, D): of one, itself.

    Otherwise real and imaginary parts of the Fourier coefficients under a Hamming window over its
    sum, dimension by dimension, shape (D·T,) but for those that are always 0.
    """
    size = len(window)
    if size == 1:
        return np.asarray(window[0])
    weights = np.hamming(size)
    spectrum = np.fft.rfft(window.T * (weights / weights.sum()), axis=1)
    imaginary = spectrum.imag[:, 1 : (size + 1) // 2]
    return np.hstack([spectrum.real, imaginary]).ravel()


def quantized(seen: Array, observing: Observing) -> NDArray[Any]:
    """Return features of shape (F,) as symbols, shape (D,), or as they are."""
    if len(observing.codebook):
        distances = ((observing.codebook - seen) ** 2).sum(axis=1)
        return np.array([distances.argmin()])
    if observing.bins:
        shares = (seen - observing.lower) / (observing.upper - observing.lower)
        return np.asarray(np.clip(shares * observing.bins, 0, observing.bins - 1).astype(np.int64))
    return seen


def learn_observing(
    motions: Sequence[Sequence[Step]],
    axes: Sequence[int],
    observed: Observed,
    settings: ObservationSettings,
    rng: np.random.Generator,
) -> Observing:
    """Return how to observe motions like these."""
    windowed = observed in ("fft", "fourier")
    raw = Observing(
        settings.window_steps if windowed else 1,
        settings.hop_steps if windowed else 1,
        np.zeros((0, 0)),
        0,
        np.zeros(0),
        np.zeros(0),
    )
    seen = np.concatenate([observations(motion, raw, axes) for motion in motions])
    dimensions = seen.shape[1]
    raw = raw._replace(
        codebook=np.zeros((0, dimensions)), lower=np.zeros(dimensions), upper=np.ones(dimensions)
    )
    if observed in ("od", "fourier"):
        return raw._replace(codebook=_codebook(seen, settings.symbols, rng))
    if observed == "md":
        return raw._replace(bins=settings.bins, lower=-raw.upper)
    if observed == "fft":
        lower, upper = seen.min(axis=0), seen.max(axis=0)
        wide = np.maximum(upper - lower, 1e-6)
        return raw._replace(bins=settings.bins, lower=lower, upper=lower + wide)
    return raw


def observations(steps: Sequence[Step], observing: Observing, axes: Sequence[int]) -> NDArray[Any]:
    """Return all observations of a whole motion, shape (T, D) or (T, F)."""
    observer = Observer(observing, axes)
    seen = [observer.step(step) for step in steps]
    return np.array([each for each in seen if each is not None])


def _codebook(seen: Array, symbols: int, rng: np.random.Generator) -> Array:
    """Centers of k-means."""
    distinct = np.unique(seen, axis=0)
    centers = distinct[rng.choice(len(distinct), min(symbols, len(distinct)), replace=False)]
    for _ in range(100):
        owner = ((seen[:, None] - centers) ** 2).sum(axis=2).argmin(axis=1)
        moved = np.array(
            [
                seen[owner == k].mean(axis=0) if (owner == k).any() else c
                for k, c in enumerate(centers)
            ]
        )
        if (moved == centers).all():
            break
        centers = moved
    return centers
