"""Gestemes and task states found in demonstrations that nobody labeled.

Chapter 3 of the thesis finds the nominal directions of straight motions by clustering; here the
motions may be any curves. Demonstrations of the same order are aligned and averaged, so that their
corners stand out of the noise of the hand (`consensus`). The mean is cut where the operators stop
(`stops`) or, where they never do, where its direction breaks or its curvature changes
(`curve_pieces`). Pieces of one shape are one gesteme, wherever they are performed
(`piece_shapes`); a gesteme that stands twice in a task serves two states.
Shapes: T samples of a demonstration, G gestemes, S states.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.paths import mean_path
from hmcs.recognition.discovery.consensus import alike
from hmcs.recognition.discovery.order_cuts import CutSettings, OrderCut, cut_order
from hmcs.recognition.discovery.piece_shapes import grouped, spread_about
from hmcs.recognition.discovery.task_states import TaskStates, task_states
from hmcs.recognition.discovery.unlabeled_demos import (
    UnlabeledDemo,
    checked_demos,
    common_step_m,
    resampled,
)
from hmcs.recognition.segments import LearningError
from hmcs.task import Task

Integers = NDArray[np.int64]


class UnlabeledSettings(NamedTuple):
    """The choices of the search; lengths are in steps of it, so it knows no scale."""

    least_step_m: float = 0.0
    """Demonstrations are compared in steps of the median distance between samples, m, of this
    where it is more..."""
    most_steps: int = 200
    """...and of more where the longest demonstration would have more than so many."""
    least_cosine: float = 0.6
    """Demonstrations have different orders where their directions, aligned, agree less."""
    cut: CutSettings = CutSettings()
    """Where a demonstration is cut."""
    alike_steps: float = 1.2
    """Pieces differ by so many steps at least if they are of different gestemes..."""
    alike_spreads: float = 0.5
    """...and by so many times what performances of one piece differ from their mean."""
    alike_share: float = 0.05
    """That difference, as a share of the pieces' length, where all were demonstrated once."""


class Segmented(NamedTuple):
    """What was found in one demonstration."""

    name: str
    order: int
    """Index of the group of demonstrations it was aligned with."""
    boundaries: Integers
    """Indices of the samples with which a new piece begins, rising; one less than pieces."""
    states: Integers
    """Index of the state of each sample, shape (T,)."""
    gestemes: Integers
    """Index of the gesteme of each sample, shape (T,)."""


class Discovery(NamedTuple):
    """Gestemes and states found."""

    demonstrations: tuple[Segmented, ...]
    """In the order given."""
    path_points: tuple[Array, ...]
    """For each gesteme its mean path from the start of the piece, m, shape (100, 3)."""
    path_spreads: tuple[Array, ...]
    """For each gesteme the lateral RMS of its performances about it, m, shape (100,)."""
    states: TaskStates
    """The states' gestemes, and how often one followed another."""
    supports: tuple[Array, ...]
    """For each order, the share of its demonstrations that show each boundary."""
    step_m: float
    """Length of the steps that demonstrations were compared in."""
    notes: tuple[str, ...]
    """What should be known before the result is trusted."""


def discover(
    demonstrations: Sequence[Demonstration | ArrayLike],
    settings: UnlabeledSettings = UnlabeledSettings(),  # noqa: B008  frozen
) -> Discovery:
    """Return the gestemes and states of a task that was demonstrated without labels.

    A demonstration is one or positions, m, shape (T, 3); labels are not looked at. Where it tells
    times, stops count. The result does not depend on the order, place, turn or size of what is
    given, but for numbering and `step_m`; the same motion given twice counts once.

    Raises LearningError when there is none, or one is of another shape, not finite, does not move,
    or is shorter than a piece may be.
    """
    demos = checked_demos(demonstrations)
    original = [next(k for k, o in enumerate(demos) if o.same(demo)) for demo in demos]
    different = sorted(set(original))
    step_m = common_step_m(
        [demos[k] for k in different], settings.least_step_m, settings.most_steps
    )
    steps = {k: resampled(demos[k], step_m, settings.cut.shortest_steps) for k in different}
    groups = alike([steps[k].points for k in different], step_m, settings.least_cosine)
    orders = [[different[k] for k in group] for group in groups]
    cuts = [cut_order([steps[k] for k in order], step_m, settings.cut) for order in orders]

    gestemes = _gestemes(cuts, step_m, settings)
    place = {k: (o, n) for o, order in enumerate(orders) for n, k in enumerate(order)}
    states = task_states([gestemes[place[k][0]] for k in original])
    segmented = []
    for demo, k, sequence in zip(demos, original, states.sequences, strict=True):
        order, n = place[k]
        boundaries = steps[k].samples(cuts[order].at[n])
        piece = np.searchsorted(boundaries, np.arange(len(demo.positions)), side="right")
        segmented.append(
            Segmented(demo.name, order, boundaries, sequence[piece], gestemes[order][piece])
        )
    performed: list[list[Array]] = [[] for _ in range(int(states.gestemes.max()) + 1)]
    for own, order_cut in zip(gestemes, cuts, strict=True):
        for pieces in order_cut.performed:
            for gesteme, piece_ in zip(own, pieces, strict=True):
                performed[gesteme].append(piece_)
    paths = [mean_path(pieces) for pieces in performed]
    return Discovery(
        tuple(segmented),
        tuple(points for points, _ in paths),
        tuple(spread for _, spread in paths),
        states,
        tuple(each.support for each in cuts),
        step_m,
        tuple(_notes(demos, original, orders)),
    )


def labeled(
    discovery: Discovery, demonstrations: Sequence[Demonstration], template: Task
) -> tuple[Task, tuple[Demonstration, ...]]:
    """Return what was found as a task and its demonstrations, ready for `learn`.

    The task is the template but for its gestemes, g1, g2, …, and its states, s1, s2, …, which
    follow one another as often as they did; `demonstrations` are those it was found in, in the
    same order. Raises LearningError when they are not.
    """
    lengths = [len(found.states) for found in discovery.demonstrations]
    given = [len(each.positions) for each in demonstrations]
    if lengths != given:
        raise LearningError(
            f"demonstrations have {given} samples, but gestemes were found in demonstrations of "
            f"{lengths}: give the same ones in the same order"
        )
    states = discovery.states
    names = [f"s{k}" for k in range(1, len(states.gestemes) + 1)]

    def likely(row: Array) -> dict[str, float]:
        return {name: float(p) for name, p in zip(names, row, strict=True) if p > 0}

    task = Task.model_validate(
        template.model_dump()
        | {
            "gestemes": [{"name": f"g{g}"} for g in range(1, len(discovery.path_points) + 1)],
            "states": [
                {"name": name, "gestemes": [f"g{gesteme + 1}"], "next": likely(row)}
                for name, gesteme, row in zip(
                    names, states.gestemes, states.transition, strict=True
                )
            ],
            "start": likely(states.initial),
        }
    )
    return task, tuple(
        each._replace(states=tuple(names[state] for state in found.states))
        for each, found in zip(demonstrations, discovery.demonstrations, strict=True)
    )


def _gestemes(
    cuts: Sequence[OrderCut], step_m: float, settings: UnlabeledSettings
) -> list[Integers]:
    """The gesteme of each piece of each order, numbered as they first occur."""
    pieces = [piece for each in cuts for piece in each.pieces]
    spreads = [
        spread_about(piece, [own[k] for own in each.performed])
        for each in cuts
        if len(each.performed) > 1
        for k, piece in enumerate(each.pieces)
    ]
    if spreads:
        spread_m = settings.alike_spreads * float(np.sqrt(np.mean(np.square(spreads))))
    else:
        mean_steps = float(np.mean([len(piece) - 1 for piece in pieces]))
        spread_m = settings.alike_share * mean_steps * step_m
    group = grouped(pieces, settings.alike_steps * step_m + spread_m)
    ends = np.cumsum([len(each.pieces) for each in cuts])
    return np.split(group, ends[:-1])


def _notes(
    demos: Sequence[UnlabeledDemo], original: Sequence[int], orders: Sequence[Sequence[int]]
) -> Iterator[str]:
    for k, first in enumerate(original):
        if first != k:
            yield (f"{demos[k].name!r} is the same motion as {demos[first].name!r}: it counts once")
    if len(orders) > 1:
        yield f"demonstrations have {len(orders)} different orders: each was cut by itself"
    for order in orders:
        if len(order) == 1:
            yield (
                f"{demos[order[0]].name!r} is the only one of its order: no other demonstration "
                "supports its boundaries"
            )
