"""What gesteme HMMs observe of the motion: its direction, raw or through a window (thesis 4.1.1).

Shapes: T steps, F features of an observation, D symbols at a time of K kinds.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.motion.steps import Step
from hmcs.recognition.checking import LARGEST, check_shapes, check_spreads, check_within
from hmcs_baselines.symbols import (
    Bins,
    Codebook,
    Fourier,
    FourierWindow,
    direction_bins,
    fit_bins,
    fit_codebook,
)

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
    fourier: Fourier = Fourier()
    """The windows (FFT, Fourier)."""


class Observing(NamedTuple):
    """What a learned model observes."""

    fourier: Fourier | None
    """The windows that directions are seen through; None: as they are."""
    encoding: Codebook | Bins | None
    """The symbols that features become; None: observations are the features themselves."""

    @property
    def symbols(self) -> int | None:
        """K; None where there are no symbols."""
        if self.encoding is None:
            return None
        if isinstance(self.encoding, Bins):
            return self.encoding.count
        return len(self.encoding.centers)


LONGEST_WINDOW_STEPS = 1_000
"""Of a Fourier window."""
MOST_SYMBOLS = 100_000


def check_observing(observing: Observing, axes: int) -> int:
    """Return how many features of so many axes are observed.

    Raises ValueError where windows, code book or bins are none, or for other features.
    """
    fourier, encoding = observing
    features = axes
    if fourier is not None:
        check_within("window_steps", fourier.window_steps, 1, LONGEST_WINDOW_STEPS)
        check_within("hop_steps", fourier.hop_steps, 1, LONGEST_WINDOW_STEPS)
        whole = fourier.kept == "complex"
        features *= fourier.window_steps if whole else fourier.window_steps // 2 + 1
    if isinstance(encoding, Codebook):
        check_shapes(encoding._asdict(), {"centers": (len(encoding.centers), features)})
        check_within("centers", encoding.centers, -LARGEST, LARGEST)
        check_within("number of centers", len(encoding.centers), 1, MOST_SYMBOLS)
    elif isinstance(encoding, Bins):
        check_shapes(encoding._asdict(), {"lower": (features,), "upper": (features,)})
        check_within("lower", encoding.lower, -LARGEST, LARGEST)
        check_spreads("upper - lower", encoding.upper - encoding.lower)
        check_within("count", encoding.count, 1, MOST_SYMBOLS)
    return features


class Observer:
    """Turns steps, one at a time, into observations.

    A window is full from the first step on: before it the motion is taken to have had the
    direction of that step. So a gesteme of two steps can be observed, too.
    """

    def __init__(self, observing: Observing, axes: Sequence[int]) -> None:
        """Look at the `axes` of displacements only."""
        self._axes = list(axes)
        self._encoding = observing.encoding
        self._window = None if observing.fourier is None else FourierWindow(observing.fourier)

    def step(self, step: Step, *, afresh: bool = False) -> NDArray[Any] | None:
        """Return what is observed with a step, shape (D,) or (F,); None between windows.

        With `afresh` the step is the first of a motion that has nothing to do with what came
        before.
        """
        direction = direction_of(step, self._axes)
        if afresh and self._window is not None:
            self._window.reset()
        seen = direction if self._window is None else self._window.push(direction)
        if seen is None or self._encoding is None:
            return seen
        return np.atleast_1d(self._encoding.encode(seen[None])[0])


def direction_of(step: Step, axes: Sequence[int]) -> Array:
    """Return the unit vector of a step along the axes, shape (D,); 0 for no motion along them."""
    move = step.displacement[list(axes)]
    length = float(np.linalg.norm(move))
    return np.asarray(move / length if length > 0 else move)


def learn_observing(
    motions: Sequence[Sequence[Step]],
    axes: Sequence[int],
    observed: Observed,
    settings: ObservationSettings,
    rng: np.random.Generator,
) -> Observing:
    """Return how to observe motions like these."""
    plain = Observing(settings.fourier if observed in ("fft", "fourier") else None, None)
    if observed == "direction":
        return plain
    if observed == "md":
        return plain._replace(encoding=direction_bins(len(axes), settings.bins))
    seen = [observations(motion, plain, axes) for motion in motions]
    if observed == "fft":
        return plain._replace(encoding=fit_bins(seen, settings.bins))
    distinct = np.unique(np.concatenate(seen), axis=0)
    few = len(distinct) <= settings.symbols
    book = Codebook(distinct) if few else fit_codebook(seen, rng, symbols=settings.symbols)
    return plain._replace(encoding=book)


def observations(steps: Sequence[Step], observing: Observing, axes: Sequence[int]) -> NDArray[Any]:
    """Return all observations of a whole motion, shape (T, D) or (T, F)."""
    observer = Observer(observing, axes)
    seen = [observer.step(step) for step in steps]
    return np.array([each for each in seen if each is not None])
