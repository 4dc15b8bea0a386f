"""Figures 3.4, 3.6 and 3.7: chains of human drawings, their directions found and followed."""

from __future__ import annotations

from itertools import groupby
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field

from hmcs.motion.chains import chained
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.lasa import drawings, shapes
from hmcs.task.values import unknown_name_message
from hmcs_baselines.clustering import assign
from hmcs_baselines.direction_states import (
    DirectionStates,
    learn_directions,
    thesis_settings,
    unit_rows,
)
from hmcs_laboratory.data.hands import Count, Positive
from hmcs_laboratory.data.tasks import TaskSet, as_performance, sequential_task
from hmcs_laboratory.figures.direction_following import (
    SURE,
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

NEAR_STEPS = 5
"""A change of shape is met where the direction changes within so many steps."""


def _known(names: tuple[str, ...]) -> tuple[str, ...]:
    for name in names:
        if name not in shapes():
            raise ValueError(unknown_name_message("shape", name, shapes()))
    return names


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


def drawn_matrix(settings: DrawnLinesSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 3.4: the transition matrix learned from human drawings."""
    _, knowledge = _drawn_task(settings, *rng.spawn(2))
    transition = knowledge.transition
    count = len(transition)
    picture = new_picture(6.4, 7.2)
    order = likely_order(knowledge)
    draw_matrix(picture.subplots(), transition, order)
    leaving = 1.0 - np.diag(transition)
    successors = [int((row > 0.01).sum()) - 1 for row in transition]
    numbers: dict[str, Number] = {
        "directions_found": count,
        "mean_steps_in_a_state": float(np.mean(1.0 / np.maximum(leaving, 1e-12)[leaving > 1e-6])),
        "successors": successors,
        "order": [state + 1 for state in order],
    }
    found = (
        f"{counted(count, 'state')}, followed by {listed([str(n) for n in successors])} others "
        "with more than 1 % a step. States that several strokes share have several successors: no "
        "sequence is extracted."
        if max(successors) > 1
        else f"{counted(count, 'state')}, each followed by one other at most: in the order "
        "in which one most probably follows the other, successors stand beside the diagonal."
    )
    return Drawn(picture, numbers, found, _DRAWN_DIFFERS.format(count=count))


def drawn_states(settings: DrawnLinesSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 3.6: the training trajectories, and one classified."""
    data, knowledge = _drawn_task(settings, *rng.spawn(2))
    performance = data.performances[0]
    seen = follow_path(knowledge, performance.steps, 2)
    count = len(knowledge.directions)
    picture = new_picture(5.2, 11.0)
    left, right = picture.subplots(1, 2)
    for k, demonstration in enumerate(data.demonstrations):
        points = 1e3 * demonstration.positions[:, :2]
        draw_path(left, points, color=color_of(k), linewidth=1.3)
    left.set_title(f"{len(data.demonstrations)} training trajectories")
    draw_classified(right, seen._replace(points=1e3 * seen.points))
    right.set_title("A trajectory classified")
    for ax in (left, right):
        label_space(ax, 2, "mm")
    picture.legend(handles=state_handles(count), loc="outside lower center", ncols=min(count, 8))
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
    seen = follow_path(knowledge, performance.steps, 2)
    count = len(knowledge.directions)
    changes = np.flatnonzero(np.diff(performance.states)) + 1
    units = unit_rows(np.concatenate([moves_of(steps, 2) for steps in taught_steps(data)]))
    members = assign(units, knowledge.directions)
    picture = new_picture(4.9, 11.0)
    left, right = picture.subplots(1, 2, width_ratios=[1.7, 1.0])
    draw_likelihoods(left, seen)
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
    handles = [*state_handles(count), change_handle("next shape begins")]
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
    moves = [moves_of(steps, 2) for steps in taught_steps(data)]
    return data, learn_directions(moves, thesis_settings(), learning)
