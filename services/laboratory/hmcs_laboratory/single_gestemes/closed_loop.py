"""Closed-loop gesteme models: what a hand that follows a path does next, from where it is and goes.

A motion is a mean path of nodes one mean step apart. The hand corrects itself: it aims at the path
a little ahead, keeps part of its heading, and errs (3.1.5 as a generative model, with its constants
learned). How far along it is, its phase, is a distribution over nodes near the hand. With bars for
expectations over the phase, e = x − μ̄ the hand's place beside the path, h its heading and δ the
mean step:

    u = unit(ā − e / (L δ))               direction wanted: along the path and back to it
    v = ρ h + (1 − ρ) u + b̄               direction expected; h = u while it is unknown
    p(d) = (1 − f − o) P(d; v, s̄) + f P(−d; v, s̄) + o / |sphere|

where d is the direction of the step, P the projected normal density of `projected_normal`,
a_n = (μ(n + L) − μ(n)) / (L δ), f the probability of a step backwards (3.3 allows it) and o that
of one that tells nothing. The phase moves on by −1 to 3 nodes and is weighed by the new place,
w'_n ∝ (Σ_m w_m T_{n−m}) exp(−|x' − μ_n|² / 2τ²). Its normalizer counts as evidence to a small power
only: how near the path the hand is follows from what it did before. Leaving is left to `exits`.

Shapes: M motions, N nodes of the longest, D axes; p pairs of a motion and a performance that is
compared with it, K nodes looked at around the phase. Lengths have the unit of the positions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.recognition.segment_filter.exits import exit_features, exit_probability
from hmcs_laboratory.single_gestemes.projected_normal import log_density

Indices = NDArray[np.intp]

NODES_LOOKED_AT = 10
"""K."""

_BACK = 1
_ADVANCE = (0.15, 0.25, 0.35, 0.20, 0.05)
"""T: the phase moves on by −1, 0, 1, 2 or 3 nodes with these probabilities."""


class Paths(NamedTuple):
    """Mean paths as nodes a mean step apart, each from its origin."""

    nodes: Array
    """μ, shape (M, N, D); after a path's last node it is repeated."""
    counts: Indices
    """Nodes of each path, shape (M,)."""


class ClosedLoop(NamedTuple):
    """What is known of motions."""

    paths: Paths
    ahead: Array
    """a, shape (M, N, D)."""
    correction: Array
    """b: where hands steadily go beside the direction expected, shape (M, N, D)."""
    variance: Array
    """s of the direction, shape (M, N)."""
    normal: Array
    """Unit direction in which a path's end is passed, shape (M, D)."""
    exit_weights: Array
    """Of the exit's logistic regression, shape (10,); see `exits`."""
    step: float
    """δ: mean length of a step."""
    persistence: float
    """ρ: share of its heading that the hand keeps."""
    look_ahead_steps: float
    """L."""
    backwards: float
    """f."""
    outlier: float
    """o."""
    spread: float
    """τ: standard deviation of the place about its node."""
    position_power: float
    """The power to which the place counts as evidence."""


class Phases(NamedTuple):
    """Where along their paths performances are."""

    first: Indices
    """The first node looked at, shape (p,)."""
    weights: Array
    """P(node first + k), shape (p, K); zero past the end."""


class State(NamedTuple):
    """What pairs keep from step to step; motions are kept beside it."""

    phases: Phases
    heading: Array
    """h, shape (p, D); NaN while it is unknown."""


class Advanced(NamedTuple):
    """What one step tells about pairs."""

    state: State
    log_density: Array
    """Log density of the step, shape (p,)."""
    leaving: Array
    """P(the motion ends with this step), shape (p,)."""


class Expected(NamedTuple):
    """What hands in some phase are expected to do."""

    kept: Array
    """ρ h + (1 − ρ) u, shape (p, D)."""
    direction: Array
    """v, shape (p, D)."""
    variance: Array
    """s̄, shape (p,)."""


def opened(pairs: int, dimensions: int) -> State:
    """Return the state of pairs before the first step: at the origin, heading unknown."""
    return State(phases_at_start(pairs), np.full((pairs, dimensions), np.nan))


def advance(
    model: ClosedLoop, motion: Indices, state: State, place: Array, move: Array
) -> Advanced:
    """Take one step of every pair.

    `motion`, (p,), is the motion each is compared with; `place`, (p, D), where its performance is,
    from its first position; `move`, (p, D), its displacement, not zero.
    """
    direction = unit(move)
    expected = expectation(model, motion, state, place)
    forwards, backwards, nothing = direction_densities(
        direction, expected.direction, expected.variance, model.backwards, model.outlier
    )
    density = forwards + backwards + nothing
    # A step backwards leaves the heading as it was; one that tells nothing may be either.
    heading = (2.0 * (forwards + 0.5 * nothing) / density - 1.0)[:, None] * direction
    there = place + move
    phases, log_near = next_phases(model.paths, motion, state.phases, there, model.spread)
    last = model.paths.counts[motion] - 1
    features = exit_features(
        np.maximum(last - mean_node(phases), 0.0),
        (there - model.paths.nodes[motion, last]) / model.step,
        model.normal[motion],
        heading - expected.kept,
    )
    return Advanced(
        State(phases, heading),
        np.log(density) + model.position_power * log_near,
        exit_probability(model.exit_weights, features),
    )


def expectation(model: ClosedLoop, motion: Indices, state: State, place: Array) -> Expected:
    """Return what each pair's hand is expected to do at a place, (p, D), from its origin."""
    wanted = wanted_direction(
        over_phases(model.ahead, motion, state.phases),
        place - over_phases(model.paths.nodes, motion, state.phases),
        model.look_ahead_steps * model.step,
    )
    heading = np.where(np.isnan(state.heading), wanted, state.heading)
    kept = model.persistence * heading + (1.0 - model.persistence) * wanted
    return Expected(
        kept,
        kept + over_phases(model.correction, motion, state.phases),
        over_phases(model.variance, motion, state.phases),
    )


def wanted_direction(ahead: Array, beside: Array, look_ahead: float) -> Array:
    """Return u, shape (p, D), of ā, e, both (p, D), and the length L δ."""
    return unit(ahead - beside / look_ahead)


def direction_densities(
    direction: Array, expected: Array, variance: Array, backwards: float, outlier: float
) -> tuple[Array, Array, float]:
    """Return the three terms of p(d): forwards, (p,), backwards, (p,), and telling nothing."""
    sphere = 2.0 * np.pi * (direction.shape[1] - 1)
    forwards = (1.0 - backwards - outlier) * np.exp(log_density(direction, expected, variance))
    back = backwards * np.exp(log_density(-direction, expected, variance))
    return forwards, back, outlier / sphere


def phases_at_start(pairs: int) -> Phases:
    """Return phases at the first node."""
    weights = np.zeros((pairs, NODES_LOOKED_AT))
    weights[:, 0] = 1.0
    return Phases(np.zeros(pairs, dtype=np.intp), weights)


def next_phases(
    paths: Paths, motion: Indices, phases: Phases, there: Array, spread: float
) -> tuple[Phases, Array]:
    """Return the phases at the next place, (p, D), and the log of their normalizers, (p,).

    A forward recursion over the few nodes near the hand, which move along with it: one over all
    nodes of all paths would cost many times as much.
    """
    pairs = np.arange(len(motion))
    looked_at = phases.weights.shape[1]
    moved = np.zeros((len(motion), looked_at + len(_ADVANCE) - 1))
    for shift, share in enumerate(_ADVANCE):
        moved[:, shift : shift + looked_at] += share * phases.weights
    begin, last = phases.first - _BACK, paths.counts[motion] - 1
    node = begin[:, None] + np.arange(moved.shape[1])
    beyond = node > last[:, None]
    over = np.where(beyond, moved, 0.0).sum(axis=1)
    moved[beyond | (node < 0)] = 0.0
    # What would pass the end stays there.
    at_end = np.clip(last - begin, 0, moved.shape[1] - 1)
    moved[pairs, at_end] += over
    nearest = paths.nodes[motion[:, None], np.clip(node, 0, last[:, None])]
    log_near = ((there[:, None] - nearest) ** 2).sum(axis=2) * (-0.5 / spread**2)
    log_near[moved <= 0] = -np.inf
    top = log_near.max(axis=1)
    moved *= np.exp(log_near - top[:, None])
    total = moved.sum(axis=1)
    moved /= total[:, None]
    mean = begin + moved @ np.arange(moved.shape[1])
    first = np.round(mean).astype(np.intp) - looked_at // 2 + 1
    first = np.clip(first, 0, np.maximum(last + 1 - looked_at, 0))
    first = np.clip(first, np.maximum(begin, 0), begin + len(_ADVANCE) - 1)
    weights = np.take_along_axis(moved, (first - begin)[:, None] + np.arange(looked_at), axis=1)
    weights /= np.maximum(weights.sum(axis=1), 1e-300)[:, None]
    return Phases(first, weights), top + np.log(total)


def over_phases(values: Array, motion: Indices, phases: Phases) -> Array:
    """Return expectations over the phase of values a node, (M, N, …): shape (p, …)."""
    node = phases.first[:, None] + np.arange(phases.weights.shape[1])
    near = values[motion[:, None], np.minimum(node, values.shape[1] - 1)]
    return np.asarray(np.einsum("pk,pk...->p...", phases.weights, near))


def mean_node(phases: Phases) -> Array:
    """Return the expected node of each pair, shape (p,)."""
    return np.asarray(phases.first + phases.weights @ np.arange(phases.weights.shape[1]))


def log_likelihoods(model: ClosedLoop, performances: Sequence[Array], *, whole: bool) -> Array:
    """Return log P(steps | motion) of performances under all motions, shape (n, M).

    Of each: positions, shape (T, D), T of 2 at least, no two successive ones equal. `whole` means
    that the last step ends the motion; without it, that no step did so far.
    """
    cumulative, leaving = _followed(model, performances)
    last = np.array([len(positions) - 2 for positions in performances])
    rows = np.arange(len(performances))
    total = cumulative[last, rows]
    if not whole:
        return np.asarray(total)
    left = leaving[last, rows]
    return np.asarray(total - np.log1p(-left) + np.log(left))


def causal_log_likelihoods(model: ClosedLoop, positions: Array) -> Array:
    """Return log P(steps so far, none the last | motion) after each step, shape (T − 1, M)."""
    return np.asarray(_followed(model, [positions])[0][:, 0])


def unit(vectors: Array) -> Array:
    """Return vectors, shape (…, D), at length one; 0 stays 0."""
    length = np.sqrt((vectors * vectors).sum(axis=-1, keepdims=True))
    return np.asarray(vectors / np.maximum(length, 1e-300))


def _followed(model: ClosedLoop, performances: Sequence[Array]) -> tuple[Array, Array]:
    """Sums of log densities with staying, and P(leaving), after each step: both (T, n, M)."""
    motions, dimensions = model.normal.shape
    count = len(performances)
    steps = np.array([len(positions) - 1 for positions in performances])
    places = np.zeros((int(steps.max()) + 1, count, dimensions))
    for k, positions in enumerate(performances):
        places[: len(positions), k] = positions - positions[0]
    gained = np.zeros((int(steps.max()), count, motions))
    leaving = np.full_like(gained, 0.5)
    # The longest first: those that still move are then a leading stretch of the pairs.
    order = np.argsort(-steps, kind="stable")
    performance = np.repeat(order, motions)
    motion = np.tile(np.arange(motions), count)
    state = opened(len(motion), dimensions)
    for t in range(int(steps.max())):
        going = int((steps > t).sum()) * motions
        performance, motion = performance[:going], motion[:going]
        phases = Phases(state.phases.first[:going], state.phases.weights[:going])
        here, there = places[t, performance], places[t + 1, performance]
        advanced = advance(model, motion, State(phases, state.heading[:going]), here, there - here)
        gained[t, performance, motion] = advanced.log_density + np.log1p(-advanced.leaving)
        leaving[t, performance, motion] = advanced.leaving
        state = advanced.state
    return gained.cumsum(axis=0), leaving
