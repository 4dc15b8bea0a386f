"""Unknown intent: motion that is no part of the task, told by the total likelihood (thesis 4.3).

"The total probability drops rapidly when unexpected gestemes are identified": the mean of the
filter's log-likelihood over the last steps is compared with a threshold learned from
demonstrations that the models were not trained on.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple


class AlarmSettings(NamedTuple):
    """When motion is called unknown."""

    window_steps: int
    """The mean is taken over so many steps."""
    threshold: float
    """Below this mean, nats per step, motion is unknown."""


class UnknownAlarm:
    """A sliding mean of log-likelihoods against a threshold."""

    def __init__(self, settings: AlarmSettings) -> None:
        self._settings = settings
        self._recent: deque[float] = deque(maxlen=settings.window_steps)

    def step(self, log_likelihood: float) -> tuple[float, bool]:
        """Return the mean over the window and whether it is an alarm; none before it is full."""
        self._recent.append(log_likelihood)
        mean = sum(self._recent) / len(self._recent)
        full = len(self._recent) == self._settings.window_steps
        return mean, full and mean < self._settings.threshold
