"""Learning a model from labeled demonstrations of a task (thesis 4.1.1).

Each gesteme becomes a left-right Gaussian HMM on (displacement from the segment's start,
direction): phases of equal path length over the demonstrations' mean, variances shrunk toward
those of all gestemes together so that one demonstration is enough to start (MAP), and floors below
which no agreement between demonstrations is believed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.errors import UserError
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.paths import mean_path
from hmcs.motion.steps import Step, steps_of
from hmcs.recognition.gestemes import GestemeBank, GestemeParameters, Scoring
from hmcs.recognition.hmm.learning import GaussianHmm, baum_welch
from hmcs.recognition.model import AXES, Model, chain_of
from hmcs.recognition.segment_filter import FilterSettings, SegmentFilter
from hmcs.recognition.unknown import AlarmSettings
from hmcs.task import Task

Array = NDArray[np.float64]
Progress = Callable[[str], None]


class LearningError(UserError):
    """Demonstrations that a model cannot be learned from; says which, why, and what to do."""


class LearningSettings(NamedTuple):
    """The choices of learning; defaults are good without tuning."""

    phases_per_step: float = 0.5
    """Phases of a gesteme for each step of its demonstrations' mean length."""
    phases_at_least: int = 3
    position_floor_dead_zones: float = 1.0
    """Standard deviation of positions never below so many dead zones."""
    direction_floor: float = 0.2
    """Standard deviation of unit directions never below this."""
    prior_demonstrations: float = 4.0
    """The variances of all gestemes together count as much as so many demonstrations."""
    prior_position_share: float = 0.05
    """With one demonstration: standard deviation of positions as a share of the path's length."""
    prior_direction: float = 0.3
    """With one demonstration: standard deviation of unit directions."""
    refine_iterations: int = 3
    """Iterations of Baum–Welch on means and variances after the alignment by path length."""
    temperature: float = 4.0
    """See `Scoring`."""
    background_quantile: float = 0.01
    """The background is one temperature below this quantile of the log-likelihoods of steps of
    demonstrations left out of learning."""
    prune_nats: float = 30.0
    window_factor: float = 2.0
    """The window is so many times the longest gesteme of the demonstrations..."""
    window_limit_steps: int = 300
    """...but at most this."""
    alarm_window_steps: int = 20
    alarm_quantile: float = 0.01
    """The alarm's threshold is this quantile of window means on demonstrations left out."""


class Segment(NamedTuple):
    """One performance of one gesteme."""

    demonstration: str
    gesteme: int
    positions: Array
    """m, shape (T, 3)."""
    steps: tuple[Step, ...]


def learn(
    task: Task,
    demonstrations: Sequence[Demonstration],
    settings: LearningSettings = LearningSettings(),  # noqa: B008  frozen
    *,
    filter_settings: FilterSettings = FilterSettings(),  # noqa: B008  frozen
    progress: Progress = lambda _: None,
) -> Model:
    """Return the model of the task learned from labeled demonstrations; `hash` is left empty.

    Raises LearningError when there are no demonstrations, a label is no state of the task, a
    gesteme has no demonstration, or a segment is too short to hold two steps.
    """
    segments = segments_of(task, demonstrations)
    by_gesteme = [[s for s in segments if s.gesteme == g] for g in range(len(task.gestemes))]
    for gesteme, own in zip(task.gestemes, by_gesteme, strict=True):
        if not own:
            raise LearningError(
                f"gesteme {gesteme.name!r} of task {task.name!r} has no demonstration: "
                "add one with its label"
            )
        progress(f"{gesteme.name}: {len(own)} demonstrations")
    axes = tuple(AXES[axis] for axis in task.recognition.axes)
    parameters = fit_gestemes(by_gesteme, axes, task.dead_zone_m, settings)

    longest = max(len(segment.steps) for segment in segments)
    window = int(min(settings.window_limit_steps, np.ceil(settings.window_factor * longest)))
    scoring = Scoring(0.0, settings.temperature, window, settings.prune_nats)
    progress("background level and alarm threshold from demonstrations left out")
    held_out = list(_held_out(by_gesteme, axes, task.dead_zone_m, settings))
    scoring = scoring._replace(background=_background(held_out, scoring, axes, settings))
    threshold = _alarm_threshold(held_out, scoring, axes, task, filter_settings, settings)
    paths = [mean_path([segment.positions for segment in own]) for own in by_gesteme]
    return Model(
        name=task.name,
        hash="",
        task=task,
        parameters=parameters,
        scoring=scoring,
        filter_settings=filter_settings,
        alarm=AlarmSettings(settings.alarm_window_steps, threshold),
        path_points=tuple(points for points, _ in paths),
        path_spreads=tuple(spread for _, spread in paths),
        demonstrations=tuple(d.name for d in demonstrations),
    )


def segments_of(task: Task, demonstrations: Sequence[Demonstration]) -> list[Segment]:
    """Cut demonstrations at their labels.

    A label is a state's name, or `state/gesteme` where a state has several gestemes; unlabeled
    stretches are left out. Raises LearningError as `learn`.
    """
    if not demonstrations:
        raise LearningError(f"no demonstrations of task {task.name!r}: give at least one")
    segments = []
    for demonstration in demonstrations:
        labeled = False
        for label, run in groupby(
            range(len(demonstration.positions)), key=demonstration.states.__getitem__
        ):
            if label is None:
                continue
            labeled = True
            samples = list(run)
            # A segment ends where the next begins: the sample that opens the next closes this one.
            stop = min(samples[-1] + 2, len(demonstration.positions))
            positions = demonstration.positions[samples[0] : stop]
            steps = tuple(steps_of(positions, task.dead_zone_m))
            if len(steps) < 2:
                raise LearningError(
                    f"demonstration {demonstration.name!r}: the stretch labeled {label!r} from "
                    f"{demonstration.time_s[samples[0]]:.2f} s on moves "
                    f"{_extent(positions):.4f} m and makes {len(steps)} steps, but 2 are "
                    f"needed: demonstrate it larger or lower dead_zone_m ({task.dead_zone_m})"
                )
            gesteme = _gesteme_of(task, label, demonstration.name)
            segments.append(Segment(demonstration.name, gesteme, positions, steps))
        if not labeled:
            raise LearningError(
                f"demonstration {demonstration.name!r} has no labels: add a column 'state' with "
                f"one of {', '.join(state.name for state in task.states)}"
            )
    return segments


def fit_gestemes(
    by_gesteme: Sequence[Sequence[Segment]],
    axes: Sequence[int],
    dead_zone_m: float,
    settings: LearningSettings,
) -> GestemeParameters:
    """Return the HMM of each gesteme from its segments; see the module's docstring."""
    observed = [[_observations(segment, axes) for segment in own] for own in by_gesteme]
    lengths = [float(np.mean([len(o) for o in own])) for own in observed]
    phases = [
        max(settings.phases_at_least, round(length * settings.phases_per_step))
        for length in lengths
    ]
    aligned = [
        np.stack([_resampled(o, count) for o in own])
        for own, count in zip(observed, phases, strict=True)
    ]
    own_variance = [_smoothed(a.var(axis=0, ddof=1)) if len(a) > 1 else None for a in aligned]
    prior = _prior_variance(own_variance, lengths, len(axes), dead_zone_m, settings)
    floor = np.repeat(
        [settings.position_floor_dead_zones * dead_zone_m, settings.direction_floor], len(axes)
    )
    widest = max(phases)
    shape = (len(by_gesteme), widest, 2 * len(axes))
    means, variances = np.zeros(shape), np.ones(shape)
    chain = np.zeros((5, len(by_gesteme), widest))
    for g, count in enumerate(phases):
        freedom = len(aligned[g]) - 1
        own = own_variance[g]
        variance = prior if own is None else own
        shrunk = (freedom * variance + settings.prior_demonstrations * prior) / (
            freedom + settings.prior_demonstrations
        )
        chain[:, g, :count] = _left_right(count, lengths[g])
        means[g, :count] = aligned[g].mean(axis=0)
        variances[g, :count] = shrunk + floor**2
        if settings.refine_iterations:
            means[g, :count] = _refined(
                means[g, :count], variances[g, :count], chain[:, g, :count], observed[g], settings
            )
    return GestemeParameters(means, variances, *chain)


def _gesteme_of(task: Task, label: str, demonstration: str) -> int:
    names = [gesteme.name for gesteme in task.gestemes]
    state_name, _, chosen = label.partition("/")
    state = next((s for s in task.states if s.name == state_name), None)
    if state is None:
        raise LearningError(
            f"demonstration {demonstration!r}: label {label!r} is no state of task {task.name!r}; "
            f"states are {', '.join(s.name for s in task.states)}"
        )
    if not chosen and len(state.gestemes) == 1:
        chosen = state.gestemes[0]
    if chosen not in state.gestemes:
        raise LearningError(
            f"demonstration {demonstration!r}: label {label!r} does not name one of the gestemes "
            f"of state {state_name!r}; write "
            + " or ".join(f"{state_name}/{name}" for name in state.gestemes)
        )
    return names.index(chosen)


def _extent(positions: Array) -> float:
    return float(np.linalg.norm(np.ptp(positions, axis=0)))


def _observations(segment: Segment, axes: Sequence[int]) -> Array:
    """Displacement from the segment's origin after each step, and its direction, shape (T, 2D)."""
    moves = np.array([step.displacement for step in segment.steps])[:, list(axes)]
    lengths = np.linalg.norm(moves, axis=1, keepdims=True)
    return np.hstack([np.cumsum(moves, axis=0), moves / np.maximum(lengths, 1e-12)])


def _resampled(observations: Array, count: int) -> Array:
    """Observations at the centers of `count` stretches of equal length, shape (count, F)."""
    given = (np.arange(len(observations)) + 0.5) / len(observations)
    wanted = (np.arange(count) + 0.5) / count
    return np.stack([np.interp(wanted, given, column) for column in observations.T], axis=1)


def _smoothed(variance: Array, reach: int = 2) -> Array:
    """Mean over neighboring phases: few demonstrations tell little about one phase alone."""
    padded = np.pad(variance, ((reach, reach), (0, 0)), mode="edge")
    width = 2 * reach + 1
    return np.asarray(np.mean([padded[k : k + len(variance)] for k in range(width)], axis=0))


def _prior_variance(
    own: Sequence[Array | None],
    lengths: Sequence[float],
    dimensions: int,
    dead_zone_m: float,
    settings: LearningSettings,
) -> Array:
    seen = [variance.mean(axis=0) for variance in own if variance is not None]
    if seen:
        return np.asarray(np.mean(seen, axis=0))
    position = settings.prior_position_share * float(np.mean(lengths)) * dead_zone_m
    return np.repeat([position**2, settings.prior_direction**2], dimensions)


def _left_right(phases: int, length: float) -> Array:
    """Initial, stay, advance, skip, leave, each (phases,), for a mean length in steps.

    A phase lasts length / phases steps on average; the excess below covers faster and slower hands.
    """
    dwell = max(length / phases, 0.5)
    stay = max(1.0 - 1.0 / dwell, 0.0) + 0.08
    skip = max(1.0 / dwell - 1.0, 0.0) + 0.08
    advance = 1.0 / dwell - 2.0 * max(1.0 / dwell - 1.0, 0.0) + 0.02
    stay, advance, skip = np.array([stay, advance, skip]) / (stay + advance + skip)
    chain = np.zeros((5, phases))
    chain[0, :2] = 0.8, 0.2
    chain[1] = stay
    chain[2, :-1], chain[4, -1] = advance, advance + skip
    chain[3, :-2], chain[4, -2] = skip, skip
    return chain


def _refined(
    means: Array,
    variances: Array,
    chain: Array,
    sequences: Sequence[Array],
    settings: LearningSettings,
) -> Array:
    count = len(means)
    transition = np.diag(chain[1]) + np.diag(chain[2, :-1], 1) + np.diag(chain[3, :-2], 2)
    learned = baum_welch(
        GaussianHmm(chain[0], transition[:count, :count], means, variances),
        sequences,
        max_iterations=settings.refine_iterations,
        learn_chain=False,
    )
    return learned.model.means


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
                evidence = bank.step(*step)
                scores.append(float(evidence.log_ratio[0]))
    return float(np.quantile(scores, settings.background_quantile)) - scoring.temperature


def _alarm_threshold(
    held_out: Sequence[_HeldOut],
    scoring: Scoring,
    axes: Sequence[int],
    task: Task,
    filter_settings: FilterSettings,
    settings: LearningSettings,
) -> float:
    means: list[float] = []
    for fold in held_out:
        bank = GestemeBank(fold.parameters, scoring, axes, range(len(task.gestemes)))
        task_filter = SegmentFilter(chain_of(task, anywhere=True), filter_settings)
        steps = steps_of(_performed(_in_task_order(task, fold.segments)), task.dead_zone_m)
        scores = [task_filter.step(bank.step(*step)).log_likelihood for step in steps]
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
