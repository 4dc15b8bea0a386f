"""From state probabilities to what a recognizer says of a step."""

from __future__ import annotations

import math

from hmcs.arrays import Array
from hmcs.recognition.recognizer import Recognition, TaskBelief
from hmcs.recognition.unknown import AlarmSettings, UnknownAlarm

MEAN_STEPS = 20
"""The mean log-likelihood is taken over so many steps."""


class BeliefBuilder:
    """Says what is believed by a method that knows neither unknown motion nor an alarm."""

    def __init__(self) -> None:
        self._mean = UnknownAlarm(AlarmSettings(MEAN_STEPS, -math.inf, -math.inf))
        self._state: int | None = None
        self._since = 0

    def recognition(
        self,
        step: int,
        states: Array,
        gestemes: Array,
        log_likelihood: float,
        start: int | None = None,
    ) -> Recognition:
        """Return what is believed after a step.

        `states` is P(state), shape (S,); `gestemes` how probable each gesteme is together with the
        state, up to a factor, shape (S, M); `start` the step the segment began with, or None for
        the step at which the most probable state became so.
        """
        likely = int(states.argmax())
        if likely != self._state:
            self._state, self._since = likely, step
        belief = TaskBelief(
            step=step,
            states=states,
            unknown=0.0,
            gesteme=int(gestemes[likely].argmax()),
            segment_start=self._since if start is None else start,
            log_likelihood=log_likelihood,
            missing=(),
        )
        return Recognition(belief, *self._mean.step(log_likelihood, 0.0))
