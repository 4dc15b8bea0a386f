"""Figures 3.2 and 3.3: tasks of straight lines of a simulated operator, found and followed."""

from __future__ import annotations

from itertools import combinations, pairwise
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field

from hmcs.arrays import Array
from hmcs_baselines.direction_states import (
    DirectionStates,
    learn_directions,
    thesis_settings,
    unit_rows,
)
from hmcs_laboratory.data.hands import Count, NotNegative
from hmcs_laboratory.data.synthetic_tasks import TaskSettings, line_task
from hmcs_laboratory.data.tasks import TaskSet
from hmcs_laboratory.figures.direction_following import (
    SURE,
    FollowedPath,
    Integers,
    draw_classified,
    draw_likelihoods,
    draw_matrix,
    follow_path,
    likely_order,
    moves_of,
    state_handles,
    taught_steps,
)
from hmcs_laboratory.figures.drawing import (
    Drawn,
    Number,
    change_handle,
    color_of,
    counted,
    draw_changes,
    draw_path,
    label_space,
    listed,
    new_picture,
)


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


class _LineTask(NamedTuple):
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


def line_states(settings: LinesSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 3.2: a training trajectory, and one classified after automatic segmentation."""
    task = _line_task(settings, *rng.spawn(2))
    performance = task.data.performances[0]
    seen = follow_path(task.knowledge, performance.steps, settings.dimensions)
    count = len(task.knowledge.directions)
    picture = new_picture(5.6)
    kind: dict[str, Any] = {"projection": "3d"} if settings.dimensions == 3 else {}
    left, right = (picture.add_subplot(1, 2, k, **kind) for k in (1, 2))
    training = task.data.demonstrations[0].positions[:, : settings.dimensions]
    draw_path(left, training, color=color_of(0), linewidth=1.4, marker=".", ms=3)
    left.set_title("A training trajectory")
    draw_classified(right, seen)
    right.set_title("A trajectory classified")
    for ax in (left, right):
        label_space(ax, settings.dimensions)
    picture.legend(handles=state_handles(count), loc="outside lower center", ncols=count)
    right_steps = [
        float((task.line_of[own.likely] == each.states).mean())
        for each in task.data.performances
        for own in [follow_path(task.knowledge, each.steps, settings.dimensions)]
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
        f"in {numbers['repeats_order_right']} π and A showed the right order."
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
        _delays(task, each.states, follow_path(task.knowledge, each.steps, settings.dimensions))
        for each in task.data.performances
    ]
    performance = task.data.performances[0]
    seen = follow_path(task.knowledge, performance.steps, settings.dimensions)
    changes = np.flatnonzero(np.diff(performance.states)) + 1
    count = len(task.knowledge.directions)
    picture = new_picture(4.6, 11.0)
    left, right = picture.subplots(1, 2, width_ratios=[1.0, 1.7])
    draw_matrix(left, task.knowledge.transition)
    draw_likelihoods(right, seen)
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
    handles = [*state_handles(count), change_handle("true change; above, the delay in steps")]
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
) -> _LineTask:
    while True:
        data = line_task(settings, settings.lines, settings.noise, making)
        curves = np.array([curve[-1] - curve[0] for curve in data.references.values()])
        lines = unit_rows(curves[:, : settings.dimensions])
        cosine = max(float(a @ b) for a, b in combinations(lines, 2))
        if cosine <= np.cos(np.deg2rad(settings.least_angle_deg)):
            break
    moves = [moves_of(steps, settings.dimensions) for steps in taught_steps(data)]
    knowledge = learn_directions(moves, thesis_settings(), learning)
    return _LineTask(data, lines, knowledge, (knowledge.directions @ lines.T).argmax(axis=1))


def _delays(task: _LineTask, true: Integers, seen: FollowedPath) -> Integers:
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
