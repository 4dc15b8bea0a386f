"""Learning closed-loop models of motions from performances of them.

Each performance is followed along the mean path of the others of its motion, so that what is
learned holds for performances not yet seen. Persistence and look-ahead are shared by all motions
and chosen by likelihood from a grid; variance and probability of steps backwards follow by
expectation maximization; corrections and variances of the nodes are MAP estimates about them.
Shapes as in `closed_loop`; R rows: the steps of all performances that were followed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.recognition.segment_filter.exits import DEFAULT_WEIGHTS, exit_features, fit_exit
from hmcs_laboratory.single_gestemes.closed_loop import (
    ClosedLoop,
    Indices,
    Paths,
    Phases,
    mean_node,
    next_phases,
    over_phases,
    phases_at_start,
    unit,
    wanted_direction,
)
from hmcs_laboratory.single_gestemes.even_points import length_of, step_lengths
from hmcs_laboratory.single_gestemes.mean_paths import ahead, normals, padded, smoothed_mean_path
from hmcs_laboratory.single_gestemes.step_errors import Spread, errors, fitted_spread

_ITERATIONS = 6
"""Of expectation maximization at each point of the grid, which begins with the best so far."""


class ClosedLoopSettings(NamedTuple):
    """The choices of learning; defaults are good without tuning."""

    smoothing: float = 3.0
    """Weight of the squared second differences of a mean path."""
    spread_steps: float = 1.0
    """τ in steps."""
    position_power: float = 0.1
    look_ahead_steps: tuple[float, ...] = (1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 10.0)
    """L is one of these."""
    persistence: tuple[float, ...] = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
    """ρ is one of these."""
    outlier: float = 1e-3
    least_variance: float = 0.0025
    """No agreement between performances is believed below this."""
    end_steps: float = 4.0
    """The last steps do not tell ρ and L: hands end in many ways."""
    correction_prior_steps: float = 8.0
    """So many steps without any correction are added to those seen at a node."""
    variance_prior_steps: float = 20.0
    """So many steps with the variance usual so far from either end are added."""
    profile_steps: int = 6
    """Up to here from either end, the usual variance is one of its own for each node."""
    one_persistence: float = 0.7
    """These stand where no motion was performed twice, so none can be left out."""
    one_look_ahead_steps: float = 3.0
    one_deviation: float = 0.3
    """√s."""
    one_backwards: float = 0.01
    one_spread_share: float = 0.05
    """τ as a share of the mean length of paths, if that is more."""
    one_position_power: float = 0.5


DEFAULT_SETTINGS = ClosedLoopSettings()


class _Steering(NamedTuple):
    """What all motions share."""

    look_ahead_steps: float
    persistence: float
    variance: float
    backwards: float


class _Rows(NamedTuple):
    """Every step of performances that were followed along a path made without them."""

    motion: Indices
    """The motion performed, shape (R,)."""
    track: Indices
    """Which performance, and so which path of `paths`, shape (R,)."""
    before: Phases
    """Phases before the step."""
    after: Phases
    place: Array
    """Before the step, (R, D)."""
    move: Array
    last: Array
    """Whether it is its performance's last, (R,)."""


def fit_closed_loop(
    by_motion: Sequence[Sequence[Array]], settings: ClosedLoopSettings = DEFAULT_SETTINGS
) -> ClosedLoop:
    """Return what is known of motions from performances of them.

    Of each motion at least one: positions, shape (T, D), T of 2 at least, no two successive ones
    equal. Turning, moving or scaling all of them turns, moves or scales the model.
    """
    own = [[positions - positions[0] for positions in motion] for motion in by_motion]
    step = float(np.mean(np.concatenate([step_lengths(p) for motion in own for p in motion])))
    paths = padded([smoothed_mean_path(motion, step, settings.smoothing) for motion in own])
    if all(len(motion) == 1 for motion in own):
        return _from_one_each(own, paths, step, settings)
    spread = settings.spread_steps * step
    left_out, rows = _followed(own, step, spread, settings)
    steering = _steering(left_out, rows, step, settings)
    model = ClosedLoop(
        paths,
        ahead(paths, step, steering.look_ahead_steps),
        np.zeros_like(paths.nodes),
        np.full(paths.nodes.shape[:2], steering.variance),
        normals(own),
        DEFAULT_WEIGHTS,
        step,
        steering.persistence,
        steering.look_ahead_steps,
        steering.backwards,
        settings.outlier,
        spread,
        settings.position_power,
    )
    wanted, heading, direction = _regressors(left_out, rows, step, steering.look_ahead_steps)
    kept = steering.persistence * heading + (1.0 - steering.persistence) * wanted
    model = model._replace(exit_weights=_exit(model, left_out, rows, kept, direction))
    return _with_node_estimates(model, left_out, rows, kept, direction, settings)


def _from_one_each(
    own: Sequence[Sequence[Array]], paths: Paths, step: float, settings: ClosedLoopSettings
) -> ClosedLoop:
    mean_length = float(np.mean([length_of(motion[0]) for motion in own]))
    return ClosedLoop(
        paths,
        ahead(paths, step, settings.one_look_ahead_steps),
        np.zeros_like(paths.nodes),
        np.full(paths.nodes.shape[:2], settings.one_deviation**2),
        normals(own),
        DEFAULT_WEIGHTS,
        step,
        settings.one_persistence,
        settings.one_look_ahead_steps,
        settings.one_backwards,
        settings.outlier,
        max(settings.spread_steps * step, settings.one_spread_share * mean_length),
        settings.one_position_power,
    )


def _followed(
    own: Sequence[Sequence[Array]], step: float, spread: float, settings: ClosedLoopSettings
) -> tuple[Paths, _Rows]:
    """Every performance that is not its motion's only one, along the mean path of the others."""
    performed = [(m, k) for m, motion in enumerate(own) for k in range(len(motion))]
    performed = [(m, k) for m, k in performed if len(own[m]) > 1]
    # The longest first: those that still move are then a leading stretch.
    performed.sort(key=lambda pair: -len(own[pair[0]][pair[1]]))
    motions = [own[m][k] for m, k in performed]
    others = [[p for j, p in enumerate(own[m]) if j != k] for m, k in performed]
    paths = padded([smoothed_mean_path(rest, step, settings.smoothing) for rest in others])
    motion = np.array([m for m, _ in performed])
    phases, parts = phases_at_start(len(motions)), []
    for t in range(len(motions[0]) - 1):
        going = sum(len(positions) > t + 1 for positions in motions)
        track = np.arange(going)
        here = np.stack([positions[t] for positions in motions[:going]])
        there = np.stack([positions[t + 1] for positions in motions[:going]])
        before = Phases(phases.first[:going], phases.weights[:going])
        phases, _ = next_phases(paths, track, before, there, spread)
        last = np.array([len(positions) == t + 2 for positions in motions[:going]])
        parts.append(_Rows(motion[:going], track, before, phases, here, there - here, last))
    return paths, _by_track(parts)


def _by_track(parts: Sequence[_Rows]) -> _Rows:
    """Rows of all steps, performance by performance in order of time."""
    track = np.concatenate([part.track for part in parts])
    order = np.argsort(track, kind="stable")

    def joined(pick: Sequence[NDArray[Any]]) -> NDArray[Any]:
        return np.asarray(np.concatenate(pick)[order])

    return _Rows(
        joined([p.motion for p in parts]),
        track[order],
        Phases(joined([p.before.first for p in parts]), joined([p.before.weights for p in parts])),
        Phases(joined([p.after.first for p in parts]), joined([p.after.weights for p in parts])),
        joined([p.place for p in parts]),
        joined([p.move for p in parts]),
        joined([p.last for p in parts]),
    )


def _regressors(
    paths: Paths, rows: _Rows, step: float, look_ahead_steps: float
) -> tuple[Array, Array, Array]:
    """Direction wanted, heading and direction taken of each row, all (R, D)."""
    wanted = wanted_direction(
        over_phases(ahead(paths, step, look_ahead_steps), rows.track, rows.before),
        rows.place - over_phases(paths.nodes, rows.track, rows.before),
        look_ahead_steps * step,
    )
    direction = unit(rows.move)
    backwards = (direction * wanted).sum(axis=1) < 0
    signed = np.where(backwards[:, None], -direction, direction)
    heading = np.concatenate([wanted[:1], signed[:-1]])
    first = np.concatenate([[True], rows.last[:-1].astype(bool)])
    heading[first] = wanted[first]
    return wanted, heading, direction


def _steering(paths: Paths, rows: _Rows, step: float, settings: ClosedLoopSettings) -> _Steering:
    remaining = paths.counts[rows.track] - 1 - mean_node(rows.before)
    inner = remaining >= settings.end_steps
    if not inner.any():
        inner[:] = True
    best, spread = (0.0, 0.0), Spread(0.1, 0.02, -np.inf)
    for look_ahead in settings.look_ahead_steps:
        wanted, heading, direction = _regressors(paths, rows, step, look_ahead)
        for persistence in settings.persistence:
            kept = persistence * heading[inner] + (1.0 - persistence) * wanted[inner]
            found = fitted_spread(
                direction[inner],
                kept,
                spread,
                settings.outlier,
                least_variance=settings.least_variance,
                iterations=_ITERATIONS,
            )
            if found.log_density > spread.log_density:
                best, spread = (look_ahead, persistence), found
    return _Steering(*best, spread.variance, spread.backwards)


def _exit(model: ClosedLoop, paths: Paths, rows: _Rows, kept: Array, direction: Array) -> Array:
    last = paths.counts[rows.track] - 1
    signed = np.where(((direction * kept).sum(axis=1) < 0)[:, None], -direction, direction)
    features = exit_features(
        np.maximum(last - mean_node(rows.after), 0.0),
        (rows.place + rows.move - paths.nodes[rows.track, last]) / model.step,
        model.normal[rows.motion],
        signed - kept,
    )
    return fit_exit(features, rows.last.astype(bool))


def _with_node_estimates(
    model: ClosedLoop,
    paths: Paths,
    rows: _Rows,
    kept: Array,
    direction: Array,
    settings: ClosedLoopSettings,
) -> ClosedLoop:
    """MAP of b and s at each node from the errors of performances followed along other paths."""
    nodes = _nodes_of_model(model, paths, rows)
    shape = model.variance.shape
    seen = _added(shape, rows, nodes, np.ones(len(kept)))
    variances = over_phases(model.variance, rows.motion, rows.before)
    error = errors(direction, kept, variances, model.backwards, model.outlier).mean
    total = np.stack([_added(shape, rows, nodes, column) for column in error.T], axis=2)
    apart = np.subtract.outer(np.arange(shape[1]), np.arange(shape[1])) / 0.7
    neighbors = np.exp(-0.5 * apart**2)
    correction = np.einsum("nk,mkd->mnd", neighbors, total) / (
        (seen @ neighbors)[:, :, None] + settings.correction_prior_steps
    )
    inside = np.arange(shape[1]) < model.paths.counts[:, None]
    correction[~inside] = 0.0
    share = rows.before.weights / rows.before.weights.sum(axis=1, keepdims=True)
    at_node = correction[rows.motion[:, None], nodes]
    expected = kept + np.einsum("rk,rkd->rd", share, at_node)
    squares = errors(direction, expected, variances, model.backwards, model.outlier).square
    spread = _added(shape, rows, nodes, squares / kept.shape[1])
    usual = _profile(model, seen, spread, settings)
    prior = settings.variance_prior_steps
    variance = np.maximum((spread + prior * usual) / (seen + prior), settings.least_variance)
    return model._replace(correction=correction, variance=variance)


def _nodes_of_model(model: ClosedLoop, paths: Paths, rows: _Rows) -> Indices:
    """Nodes of the model's paths where rows looked at nodes of their own, shape (R, K)."""
    own, theirs = paths.counts[rows.track] - 1, model.paths.counts[rows.motion] - 1
    node = rows.before.first[:, None] + np.arange(rows.before.weights.shape[1])
    share = np.minimum(node / own[:, None], 1.0)
    return np.asarray(np.round(share * theirs[:, None]).astype(np.intp))


def _added(shape: tuple[int, ...], rows: _Rows, nodes: Indices, values: Array) -> Array:
    """Sums over rows of values, (R,), by motion and phase, shape (M, N)."""
    total = np.zeros(shape)
    np.add.at(total, (rows.motion[:, None], nodes), rows.before.weights * values[:, None])
    return total


def _profile(model: ClosedLoop, seen: Array, spread: Array, settings: ClosedLoopSettings) -> Array:
    """The variance usual so many nodes from the end, or from the start, shape (M, N)."""
    reach = settings.profile_steps
    node = np.arange(seen.shape[1])
    to_end = np.clip(model.paths.counts[:, None] - 1 - node, 0, reach)
    from_start = np.broadcast_to(np.minimum(node, reach), seen.shape)
    near_end = to_end < reach
    kind = np.where(near_end, to_end, reach + 1 + from_start)
    count = 2 * (reach + 1)
    steps = np.bincount(kind.ravel(), seen.ravel(), count)
    squares = np.bincount(kind.ravel(), spread.ravel(), count)
    # From everywhere: what is usual where a node of that kind was seldom seen.
    overall = float(spread.sum() / max(float(seen.sum()), 1e-12))
    prior = settings.variance_prior_steps
    return np.asarray(((squares + prior * overall) / (steps + prior))[kind])
