"""Unknown intent: motion that is no part of the task, found by the total likelihood (thesis 4.3).

"The total probability drops rapidly when unexpected gestemes are identified": how well the last
steps fit the task is compared with a threshold learned from demonstrations that the models were
not learned from. A step fits by log P(step, and still part of the task | steps before); one odd
step of a known motion cannot spoil a window, since it counts as no worse than a floor.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array

LEAST_KNOWN = 1e-6
"""P(part of the task) is held to be no less than this."""

_FLOOR_SPREADS, _WINDOW_SPREADS = 5.0, 4.0
_QUANTILE = 0.01
_T90 = (3.078, 1.886, 1.638, 1.533, 1.476, 1.440, 1.415, 1.397, 1.383, 1.372)
"""Student's t, one-sided 90 %, for 1, 2, … degrees of freedom; 1.3 beyond."""


class AlarmSettings(NamedTuple):
    """When motion is called unknown."""

    window_steps: int
    """The mean is taken over so many steps."""
    threshold: float
    """Below this mean, nats per step, motion is unknown."""
    floor: float
    """No step counts as worse than this, nats."""


class UnknownAlarm:
    """A sliding mean of how well steps fit the task, against a threshold."""

    def __init__(self, settings: AlarmSettings) -> None:
        self._settings = settings
        self._recent: deque[float] = deque(maxlen=settings.window_steps)

    def step(self, log_likelihood: float, unknown: float) -> tuple[float, bool]:
        """Return the mean over the window and whether it is an alarm; none before it is full.

        `log_likelihood` is that of the step given all before it, nats; `unknown` is P(no part of
        the task) after it.
        """
        self._recent.append(max(float(fit_of(log_likelihood, unknown)), self._settings.floor))
        mean = sum(self._recent) / len(self._recent)
        full = len(self._recent) == self._settings.window_steps
        return mean, full and mean < self._settings.threshold


def fit_of(log_likelihood: Array | float, unknown: Array | float) -> Array:
    """Return log P(step, and still part of the task | steps before), nats."""
    known = np.maximum(1.0 - np.asarray(unknown), LEAST_KNOWN)
    return np.asarray(log_likelihood + np.log(known))


def learn_alarm(fits: Sequence[Array], window_steps: int) -> AlarmSettings:
    """Return the alarm that about one window in a hundred of task motion raises.

    `fits` are those of the steps of performances that the models were not learned from, one array
    each. The threshold is the lower of two: four standard deviations below the mean of all
    windows, and the 1 % quantile of a performance as a new one may have it, a one-sided 90 %
    prediction bound from those seen: one odd performance widens the margin instead of moving it.
    """
    steps = np.concatenate(fits)
    floor = float(steps.mean() - _FLOOR_SPREADS * steps.std())
    windows = [_windows(np.maximum(own, floor), window_steps) for own in fits]
    pooled = np.concatenate(windows)
    threshold = float(pooled.mean() - _WINDOW_SPREADS * pooled.std())
    if len(windows) > 1:
        lowest = np.array([np.quantile(own, _QUANTILE) for own in windows])
        freedom = len(windows) - 1
        t = _T90[freedom - 1] if freedom <= len(_T90) else 1.3
        bound = lowest.mean() - t * lowest.std(ddof=1) * np.sqrt(1.0 + 1.0 / len(windows))
        threshold = min(threshold, float(bound))
    return AlarmSettings(window_steps, threshold, floor)


def _windows(values: Array, width: int) -> Array:
    """Means over `width` steps in a row, or over all where there are fewer."""
    width = min(width, len(values))
    return np.convolve(values, np.full(width, 1.0 / width), mode="valid")
