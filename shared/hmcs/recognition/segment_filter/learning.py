"""Learning the segment filter's model: gestemes, background level and alarm threshold.

What is a threshold is taken from demonstrations that the models at hand were not learned from.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.steps import Step
from hmcs.recognition.model import axes_of
from hmcs.recognition.segment_filter.alignment import Alignment
from hmcs.recognition.segment_filter.exits import fit_exit
from hmcs.recognition.segment_filter.filter import SegmentFilter
from hmcs.recognition.segment_filter.gesteme_learning import LearningSettings, fit_gestemes
from hmcs.recognition.segment_filter.gestemes import (
    LONGEST_WINDOW_STEPS,
    GestemeBank,
    GestemeParameters,
    Scoring,
)
from hmcs.recognition.segment_filter.recognizer import SegmentFilterModel
from hmcs.recognition.segments import LearningError, Segment
from hmcs.recognition.task_chain import chain_of
from hmcs.recognition.unknown import fit_of, learn_alarm
from hmcs.task import Task


def learn_segment_filter(
    task: Task,
    segments: Sequence[Segment],
    settings: LearningSettings,
    progress: Callable[[str], None] = lambda _: None,
) -> SegmentFilterModel:
    """Return what the segment filter learns from segments that cover all gestemes of the task."""
    by_gesteme = [[s for s in segments if s.gesteme == g] for g in range(len(task.gestemes))]
    axes = axes_of(task)
    parameters = fit_gestemes(by_gesteme, axes, settings)
    window = _window(segments, settings, progress)
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
    width = settings.alarm_window_steps
    if settings.unknown_rise:
        level = learn_alarm(_fits(held_out, scoring, axes, task, settings), width).threshold
        rise = scoring.temperature * settings.unknown_rise * max(level, 0.0)
        scoring = scoring._replace(background=scoring.background + rise)
    alarm = learn_alarm(_fits(held_out, scoring, axes, task, settings), width)
    return SegmentFilterModel(parameters, scoring, settings.filter, alarm)


def _window(
    segments: Sequence[Segment], settings: LearningSettings, progress: Callable[[str], None]
) -> int:
    """How many steps back a start is remembered."""
    if not 1 <= settings.window_limit_steps <= LONGEST_WINDOW_STEPS:
        raise LearningError(
            f"window_limit_steps is {settings.window_limit_steps}, expected 1 to "
            f"{LONGEST_WINDOW_STEPS}: what lies farther back no process remembers"
        )
    longest = max(segments, key=lambda segment: len(segment.steps))
    steps = len(longest.steps)
    if steps >= settings.window_limit_steps and settings.window_limit_steps < LONGEST_WINDOW_STEPS:
        progress(
            f"{longest.demonstration} shows a gesteme of {steps} steps, but window_limit_steps is "
            f"{settings.window_limit_steps}: it is not recognized to its end; raise that setting"
        )
    return int(min(settings.window_limit_steps, np.ceil(settings.window_factor * steps)))


class _HeldOut(NamedTuple):
    """Segments of one round of leaving out, and the models learned from all others."""

    parameters: GestemeParameters
    segments: tuple[Segment, ...]


def _held_out(
    by_gesteme: Sequence[Sequence[Segment]], axes: Sequence[int], settings: LearningSettings
) -> list[_HeldOut]:
    """Leave out in turn all that one demonstration shows of a gesteme.

    With one demonstration of a gesteme nothing of it is left out.
    """
    shown = [_by_demonstration(own) for own in by_gesteme]
    result = []
    for r in range(max(len(groups) for groups in shown)):
        kept = [
            [s for k, group in enumerate(groups) if len(groups) == 1 or k != r for s in group]
            for groups in shown
        ]
        left = tuple(s for groups in shown if r < len(groups) for s in groups[r])
        result.append(_HeldOut(fit_gestemes(kept, axes, settings), left))
    return result


def _by_demonstration(segments: Sequence[Segment]) -> list[list[Segment]]:
    shown = dict.fromkeys(segment.demonstration_index for segment in segments)
    return [[s for s in segments if s.demonstration_index == index] for index in shown]


class _Track(NamedTuple):
    """A segment under the model of its own gesteme, its start known."""

    scores: Array
    """Log density of each step, nats, shape (T,)."""
    exits: Array
    """What the exit after each step is judged by, shape (T, 10)."""


def _track(
    parameters: GestemeParameters, scoring: Scoring, axes: Sequence[int], segment: Segment
) -> _Track:
    # Nothing is pruned or dropped: the log-likelihood of the true hypothesis is wanted whatever it
    # is, and however long the segment.
    lenient = scoring._replace(
        prune_nats=np.inf, temperature=1.0, background=0.0, window_steps=len(segment.steps) + 1
    )
    bank = GestemeBank(parameters, lenient, axes, [segment.gesteme])
    scores, exits = [], []
    for k, step in enumerate(segment.steps):
        scores.append(float(bank.step(step._replace(index=k)).log_ratio[0]))
        exits.append(bank.exit_features[0])
        # Its start is known: no other one is of interest.
        bank.keep_only(0)
    return _Track(np.array(scores), np.array(exits))


def _fits(
    held_out: Sequence[_HeldOut],
    scoring: Scoring,
    axes: Sequence[int],
    task: Task,
    settings: LearningSettings,
) -> list[Array]:
    """How well each performance of segments left out fits the task, (T,) each; see `unknown`."""
    result = []
    for fold in held_out:
        bank = GestemeBank(fold.parameters, scoring, axes, range(len(task.gestemes)))
        task_filter = SegmentFilter(chain_of(task, anywhere=True), settings.filter)
        beliefs = [
            task_filter.step(bank.step(step))
            for step in _performed(_in_task_order(task, fold.segments))
        ]
        series = np.array([(belief.log_likelihood, belief.unknown) for belief in beliefs])
        result.append(fit_of(series[:, 0], series[:, 1]))
    return result


def _in_task_order(task: Task, segments: Sequence[Segment]) -> list[Segment]:
    """Segments in the order of the task's most probable run; those it does not pass come last."""
    states = {state.name: state for state in task.states}
    here: str | None = max(task.start, key=task.start.__getitem__)
    order: list[str] = []
    while here is not None and here not in order:
        order.append(here)
        following = states[here].next
        here = max(following, key=following.__getitem__) if following else None
    rank = {name: k for k, name in enumerate(order)}
    names = [state.name for state in task.states]
    return sorted(segments, key=lambda segment: rank.get(names[segment.state], len(order)))


def _performed(segments: Sequence[Segment]) -> list[Step]:
    """The steps of one hand that performs all segments one after another."""
    here, steps = np.zeros(3), list[Step]()
    for step in (step for segment in segments for step in segment.steps):
        steps.append(step._replace(index=len(steps), position=here))
        here = here + step.displacement
    return steps
