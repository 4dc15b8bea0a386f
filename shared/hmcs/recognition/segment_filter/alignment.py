"""Gestemes performed larger, smaller or turned: each pair aligns its gesteme while it goes on.

A pair (gesteme, start) holds a Gaussian belief over a small similarity θ = (s, ω) about the
segment's origin: in phase n the hand is at (1 + s)·m_n + ω × m_n plus an error of variance Σ_n,
where m_n is the phase's mean place and θ ~ N(0, σ²I) before the first step. Errors taken as
isotropic, s and the turn decouple and their posterior has a closed form. Summed over the phases,
it leaves |m_n|² / λ of variance at a phase's place and 1 / λ at its direction, where
λ = σ⁻² + Σ w|m|². In the plane (1 + s, ω) is a complex factor, so the model is exact; in space it
is to first order in ω.
Shapes: p pairs, G gestemes, N phases, D axes, F = 2·D observed dimensions, R components of a turn
(0, 1 or 3 for D = 1, 2 or 3).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array

Integers = NDArray[np.int32]


class Alignment(NamedTuple):
    """How gestemes may be performed."""

    sigma: float = 0.0
    """Standard deviation of s and of each component of ω (rad); 0: as learned only."""
    temperature: float = 4.0
    """The information of a step about θ is divided by it: see `Scoring.temperature`."""


class Phases(NamedTuple):
    """What alignment needs to know of all gestemes."""

    means: Array
    """Place, m, then direction, shape (F, G, N)."""
    variances: Array
    """Of the same, shape (F, G, N)."""
    distance2: Array
    """|m_n|², m², shape (G, N)."""
    weight: Array
    """Information of a step in the phase about θ, per |m_n|², 1/m², shape (G, N)."""
    log_scale: Array
    """Constant of the densities; −∞ where there is no phase, shape (G, N)."""
    prior: float
    """σ⁻²."""


class Similarity(NamedTuple):
    """The belief over θ of each pair, with the sums over its steps that it is made of."""

    information: Array
    """Σ w|m|², shape (p,)."""
    stretch: Array
    """Σ w m·(x − m), shape (p,)."""
    torque: Array
    """Σ w m × x, shape (p, R)."""
    inertia: Array
    """Σ w m mᵀ as xx, yy, zz, xy, xz, yz, shape (p, 6); of no columns unless D = 3."""
    growth: Array
    """Mean of s, shape (p,)."""
    turn: Array
    """Mean of ω, rad, shape (p, R)."""


def phases_of(
    means: Array, variances: Array, possible: NDArray[np.bool_], alignment: Alignment
) -> Phases:
    """Return the tables of gestemes with means and variances of shape (G, N, F).

    `possible`, (G, N), is false in padding.
    """
    axes = means.shape[2] // 2
    return Phases(
        np.ascontiguousarray(np.moveaxis(means, 2, 0)),
        np.ascontiguousarray(np.moveaxis(variances, 2, 0)),
        (means[:, :, :axes] ** 2).sum(axis=2),
        axes / variances[:, :, :axes].sum(axis=2) / alignment.temperature,
        np.where(possible, -axes * np.log(2.0 * np.pi), -np.inf),
        alignment.sigma**-2,
    )


def as_learned(pairs: int, axes: int) -> Similarity:
    """Return the belief of pairs that have seen no step."""
    turns = (0, 1, 3)[axes - 1]
    return Similarity(
        np.zeros(pairs),
        np.zeros(pairs),
        np.zeros((pairs, turns)),
        np.zeros((pairs, 6 if axes == 3 else 0)),
        np.zeros(pairs),
        np.zeros((pairs, turns)),
    )


def joined(one: Similarity, other: Similarity) -> Similarity:
    """Return the beliefs of the pairs of both, one after the other."""
    return Similarity(*(np.concatenate(pair) for pair in zip(one, other, strict=True)))


def picked(belief: Similarity, which: NDArray[np.bool_] | NDArray[np.intp]) -> Similarity:
    """Return the beliefs of some pairs."""
    return Similarity(*(field[which] for field in belief))


def log_densities(
    phases: Phases, belief: Similarity, gesteme: Integers, where: Array, direction: Array
) -> Array:
    """Return the log density of what each pair observed in each phase, shape (p, N).

    `where` is each pair's displacement from its origin, m, (p, D); `direction` that of the step,
    (D,). Not by `log_gaussian`: every pair has variances of its own, multiplied on the way.
    """
    axes = where.shape[1]
    means = [table.take(gesteme, axis=0) for table in phases.means]
    spread = (1.0 / (phases.prior + belief.information))[:, None]
    at_place = phases.distance2.take(gesteme, axis=0) * spread
    expected = _moved(belief.growth[:, None], belief.turn.T[:, :, None], means[:axes])
    back = turned(belief, np.broadcast_to(direction, where.shape), back=True)
    distance, determinant = np.zeros_like(at_place), np.ones_like(at_place)
    for f, mean in enumerate((*expected, *means[axes:])):
        seen, extra = (where, at_place) if f < axes else (back, spread)
        variance = phases.variances[f].take(gesteme, axis=0) + extra
        error = seen[:, f % axes, None] - mean
        error *= error
        error /= variance
        distance += error
        determinant *= variance
    distance += np.log(determinant)
    distance *= -0.5
    distance += phases.log_scale.take(gesteme, axis=0)
    return distance


def updated(
    phases: Phases, belief: Similarity, gesteme: Integers, phase: Array, where: Array
) -> Similarity:
    """Return the belief after a step that led to `where`, m, (p, D).

    `phase` is the probability of each phase after the step, (p, N).
    """
    axes = where.shape[1]
    weight = phase * phases.weight.take(gesteme, axis=0)
    means = [table.take(gesteme, axis=0) for table in phases.means[:axes]]
    weighted = [weight * mean for mean in means]
    # Only the weighted mean place meets the observed one: it is the same for all phases.
    center = [each.sum(axis=1) for each in weighted]
    x = [where[:, axis] for axis in range(axes)]
    added = (weight * phases.distance2.take(gesteme, axis=0)).sum(axis=1)
    information = belief.information + added
    stretch = belief.stretch - added
    for c, seen in zip(center, x, strict=True):
        stretch = stretch + c * seen
    torque, inertia = belief.torque, belief.inertia
    if axes == 2:
        torque = torque + (center[0] * x[1] - center[1] * x[0])[:, None]
    elif axes == 3:
        torque = torque + np.stack(_cross(center, x), axis=1)
        pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
        inertia = inertia + np.stack(
            [(weighted[i] * means[j]).sum(axis=1) for i, j in pairs], axis=1
        )
    precision = phases.prior + information
    turn = _solved(phases.prior, inertia, torque) if axes == 3 else torque / precision[:, None]
    return Similarity(information, stretch, torque, inertia, stretch / precision, turn)


def placed(belief: Similarity, points: Array) -> Array:
    """Return where points of the gesteme are expected, m, shape (p, D) as `points`."""
    return np.stack(_moved(belief.growth, belief.turn.T, list(points.T)), axis=1)


def turned(belief: Similarity, directions: Array, *, back: bool = False) -> Array:
    """Return unit directions turned as the gesteme is, or back, shape (p, D); 0 stays 0."""
    turn = -belief.turn if back else belief.turn
    moved = np.stack(_moved(belief.growth, turn.T, list(directions.T)), axis=1)
    length = np.sqrt((moved**2).sum(axis=1))
    return np.asarray(moved / np.maximum(length, 1e-12)[:, None])


def _moved(growth: Array, turn: Array, point: Sequence[Array]) -> list[Array]:
    """(1 + s)·m + ω × m, axis by axis; `turn` holds a component of ω a row."""
    scale = 1.0 + growth
    if len(point) == 1:
        return [scale * point[0]]
    if len(point) == 2:
        return [scale * point[0] - turn[0] * point[1], scale * point[1] + turn[0] * point[0]]
    return [
        scale * place + crossed for place, crossed in zip(point, _cross(turn, point), strict=True)
    ]


def _cross(a: Sequence[Array] | Array, b: Sequence[Array]) -> list[Array]:
    return [a[k - 2] * b[k - 1] - a[k - 1] * b[k - 2] for k in range(3)]


def _solved(prior: float, inertia: Array, torque: Array) -> Array:
    """Solve ((σ⁻² + tr S)·I − S) ω = torque by Cramer's rule.

    A library's solver would round by how many pairs there are.
    """
    xx, yy, zz, xy, xz, yz = inertia.T
    a, b, c = prior + yy + zz, prior + xx + zz, prior + xx + yy
    first = (b * c - yz * yz, xy * c + yz * xz, xy * yz + b * xz)
    second = (first[1], a * c - xz * xz, a * yz + xy * xz)
    third = (first[2], second[2], a * b - xy * xy)
    determinant = a * first[0] - xy * first[1] - xz * first[2]
    x, y, z = torque.T
    rows = (first, second, third)
    return np.stack([(row[0] * x + row[1] * y + row[2] * z) / determinant for row in rows], axis=1)
