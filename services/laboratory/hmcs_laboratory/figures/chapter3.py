"""Figures of chapter 3, tasks of straight lines found and followed: 3.2 to 3.4, 3.6 and 3.7."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, groupby, pairwise
from typing import Annotated, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.lines import Line2D
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from hmcs.arrays import Array
from hmcs.motion.chains import chained
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.lasa import drawings, shapes
from hmcs.motion.steps import Step
from hmcs.task.model import unknown
from hmcs_baselines.clustering import assign
from hmcs_baselines.direction_states import (
    DirectionFilter,
    DirectionStates,
    learn_directions,
    thesis_settings,
)
from hmcs_laboratory.data.hands import Count, NotNegative, Positive
from hmcs_laboratory.data.synthetic_tasks import TaskSettings, line_task
from hmcs_laboratory.data.tasks import TaskSet, as_performance, sequential_task
from hmcs_laboratory.figures.drawing import (
    FAINT,
    INK,
    Drawn,
    Number,
    change_handle,
    color_of,
    counted,
    draw_changes,
    draw_path,
    label_space,
    listed,
    mark_of,
    new_picture,
)
from hmcs_laboratory.figures.drawn import DRAWINGS, turned
from hmcs_laboratory.study import StudySettings

Integers = NDArray[np.int64]

SURE = 0.95
"""A change is seen when the direction after it is more probable than this."""
NEAR_STEPS = 5
"""A change of shape is met where the direction changes within so many steps."""
_LEAST_SHOWN = 1e-9


def _known(names: tuple[str, ...]) -> tuple[str, ...]:
    for name in names:
        if name not in shapes():
            raise ValueError(unknown("shape", name, shapes()))
    return names


class LinesSettings(TaskSettings):
    """Of figures 3.2 and 3.3; every gesteme is a line."""

    dimensions: Annotated[int, Field(ge=2, le=3)] = 3
    demonstrations: Count = 6
    performances: Count = 10
    lines: Annotated[int, Field(ge=2)] = 4
    """Each in a direction of its own."""
    noise: NotNegative = 0.15
    """κ of (3.3)."""
    least_angle_deg: NotNegative = 60.0
    """Between any two of the lines: the text calls them distinct."""
    repeats: Count = 20
    """Other tasks of this kind in which directions are found too."""


class DrawnLinesSettings(StudySettings):
    """Of figures 3.4, 3.6 and 3.7."""

    shapes: Annotated[tuple[str, ...], AfterValidator(_known)] = ("LShape", "Angle", "Sharpc")
    """Of the LASA drawings, one after another; all are made of nearly straight strokes."""
    strokes: tuple[Count, ...] = (2, 2, 3)
    """Of each shape, as it is drawn."""
    demonstrations: Annotated[int, Field(ge=1, lt=DRAWINGS)] = 4
    """Chains to learn from; the others are recognized."""
    dead_zone_m: Positive = 0.003
    """On the tablet."""


class _Task(NamedTuple):
    """A task of lines, learned as chapter 3 does."""

    data: TaskSet
    lines: Array
    """True directions, unit vectors, shape (L, D)."""
    knowledge: DirectionStates
    line_of: Integers
    """The true line nearest to each direction found, shape (K,)."""

    @property
    def found_right(self) -> bool:
        """Whether there is one direction for each line."""
        return sorted(self.line_of) == list(range(len(self.lines)))

    @property
    def order(self) -> tuple[int, ...]:
        """The lines in the order that π and A say is the most probable."""
        return tuple(int(self.line_of[state]) for state in likely_order(self.knowledge))


class _Seen(NamedTuple):
    """A performance as the filter followed it."""

    points: Array
    """m, shape (T + 1, D)."""
    probabilities: Array
    """P(direction | steps so far), shape (T, K)."""

    @property
    def likely(self) -> Integers:
        """The most probable direction after each step, shape (T,)."""
        return np.asarray(self.probabilities.argmax(axis=1))


def line_states(settings: LinesSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 3.2: a training trajectory, and one classified after automatic segmentation."""
    task = _line_task(settings, *rng.spawn(2))
    performance = task.data.performances[0]
    seen = _seen(task.knowledge, performance.steps, settings.dimensions)
    count = len(task.knowledge.directions)
    picture = new_picture(5.6)
    kind: dict[str, Any] = {"projection": "3d"} if settings.dimensions == 3 else {}
    left, right = (picture.add_subplot(1, 2, k, **kind) for k in (1, 2))
    training = task.data.demonstrations[0].positions[:, : settings.dimensions]
    draw_path(left, training, color=color_of(0), linewidth=1.4, marker=".", ms=3)
    left.set_title("A training trajectory")
    _draw_classified(right, seen)
    right.set_title("A trajectory classified")
    for ax in (left, right):
        label_space(ax, settings.dimensions)
    picture.legend(handles=_state_handles(count), loc="outside lower center", ncols=count)
    right_steps = [
        float((task.line_of[own.likely] == each.states).mean())
        for each in task.data.performances
        for own in [_seen(task.knowledge, each.steps, settings.dimensions)]
    ]
    others = [_line_task(settings, *stream.spawn(2)) for stream in rng.spawn(settings.repeats)]
    numbers: dict[str, Number] = {
        "lines": settings.lines,
        "directions_found": count,
        "steps_right": right_steps[0],
        "performances": len(right_steps),
        "all_steps_right": float(np.mean(right_steps)),
        "repeats": len(others),
        "repeats_number_right": sum(other.found_right for other in others),
        "repeats_order_right": sum(other.order == tuple(range(settings.lines)) for other in others),
    }
    found = (
        f"{counted(count, 'state')} found in {settings.demonstrations} demonstrations of "
        f"{settings.lines} lines. {100 * right_steps[0]:.1f} % of the "
        f"{len(performance.steps)} steps shown are in the right state, "
        f"{100 * np.mean(right_steps):.1f} % in {len(right_steps)} performances. In "
        f"{numbers['repeats_number_right']} of {len(others)} other tasks each line had one state, "
        f"in {numbers['repeats_order_right']} π and A told the right order."
    )
    differs = (
        "The lines are drawn by lot. How noisy the thesis' hand was in this example, and how long "
        "its lines, it does not say: see the settings."
    )
    return Drawn(picture, numbers, found, differs)


def line_delays(settings: LinesSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 3.3: the transition matrix, and the likelihoods with the true changes."""
    task = _line_task(settings, *rng.spawn(2))
    every = [
        _delays(task, each.states, _seen(task.knowledge, each.steps, settings.dimensions))
        for each in task.data.performances
    ]
    performance = task.data.performances[0]
    seen = _seen(task.knowledge, performance.steps, settings.dimensions)
    changes = np.flatnonzero(np.diff(performance.states)) + 1
    count = len(task.knowledge.directions)
    picture = new_picture(4.6, 11.0)
    left, right = picture.subplots(1, 2, width_ratios=[1.0, 1.7])
    _draw_matrix(left, task.knowledge.transition)
    _draw_likelihoods(right, seen)
    draw_changes(right, changes.tolist())
    for change, delay in zip(changes, every[0], strict=True):
        right.annotate(
            f"{delay}".replace("-", "−"),
            (change - 0.5, 1.13),
            xytext=(3, 0),
            textcoords="offset points",
            va="top",
        )
    right.set_ylim(-0.03, 1.15)
    handles = [*_state_handles(count), change_handle("true change; above, the delay in steps")]
    picture.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    delays = np.concatenate(every)
    ratio = _order_ratio(task.knowledge)
    order = [state + 1 for state in likely_order(task.knowledge)]
    numbers: dict[str, Number] = {
        "directions_found": count,
        "order": order,
        "order_right": task.order == tuple(range(settings.lines)),
        "smallest_ratio_to_other_transitions": ratio,
        "delays": every[0].tolist(),
        "performances": len(every),
        "all_delays_median": float(np.median(delays)),
        "all_delays_p95": float(np.percentile(delays, 95)),
        "all_delays": delays.tolist(),
    }
    found = (
        f"π and A tell the order {listed([str(k) for k in order])} of states"
        f"{'' if numbers['order_right'] else ', which is not that of the demonstrations'}. Each "
        f"transition in it is at least {ratio:.2g} times as probable as any other out of the same "
        f"state. The new state passes p = {SURE:g} {listed([str(d) for d in every[0].tolist()])} "
        f"steps after the true changes (below zero: before); in all {len(every)} performances the "
        f"median is {np.median(delays):.0f} and 95 % are within {np.percentile(delays, 95):.0f}."
    )
    differs = (
        "The thesis reports a factor of 10⁴ to 10⁶ between transitions of the order and all "
        "others, and about 5 samples of delay. The factor depends on how far Baum–Welch is run "
        f"and on the least probability kept ({thesis_settings().any_direction:g} here). A change "
        "is where the nearest point of the reference is on the next line: by then a hand that "
        "looks ahead has turned already, which makes delays short."
    )
    return Drawn(picture, numbers, found, differs)


def drawn_matrix(settings: DrawnLinesSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 3.4: the transition matrix learned from human drawings."""
    _, knowledge = _drawn_task(settings, *rng.spawn(2))
    transition = knowledge.transition
    count = len(transition)
    picture = new_picture(6.4, 7.2)
    _draw_matrix(picture.subplots(), transition)
    leaving = 1.0 - np.diag(transition)
    successors = [int((row > 0.01).sum()) - 1 for row in transition]
    numbers: dict[str, Number] = {
        "directions_found": count,
        "mean_steps_in_a_state": float(np.mean(1.0 / np.maximum(leaving, 1e-12)[leaving > 1e-6])),
        "successors": successors,
    }
    found = (
        f"{counted(count, 'state')}, followed by {listed([str(n) for n in successors])} others "
        "with more than 1 % a step. States that several strokes share have several successors: no "
        "sequence is extracted."
        if max(successors) > 1
        else f"{counted(count, 'state')}, each followed by one other at most."
    )
    return Drawn(picture, numbers, found, _DRAWN_DIFFERS.format(count=count))


def drawn_states(settings: DrawnLinesSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 3.6: the training trajectories, and one classified."""
    data, knowledge = _drawn_task(settings, *rng.spawn(2))
    performance = data.performances[0]
    seen = _seen(knowledge, performance.steps, 2)
    count = len(knowledge.directions)
    picture = new_picture(5.2, 11.0)
    left, right = picture.subplots(1, 2)
    for k, demonstration in enumerate(data.demonstrations):
        points = 1e3 * demonstration.positions[:, :2]
        draw_path(left, points, color=color_of(k), linewidth=1.3)
    left.set_title(f"{len(data.demonstrations)} training trajectories")
    _draw_classified(right, seen._replace(points=1e3 * seen.points))
    right.set_title("A trajectory classified")
    for ax in (left, right):
        label_space(ax, 2, "mm")
    picture.legend(handles=_state_handles(count), loc="outside lower center", ncols=min(count, 8))
    runs = [int(key) for key, _ in groupby(seen.likely)]
    numbers: dict[str, Number] = {
        "directions_found": count,
        "parts_seen": len(runs),
        "states_in_turn": [state + 1 for state in runs],
        "strokes": sum(settings.strokes),
    }
    found = (
        f"{counted(count, 'state')} found. The trajectory shown passes through "
        f"{counted(len(runs), 'part')}, in states {listed([str(s + 1) for s in runs])}; it is made "
        f"of {sum(settings.strokes)} strokes. Parallel strokes share a state."
    )
    return Drawn(picture, numbers, found, _DRAWN_DIFFERS.format(count=count))


def drawn_likelihoods(settings: DrawnLinesSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 3.7: the likelihoods of the states, and the clusters of directions."""
    data, knowledge = _drawn_task(settings, *rng.spawn(2))
    performance = data.performances[0]
    seen = _seen(knowledge, performance.steps, 2)
    count = len(knowledge.directions)
    changes = np.flatnonzero(np.diff(performance.states)) + 1
    units = _units(np.concatenate([_moves(steps, 2) for steps in _taught(data)]))
    members = assign(units, knowledge.directions)
    picture = new_picture(4.9, 11.0)
    left, right = picture.subplots(1, 2, width_ratios=[1.7, 1.0])
    _draw_likelihoods(left, seen)
    draw_changes(left, changes.tolist())
    left.set_ylim(-0.03, 1.05)
    for k, direction in enumerate(knowledge.directions):
        own = units[members == k]
        right.plot(*own.T, color=color_of(k), ls="", marker=mark_of(k), ms=4, mfc="none", mew=0.8)
        right.plot([0, direction[0]], [0, direction[1]], color=color_of(k), linewidth=1.2)
        right.plot(*direction, color=color_of(k), ls="", marker=mark_of(k), ms=10, mec=INK)
        right.annotate(
            str(k + 1), 0.82 * direction, ha="center", va="center", color=INK, fontweight="bold"
        )
    right.set_aspect("equal")
    right.set_xticks([-1.0, 0.0, 1.0])
    right.set_yticks([-1.0, 0.0, 1.0])
    right.set_title("Motion directions and clusters")
    right.set_xlabel("x of the direction (unit vector)")
    right.set_ylabel("y of the direction")
    handles = [*_state_handles(count), change_handle("next shape begins")]
    picture.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 8))
    switched = np.flatnonzero(np.diff(seen.likely)) + 1
    met = [int(np.abs(switched - change).min(initial=10**6)) <= NEAR_STEPS for change in changes]
    angles_deg = np.rad2deg(
        np.arctan2(knowledge.directions[:, 1], knowledge.directions[:, 0])
    ).tolist()
    sure = float((seen.probabilities.max(axis=1) > SURE).mean())
    numbers: dict[str, Number] = {
        "directions_found": count,
        "directions_deg": angles_deg,
        "support": knowledge.support.tolist(),
        "shape_changes": len(changes),
        "shape_changes_met": sum(met),
        "share_of_steps_sure": sure,
    }
    angles = [f"{angle:.0f}°" for angle in angles_deg]
    found = (
        f"{counted(count, 'cluster')}, at {listed(angles)}. In {100 * sure:.0f} % of the steps one "
        f"state has more than {SURE:g}. {sum(met)} of {len(met)} changes from one shape to the "
        f"next are met by a change of state within {NEAR_STEPS} steps."
    )
    return Drawn(picture, numbers, found, _DRAWN_DIFFERS.format(count=count))


_DRAWN_DIFFERS = (
    "The thesis has ten states in three dimensions, here there are {count} in the plane of the "
    "tablet: another task. True changes within a shape are not known, as in the thesis."
)


def likely_order(knowledge: DirectionStates) -> list[int]:
    """Return the states from the most probable first one on, each the most probable next."""
    order = [int(knowledge.initial.argmax())]
    while len(order) < len(knowledge.initial):
        leaving = knowledge.transition[order[-1]].copy()
        leaving[order] = -1.0
        order.append(int(leaving.argmax()))
    return order


def _order_ratio(knowledge: DirectionStates) -> float:
    """How much more probable each transition of the order is than the next best, at least."""
    order = likely_order(knowledge)
    ratios = [np.inf]
    for state, following in pairwise(order):
        others = np.delete(knowledge.transition[state], [state, following])
        ratios.append(knowledge.transition[state, following] / max(others.max(initial=0), 1e-300))
    return float(min(ratios)) if len(order) > 2 else 0.0


def _line_task(
    settings: LinesSettings, making: np.random.Generator, learning: np.random.Generator
) -> _Task:
    while True:
        data = line_task(settings, settings.lines, settings.noise, making)
        curves = np.array([curve[-1] - curve[0] for curve in data.references.values()])
        lines = _units(curves[:, : settings.dimensions])
        cosine = max(float(a @ b) for a, b in combinations(lines, 2))
        if cosine <= np.cos(np.deg2rad(settings.least_angle_deg)):
            break
    moves = [_moves(steps, settings.dimensions) for steps in _taught(data)]
    knowledge = learn_directions(moves, thesis_settings(), learning)
    return _Task(data, lines, knowledge, (knowledge.directions @ lines.T).argmax(axis=1))


def _drawn_task(
    settings: DrawnLinesSettings, making: np.random.Generator, learning: np.random.Generator
) -> tuple[TaskSet, DirectionStates]:
    lots = [making.permutation(DRAWINGS) for _ in settings.shapes]
    task = sequential_task(
        "drawn-lines", settings.shapes, dead_zone_m=settings.dead_zone_m, dimensions=2
    )
    made = []
    for k in range(DRAWINGS):
        pieces = []
        for number, (shape, lot) in enumerate(zip(settings.shapes, lots, strict=True), start=1):
            time_s, drawn_m = drawings(shape)[lot[k]]
            states = (f"S{number}",) * len(time_s)
            pieces.append(Demonstration(shape, time_s, turned(drawn_m, 0.0), states))
        made.append(chained(f"chain-{k}", pieces, np.zeros(3)))
    taught = made[: settings.demonstrations]
    tested = tuple(as_performance(each, task) for each in made[settings.demonstrations :])
    data = TaskSet(task, tuple(taught), tested, {})
    moves = [_moves(steps, 2) for steps in _taught(data)]
    return data, learn_directions(moves, thesis_settings(), learning)


def _taught(data: TaskSet) -> list[tuple[Step, ...]]:
    return [as_performance(each, data.task).steps for each in data.demonstrations]


def _moves(steps: Sequence[Step], dimensions: int) -> Array:
    return np.array([step.displacement[:dimensions] for step in steps])


def _units(rows: Array) -> Array:
    return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))


def _seen(knowledge: DirectionStates, steps: Sequence[Step], dimensions: int) -> _Seen:
    following = DirectionFilter(knowledge)
    moves = _moves(steps, dimensions)
    start = steps[0].position[:dimensions]
    points = np.vstack([start, start + moves.cumsum(axis=0)])
    return _Seen(points, np.array([following.step(move) for move in moves]))


def _delays(task: _Task, true: Integers, seen: _Seen) -> Integers:
    """Steps from each true change until its line is sure; its whole length if it never is.

    Counted from halfway through the line before: the hand may turn early.
    """
    shares = seen.probabilities @ np.eye(len(task.lines))[task.line_of]
    edges = [0, *(np.flatnonzero(np.diff(true)) + 1).tolist(), len(true)]
    delays = []
    for before, begin, end in zip(edges, edges[1:], edges[2:], strict=False):
        middle = (before + begin) // 2
        sure = np.flatnonzero(shares[middle:end, true[begin]] > SURE)
        delays.append(middle + int(sure[0]) - begin if len(sure) else end - begin)
    return np.array(delays)


def _draw_classified(ax: Axes, seen: _Seen) -> None:
    draw_path(ax, seen.points, color=FAINT, linewidth=0.8)
    for state in range(seen.probabilities.shape[1]):
        own = seen.points[1:][seen.likely == state]
        draw_path(ax, own, color=color_of(state), linestyle="", marker=mark_of(state), ms=5)


def _draw_likelihoods(ax: Axes, seen: _Seen) -> None:
    for state, own in enumerate(seen.probabilities.T):
        ax.plot(
            own,
            color=color_of(state),
            linewidth=1.5,
            marker=mark_of(state),
            ms=4,
            markevery=(state, 6),
        )
    ax.set_title("Normalized likelihood of each state")
    ax.set_xlabel("step")
    ax.set_ylabel("probability")
    ax.set_xlim(-0.5, len(seen.probabilities) - 0.5)


def _draw_matrix(ax: Axes, transition: Array) -> None:
    count = len(transition)
    shown = np.maximum(transition, _LEAST_SHOWN)
    image = ax.imshow(shown, cmap="Blues", norm=LogNorm(_LEAST_SHOWN, 1.0))
    ax.grid(visible=False)
    for i, j in np.ndindex(count, count):
        value = transition[i, j]
        ax.text(
            j,
            i,
            f"{value:.3f}" if value >= 1e-3 else f"{value:.0e}".replace("e-0", "e−"),
            ha="center",
            va="center",
            color="white" if value > 1e-4 else INK,
            fontsize=9.5 if count <= 6 else 7.5,
        )
    names = [str(k + 1) for k in range(count)]
    ax.set_xticks(range(count), names)
    ax.set_yticks(range(count), names)
    ax.set_xlabel("to state")
    ax.set_ylabel("from state")
    ax.set_title("A: probability of a transition")
    picture = ax.get_figure()
    assert picture is not None
    picture.colorbar(image, ax=ax, shrink=0.8, label="probability in a step")


def _state_handles(count: int) -> list[Line2D]:
    return [
        Line2D([], [], color=color_of(k), marker=mark_of(k), ms=5, label=f"state {k + 1}")
        for k in range(count)
    ]
