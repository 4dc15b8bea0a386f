"""Learning the segment filter's model: gestemes, background level and alarm threshold.

What is a threshold is taken from demonstrations that the models at hand were not learned from.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.motion.steps import steps_of
from hmcs.recognition.gesteme_learning import LearningSettings, fit_gestemes
from hmcs.recognition.gestemes import GestemeBank, GestemeParameters, Scoring
from hmcs.recognition.layered import Layers
from hmcs.recognition.model import axes_of
from hmcs.recognition.segment_filter import SegmentFilter
from hmcs.recognition.segments import Segment
from hmcs.recognition.task_chain import chain_of
from hmcs.recognition.unknown import AlarmSettings
from hmcs.task import Task

Array = NDArray[np.float64]


def learn_layers(
    task: Task,
    segments: Sequence[Segment],
    settings: LearningSettings,
    progress: Callable[[str], None] = lambda _: None,
) -> Layers:
    """Return what the segment filter learns from segments that cover all gestemes of the task."""
    by_gesteme = [[s for s in segments if s.gesteme == g] for g in range(len(task.gestemes))]
    axes = axes_of(task)
    parameters = fit_gestemes(by_gesteme, axes, task.dead_zone_m, settings)
    longest = max(len(segment.steps) for segment in segments)
    window = int(min(settings.window_limit_steps, np.ceil(settings.window_factor * longest)))
    scoring = Scoring(0.0, settings.temperature, window, settings.prune_nats)
    progress("background level and alarm threshold from demonstrations left out")
    held_out = list(_held_out(by_gesteme, axes, task.dead_zone_m, settings))
    scoring = scoring._replace(background=_background(held_out, scoring, axes, settings))
    threshold = _alarm_threshold(held_out, scoring, axes, task, settings)
    return Layers(
        parameters, scoring, settings.filter, AlarmSettings(settings.alarm_window_steps, threshold)
    )


def check_layers(layers: Layers, task: Task) -> None:
    """Raise ValueError where the arrays do not fit together, or not the task."""
    shape = layers.parameters.initial.shape
    emissions = (*shape, 2 * len(axes_of(task)))
    for field, array in layers.parameters._asdict().items():
        expected = emissions if field in ("means", "variances") else shape
        if array.shape != expected or array.dtype != np.float64:
            raise ValueError(
                f"array {field!r} is {array.dtype} of shape {array.shape}, "
                f"expected float64 of shape {expected}"
            )
    if shape[:1] != (len(task.gestemes),) or not (layers.parameters.variances > 0).all():
        raise ValueError(
            f"its arrays are for {shape[0]} gestemes with positive variances, "
            f"its task has {len(task.gestemes)}"
        )


class _HeldOut(NamedTuple):
    """Segments of one round of leaving out, and the models learned from all others."""

    parameters: GestemeParameters
    segments: tuple[Segment, ...]


def _held_out(
    by_gesteme: Sequence[Sequence[Segment]],
    axes: Sequence[int],
    dead_zone_m: float,
    settings: LearningSettings,
) -> list[_HeldOut]:
    """Leave out one segment of each gesteme in turn; with one demonstration, leave out none."""
    rounds = max(len(own) for own in by_gesteme)
    result = []
    for r in range(rounds):
        kept = [[s for k, s in enumerate(own) if len(own) == 1 or k != r] for own in by_gesteme]
        left = tuple(own[r] for own in by_gesteme if r < len(own))
        result.append(_HeldOut(fit_gestemes(kept, axes, dead_zone_m, settings), left))
    return result


def _background(
    held_out: Sequence[_HeldOut], scoring: Scoring, axes: Sequence[int], settings: LearningSettings
) -> float:
    scores: list[float] = []
    for fold in held_out:
        for segment in fold.segments:
            # Nothing is pruned: the log-likelihood of the true hypothesis is wanted whatever it is.
            lenient = scoring._replace(prune_nats=np.inf, temperature=1.0)
            bank = GestemeBank(fold.parameters, lenient, axes, [segment.gesteme])
            for step in segment.steps:
                evidence = bank.step(step)
                scores.append(float(evidence.log_ratio[0]))
    return float(np.quantile(scores, settings.background_quantile)) - scoring.temperature


def _alarm_threshold(
    held_out: Sequence[_HeldOut],
    scoring: Scoring,
    axes: Sequence[int],
    task: Task,
    settings: LearningSettings,
) -> float:
    means: list[float] = []
    for fold in held_out:
        bank = GestemeBank(fold.parameters, scoring, axes, range(len(task.gestemes)))
        task_filter = SegmentFilter(chain_of(task, anywhere=True), settings.filter)
        steps = steps_of(_performed(_in_task_order(task, fold.segments)), task.dead_zone_m)
        scores = [task_filter.step(bank.step(step)).log_likelihood for step in steps]
        width = min(settings.alarm_window_steps, len(scores))
        means.extend(np.convolve(scores, np.full(width, 1.0 / width), mode="valid"))
    return float(np.quantile(means, settings.alarm_quantile))


def _in_task_order(task: Task, segments: Sequence[Segment]) -> list[Segment]:
    """Segments in the order of the task's most probable run; those it does not pass come last."""
    states = {state.name: state for state in task.states}
    here: str | None = max(task.start, key=task.start.__getitem__)
    order: list[str] = []
    while here is not None and here not in order:
        order.append(here)
        following = states[here].next
        here = max(following, key=following.__getitem__) if following else None
    rank = {name: k for k, state in enumerate(order) for name in states[state].gestemes}
    names = [gesteme.name for gesteme in task.gestemes]
    return sorted(segments, key=lambda segment: rank.get(names[segment.gesteme], len(order)))


def _performed(segments: Sequence[Segment]) -> Array:
    """Positions, m, shape (T, 3), of one hand that performs all segments one after another."""
    here = np.zeros(3)
    pieces = []
    for segment in segments:
        pieces.append(here + segment.positions - segment.positions[0])
        here = pieces[-1][-1]
    return np.concatenate(pieces)
