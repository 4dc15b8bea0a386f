"""Recognizers in process: objects that turn steps into beliefs.

A recognizer is anything with `step(Step) -> Recognition`. The services wrap the very classes used
here, so what runs over the bus is what runs in process.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.motion.steps import Step

Integers = NDArray[np.int32]
Precision = Literal["float32", "float64"]
"""Of evidence on its way from layer to layer."""

_log = logging.getLogger(__name__)
_TOLERANCE = 1e-3
"""How far the sum of probabilities may be from one."""


class StepEvidence(NamedTuple):
    """What gesteme models make of one step: a sparse list of living (gesteme, start) pairs."""

    step: int
    """t."""
    gestemes: tuple[int, ...]
    """Indices into the model of the gestemes held, with or without a living pair."""
    pair_gesteme: Integers
    """Index into the model, shape (p,)."""
    pair_start: Integers
    """Start step s, shape (p,); pairs are ordered by start, then gesteme."""
    exit: Array
    """P(leaving before step t | steps s..t−1), 0 for s = t, shape (p,)."""
    log_ratio: Array
    """Tempered log-likelihood ratio of step t to the background given no exit, shape (p,)."""

    def rounded(self, precision: Precision) -> StepEvidence:
        """Return the evidence as doubles that a message of this precision can carry."""
        return self._replace(
            exit=_rounded(self.exit, precision), log_ratio=_rounded(self.log_ratio, precision)
        )

    def without(self, gestemes: Collection[int]) -> StepEvidence:
        """Return the evidence as if nothing held the gestemes of these indices."""
        kept = ~np.isin(self.pair_gesteme, list(gestemes))
        return StepEvidence(
            self.step,
            tuple(g for g in self.gestemes if g not in gestemes),
            self.pair_gesteme[kept],
            self.pair_start[kept],
            self.exit[kept],
            self.log_ratio[kept],
        )


class TaskBelief(NamedTuple):
    """What is believed after a step."""

    step: int
    """t."""
    states: Array
    """P(state | steps 0..t), shape (S,)."""
    unknown: float
    """P(no part of the task | steps 0..t)."""
    gesteme: int
    """Index of the most probable gesteme of the most probable state."""
    segment_start: int
    """The most probable start step of the most probable state's segment."""
    log_likelihood: float
    """log P(step t | steps 0..t−1) against the background level, nats."""
    missing: tuple[int, ...]
    """Indices of the task's gestemes that no evidence came for."""


class Recognition(NamedTuple):
    """What is believed after a step, and whether it is believed at all."""

    belief: TaskBelief
    mean_log_likelihood: float
    """How well the last steps fit the task: mean over the alarm window, nats."""
    unknown_alarm: bool
    """True where that mean is below the model's threshold."""
    evidence: StepEvidence | None = None
    """What the gesteme models made of the step; None where there is no such layer below."""


class Recognizer(Protocol):
    """Turns steps into beliefs."""

    def step(self, step: Step) -> Recognition:
        """Take the next step; steps come in order, without gaps."""
        ...


PassEvidence = Callable[[StepEvidence], StepEvidence]
"""From the evidence the gesteme level made of a step to that which reaches the task level."""


class BadStepError(ValueError):
    """A step that no recognizer may be shown; nothing changes by it."""


class Guarded:
    """Shows a recognizer only steps that are steps, in order and without gaps.

    A recognizer that raises, or believes in what are no probabilities, may be left in any state:
    with the next step another one begins.
    """

    def __init__(
        self,
        recognizer: Recognizer,
        anew: Callable[[], Recognizer] | None = None,
        tell: Callable[[str], None] = _log.warning,
    ) -> None:
        """Guard a recognizer; `anew` makes the one that takes its place after it raised.

        It should be one that may begin in any state. Without it the same recognizer goes on.
        `tell` receives a sentence when one begins anew: which step failed, and how.
        """
        self._recognizer = recognizer
        self._anew = anew
        self._tell = tell
        self._next: int | None = None
        self._failure: str | None = None
        self._told = False

    def step(self, step: Step) -> Recognition:
        """Take the next step.

        Raises BadStepError for a step out of order, or with a position, displacement or sense
        that is not finite or of another shape: nothing changes by it. Raises what the recognizer
        raises, or FloatingPointError for a belief that is none; the next step, whichever it is, is
        then the first of one that begins anew.
        """
        if self._next is not None and step.index != self._next:
            raise BadStepError(f"step {step.index} came, expected {self._next}")
        for field, shape in _SHAPES.items():
            value = getattr(step, field)
            if value is None and field in _OPTIONAL:
                continue
            if np.shape(value) != shape or not np.isfinite(value).all():
                raise BadStepError(
                    f"step {step.index}: {field} is {value!r}, expected finite numbers of shape "
                    f"{shape}"
                )
        if self._failure is not None:
            self._begin_anew(step.index)
        try:
            recognition = self._recognizer.step(step)
            _check(recognition)
        except Exception as error:
            self._next, self._failure = None, f"step {step.index}: {error!r}"
            raise
        self._next, self._told = step.index + 1, False
        return recognition

    def _begin_anew(self, index: int) -> None:
        if self._anew is not None:
            self._recognizer = self._anew()
        if not self._told:
            self._tell(f"the recognizer failed ({self._failure}): it begins anew with step {index}")
        # One that fails at every step is reported once.
        self._failure, self._told = None, True


def _rounded(values: Array, precision: Precision) -> Array:
    return values.astype(precision, copy=False).astype(np.float64, copy=False)


def _check(recognition: Recognition) -> None:
    """Raise FloatingPointError for a belief whose numbers are no probabilities."""
    if isinstance(recognition, Recognition):
        belief = recognition.belief
        total = float(np.sum(belief.states)) + belief.unknown
        if not (abs(total - 1.0) <= _TOLERANCE and np.isfinite(belief.log_likelihood)):
            raise FloatingPointError(
                f"the probabilities of all states sum to {total:g}, at a log-likelihood of "
                f"{belief.log_likelihood:g}"
            )


_SHAPES = {"position": (3,), "displacement": (3,), "orientation": (4,), "wrench": (6,)}
_OPTIONAL = ("orientation", "wrench")
