"""Learning the segment filter's model: gestemes, background level and alarm threshold.

What is a threshold is taken from demonstrations that the models at hand were not learned from.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.motion.steps import steps_of
from hmcs.recognition.alignment import Alignment
from hmcs.recognition.exits import DEFAULT_WEIGHTS, fit_exit
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
    parameters = fit_gestemes(by_gesteme, axes, settings)
    longest = max(len(segment.steps) for segment in segments)
    window = int(min(settings.window_limit_steps, np.ceil(settings.window_factor * longest)))
    aligned = Alignment(settings.alignment_sigma, settings.temperature)
    scoring = Scoring(0.0, settings.temperature, window, settings.prune_nats, aligned)
    progress("background level and alarm threshold from demonstrations left out")
    held_out = list(_held_out(by_gesteme, axes, settings))
    tracks = [_track(fold.parameters, scoring, axes, s) for fold in held_out for s in fold.segments]
    if any(len(own) > 1 for own in by_gesteme):
        ends = [np.arange(len(t.scores)) == len(t.scores) - 1 for t in tracks]
        weights = fit_exit(np.concatenate([t.exits for t in tracks]), np.concatenate(ends))
        parameters = parameters._replace(exit_weights=weights)
        held_out = [
            _HeldOut(f.parameters._replace(exit_weights=weights), f.segments) for f in held_out
        ]
    scores = np.concatenate([t.scores for t in tracks])
    lowest = float(np.quantile(scores, settings.background_quantile))
    scoring = scoring._replace(background=lowest - scoring.temperature)
    threshold = _alarm_threshold(held_out, scoring, axes, task, settings)
    return Layers(
        parameters, scoring, settings.filter, AlarmSettings(settings.alarm_window_steps, threshold)
    )


def check_layers(layers: Layers, task: Task) -> None:
    """Raise ValueError where the arrays do not fit together, or not the task."""
    p = layers.parameters
    shape, dimensions = p.initial.shape, len(axes_of(task))
    variants = p.ends.shape[:2]
    expected = {
        "means": (*shape, 2 * dimensions),
        "variances": (*shape, 2 * dimensions),
        "ends": (*variants, dimensions),
        "normals": (*variants, dimensions),
        "exit_weights": DEFAULT_WEIGHTS.shape,
    }
    for field, value in p._asdict().items():
        if field == "step_m":
            continue
        kind = np.int32 if field == "variant" else np.float64
        wanted = expected.get(field, shape)
        if value.shape != wanted or value.dtype != kind:
            raise ValueError(
                f"array {field!r} is {value.dtype} of shape {value.shape}, "
                f"expected {np.dtype(kind)} of shape {wanted}"
            )
    if shape[:1] != (len(task.gestemes),) or not (p.variances > 0).all():
        raise ValueError(
            f"its arrays are for {shape[0]} gestemes with positive variances, "
            f"its task has {len(task.gestemes)}"
        )
    if not p.step_m > 0 or variants[0] != shape[0] or (p.variant >= variants[1]).any():
        raise ValueError("its variants or its step length are none")


class _HeldOut(NamedTuple):
    """Segments of one round of leaving out, and the models learned from all others."""

    parameters: GestemeParameters
    segments: tuple[Segment, ...]


def _held_out(
    by_gesteme: Sequence[Sequence[Segment]], axes: Sequence[int], settings: LearningSettings
) -> list[_HeldOut]:
    """Leave out one segment of each gesteme in turn; with one demonstration, leave out none."""
    rounds = max(len(own) for own in by_gesteme)
    result = []
    for r in range(rounds):
        kept = [[s for k, s in enumerate(own) if len(own) == 1 or k != r] for own in by_gesteme]
        left = tuple(own[r] for own in by_gesteme if r < len(own))
        result.append(_HeldOut(fit_gestemes(kept, axes, settings), left))
    return result


class _Track(NamedTuple):
    """A segment under the model of its own gesteme, its start known."""

    scores: Array
    """Log density of each step, nats, shape (T,)."""
    exits: Array
    """What the exit after each step is judged by, shape (T, 10)."""


def _track(
    parameters: GestemeParameters, scoring: Scoring, axes: Sequence[int], segment: Segment
) -> _Track:
    # Nothing is pruned: the log-likelihood of the true hypothesis is wanted whatever it is.
    lenient = scoring._replace(prune_nats=np.inf, temperature=1.0, background=0.0)
    bank = GestemeBank(parameters, lenient, axes, [segment.gesteme])
    scores, exits = [], []
    for k, step in enumerate(segment.steps):
        scores.append(float(bank.step(step._replace(index=k)).log_ratio[0]))
        exits.append(bank.exit_features[0])
    return _Track(np.array(scores), np.array(exits))


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
