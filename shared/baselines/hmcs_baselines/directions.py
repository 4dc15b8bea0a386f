"""Nominal motion directions of a task of straight lines (thesis 3.1.2), found better.

The thesis clusters the directions of all steps and looks for an elbow (`elbow_directions`). Steps
are noisy, and where a hand has been is not: here each demonstration is cut into straight chords at
the least squared error (`hmcs_baselines.chords`). `find_directions` looks for one sequence of
lines that lies well over all demonstrations of a task performed in one order, some lines left out
here and there: starting from too many lines it takes away the one that explains least until what
the next one explains is more than noise would. `pooled_directions` assumes no order: it cuts every
demonstration by itself and keeps directions that recur.
Shapes: T_i points of demonstration i, D axes, K directions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hmcs.arrays import Array
from hmcs.recognition.segments import LearningError
from hmcs_baselines.chords import Chords, Piece, cut, median_spread
from hmcs_baselines.cluster_count import CusumSettings, cusum_elbow, search_clusters
from hmcs_baselines.clustering import assign
from hmcs_baselines.line_sequence import (
    Laying,
    LineSequence,
    gathered,
    laid_over_all,
    trimmed_chord,
    without_one,
)

Integers = NDArray[np.intp]


class DirectionError(LearningError):
    """Demonstrations in which no directions can be found; says which, why, and what to do."""


class DirectionSettings(NamedTuple):
    """The choices of the search; penalties are in units of the hand's own variance."""

    merge_angle_rad: float = math.radians(12.0)
    """Lines that differ by less have one direction."""
    tell_apart: float = 3.0
    """So do lines for which two directions explain less than so many times what D − 1 parameters
    more explain of mere noise (Bayesian information criterion)."""
    support_share: float = 0.5
    """A direction occurs in at least this share of the demonstrations."""
    least_steps: int = 6
    """No chord has fewer steps; four at least."""
    line_penalty: float = 30.0
    """What a line of the sequence must explain at least..."""
    chord_penalty: float = 20.0
    """...and so much more for every demonstration."""
    skip_penalty: float = 40.0
    """What it costs a demonstration to leave out a line."""
    alone_penalty: float = 40.0
    """What a chord must explain in a demonstration looked at by itself."""
    chord_angle_rad: float = math.radians(20.0)
    """Chords of demonstrations looked at by themselves have one direction if they differ by less:
    single chords are less sure than lines laid over all demonstrations."""
    correlation: float = 0.6
    """φ, from one step to the next, of the hand's distance from its line."""
    floor_steps: float = 0.2
    """The hand errs by at least so many median steps: what is smaller, as the rounding of a corner
    by a steady hand, is no line of its own."""


class FoundDirections(NamedTuple):
    """The nominal motion directions of a task."""

    directions: Array
    """Unit vectors, shape (K, D), in the order of their first occurrence."""
    support: Array
    """Share of the demonstrations each occurs in, shape (K,)."""
    labels: tuple[Integers, ...]
    """The direction of every step of each demonstration, shapes (T_i − 1,)."""


def find_directions(
    demonstrations: Sequence[ArrayLike],
    settings: DirectionSettings = DirectionSettings(),  # noqa: B008  frozen
) -> FoundDirections:
    """Return the directions of a task that every demonstration performs in the same order.

    `demonstrations` are positions, m, shape (T_i, D), D ≥ 2, a step apart from one another.
    Raises DirectionError when there is none, or one is too short, not finite, without motion, or
    of another number of axes than the first.
    """
    motions, variance = _measured(_checked(demonstrations, settings.least_steps + 1), settings)
    lines = max((_too_many_lines(chords, variance, settings) for chords in motions), key=len)
    laying = Laying(variance * settings.skip_penalty, settings.least_steps)
    least_count = settings.support_share * len(motions)
    least = variance * (settings.line_penalty + settings.chord_penalty * len(motions))
    sequence = laid_over_all(motions, lines, laying)
    while len(sequence.lines) > 1:
        fewer = without_one(motions, sequence, laying, least_count)
        if fewer.cost - sequence.cost >= least and sequence.counts().min() >= least_count:
            break
        sequence = fewer
    return _merged(motions, sequence, variance, settings)


def pooled_directions(
    demonstrations: Sequence[ArrayLike],
    settings: DirectionSettings = DirectionSettings(),  # noqa: B008  frozen
) -> FoundDirections:
    """Return the directions that recur in demonstrations, in whatever order.

    Arguments and errors as `find_directions`. A chord whose direction recurs too seldom is labeled
    with the nearest that does; if none does, the best supported one is returned.
    """
    motions, variance = _measured(_checked(demonstrations, settings.least_steps + 1), settings)
    cuts = [_alone(chords, variance * settings.alone_penalty, settings) for chords in motions]
    chord = np.array(
        [trimmed_chord(c, piece) for c, own in zip(motions, cuts, strict=True) for piece in own]
    )
    owner = np.repeat(np.arange(len(motions)), [len(own) for own in cuts])
    group = _grouped(chord, settings.chord_angle_rad)
    support = np.array(
        [len(np.unique(owner[group == g])) / len(motions) for g in range(group.max() + 1)]
    )
    kept = np.flatnonzero(support >= min(settings.support_share, support.max()))
    directions = np.array([nominal_direction(chord[group == g].sum(axis=0)) for g in kept])
    nearest = (chord @ directions.T).argmax(axis=1)
    nearest[:] = np.where(np.isin(group, kept), np.searchsorted(kept, group), nearest)
    labels, begin = [], 0
    for own in cuts:
        lengths = [piece.last - piece.first for piece in own]
        labels.append(np.repeat(nearest[begin : begin + len(own)], lengths))
        begin += len(own)
    return FoundDirections(directions, support[kept], tuple(labels))


def elbow_directions(
    demonstrations: Sequence[ArrayLike],
    rng: np.random.Generator,
    *,
    most: int = 15,
    restarts: int = 20,
    cusum: CusumSettings = CusumSettings(),  # noqa: B008  frozen
) -> FoundDirections:
    """Return the directions as the thesis finds them (2.1.5, 3.1.2).

    k-means on the directions of all steps, the number of clusters from the elbow by CUSUM-RLS.
    `demonstrations` as in `find_directions`; steps of length zero have no direction and are
    labeled like the step before. Raises DirectionError as there, and ClusteringError when there
    are fewer distinct directions than `most`.
    """
    positions = _checked(demonstrations, 2)
    steps = [np.diff(own, axis=0) for own in positions]
    lengths = [np.linalg.norm(own, axis=1) for own in steps]
    units = np.concatenate(
        [own[at > 0] / at[at > 0, None] for own, at in zip(steps, lengths, strict=True)]
    )
    search = search_clusters(units, most, rng, restarts=restarts)
    centers = search.clusters[cusum_elbow(search.error, cusum).clusters - 1].centers
    labels = []
    for own, at in zip(steps, lengths, strict=True):
        moved = np.maximum.accumulate(np.where(at > 0, np.arange(len(at)), 0))
        moved = np.maximum(moved, int((at > 0).argmax()))
        labels.append(assign(own[moved] / at[moved, None], centers))
    used, first, every = np.unique(np.concatenate(labels), return_index=True, return_inverse=True)
    order = first.argsort()
    renumbered = np.split(order.argsort()[every], np.cumsum([len(own) for own in labels])[:-1])
    support = np.array(
        [np.mean([(own == k).any() for own in renumbered]) for k in range(len(used))]
    )
    directions = np.array([nominal_direction(center) for center in centers[used[order]]])
    return FoundDirections(directions, support, tuple(renumbered))


def distinct_directions(directions: ArrayLike, merge_angle_rad: float) -> Array:
    """Return directions, shape (K, D), with those that differ by less than an angle made one.

    The nearest two become their sum's direction until none are near: the number a search with that
    `merge_angle_rad` is to find for a task of lines with these directions.
    """
    given = np.asarray(directions, dtype=float)
    group = _grouped(given / np.linalg.norm(given, axis=1, keepdims=True), merge_angle_rad)
    return np.array(
        [nominal_direction(given[group == g].sum(axis=0)) for g in range(group.max() + 1)]
    )


def _checked(demonstrations: Sequence[ArrayLike], least: int) -> list[Array]:
    if not len(demonstrations):
        raise DirectionError("no demonstrations to find directions in: give at least one")
    checked = [np.asarray(one, dtype=float) for one in demonstrations]
    axes = checked[0].shape[-1] if checked[0].ndim == 2 else 0
    for index, one in enumerate(checked):
        where = f"demonstration {index} has "
        if one.ndim != 2 or one.shape[1] != axes or axes < 2:
            wanted = f"(T, {axes})" if axes > 1 and index else "(T, 2) or (T, 3)"
            raise DirectionError(f"{where}shape {one.shape}: give positions of shape {wanted}")
        if len(one) < least:
            raise DirectionError(
                f"{where}{len(one)} positions, but {least} are needed: "
                "demonstrate it longer or lower the dead zone"
            )
        if not np.isfinite(one).all():
            first = int((~np.isfinite(one).all(axis=1)).argmax())
            raise DirectionError(f"{where}a value that is not finite at position {first}: mend it")
        if not np.ptp(one, axis=0).any():
            raise DirectionError(f"{where}no motion: all its positions are the same; leave it out")
    return checked


def _measured(
    positions: Sequence[Array], settings: DirectionSettings
) -> tuple[list[Chords], float]:
    """The demonstrations' chords, weighed by how evenly the hand goes, and its variance, m²."""
    if settings.least_steps < 4:
        raise ValueError(f"least_steps is {settings.least_steps}, expected four at least")
    motions = [Chords(own, settings.correlation) for own in positions]
    steps = np.concatenate([np.linalg.norm(np.diff(own, axis=0), axis=1) for own in positions])
    floor = (settings.floor_steps * float(np.median(steps[steps > 0]))) ** 2
    windows = [
        (chords, Piece(first, first + settings.least_steps, 0))
        for chords in motions
        for first in range(len(chords.positions) - settings.least_steps)
    ]
    spread = median_spread(windows)
    for _ in range(2):
        variance = spread.across + floor
        for chords in motions:
            chords.weigh_pace(variance / max(spread.along, variance))
        # A line too many is a smaller mistake here than one too few, which would count as noise.
        penalty = 0.75 * settings.alone_penalty * variance
        spread = median_spread(
            [(chords, piece) for chords in motions for piece in _alone(chords, penalty, settings)]
        )
    variance = spread.across + floor
    for chords in motions:
        chords.weigh_pace(variance / max(spread.along, variance))
    return motions, variance


def _too_many_lines(chords: Chords, variance: float, settings: DirectionSettings) -> Array:
    """The directions of one demonstration's chords, cut at half of what a chord should explain."""
    pieces = _alone(chords, 0.5 * variance * settings.alone_penalty, settings)
    return np.array([chords.direction(piece.first, piece.last) for piece in pieces])


def _alone(chords: Chords, penalty: float, settings: DirectionSettings) -> list[Piece]:
    return cut(chords.least_costs(), penalty, settings.least_steps)


def _merged(
    motions: Sequence[Chords], sequence: LineSequence, variance: float, settings: DirectionSettings
) -> FoundDirections:
    """One direction for lines within the merging angle, or that the data cannot tell apart."""
    forms, chord = gathered(motions, sequence)
    points = sum(len(chords.positions) for chords in motions)
    parameters = sequence.lines.shape[1] - 1
    chance = settings.tell_apart * variance * parameters * math.log(points)
    group = _grouped(chord, settings.merge_angle_rad, forms, chance)
    count = int(group.max()) + 1
    directions = np.array([nominal_direction(chord[group == g].sum(axis=0)) for g in range(count)])
    labels, present = [], np.zeros((len(motions), count), dtype=bool)
    for index, one in enumerate(sequence.fitted):
        own = group[[piece.line for piece in one.pieces]]
        present[index, own] = True
        labels.append(np.repeat(own, [piece.last - piece.first for piece in one.pieces]))
    return FoundDirections(directions, present.mean(axis=0), tuple(labels))


def _grouped(
    chord: Array, angle_rad: float, forms: Array | None = None, chance: float = 0.0
) -> Integers:
    """The group of each chord (n, D), by merging the nearest two while they may be one.

    With the quadratic forms (n, D, D) of the chords two are one also if sharing a direction costs
    less than `chance`. Groups are numbered in the order of their first chord.
    """
    group = np.arange(len(chord))
    sums = chord.copy()
    held = None if forms is None else forms.copy()
    while True:
        alive = np.unique(group)
        units = sums[alive] / np.maximum(np.linalg.norm(sums[alive], axis=1, keepdims=True), 1e-300)
        angles = np.arccos(np.clip(units @ units.T, -1.0, 1.0))
        near = angles < angle_rad
        if held is not None:
            own = np.linalg.eigvalsh(held[alive])[:, -1]
            shared = np.linalg.eigvalsh(held[alive][:, None] + held[alive][None])[..., -1]
            gain = own[:, None] + own[None, :] - shared
            near = near | ((gain < chance) & (angles < np.pi / 2))
        may = np.triu(near, 1)
        if not may.any():
            return np.asarray(np.searchsorted(alive, group))
        nearest = np.where(may, angles, np.inf).argmin()
        a, b = alive[list(np.unravel_index(nearest, may.shape))]
        sums[a] += sums[b]
        if held is not None:
            held[a] += held[b]
        group[group == b] = a


def nominal_direction(moved: Array) -> Array:
    """Return the direction of the sum of some steps, shape (D,).

    Raises DirectionError where they cancel out.
    """
    length = np.linalg.norm(moved)
    if not length > 0:
        raise DirectionError(
            "steps of one direction cancel out: demonstrate more, or find directions otherwise"
        )
    return np.asarray(moved / length)
