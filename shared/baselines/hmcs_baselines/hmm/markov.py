"""Observable Markov models: every state is seen as it is (thesis 2.1.1).

Shapes: N states, T steps. States are indices 0..N−1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hmcs.arrays import Array
from hmcs.errors import UserError

States = NDArray[np.int64]

SUM_TOLERANCE = 1e-9
"""Probabilities that should sum to one may miss it by this much."""


class MarkovModelError(UserError, ValueError):
    """Probabilities that make no Markov model, or states it cannot speak of; says which and why."""


class MarkovModel(NamedTuple):
    """A Markov model of order one; made and checked by `markov_model`."""

    initial: Array
    """π, shape (N,)."""
    transition: Array
    """A[i, j] = P(state j next | state i), shape (N, N)."""


class HigherOrder(NamedTuple):
    """A model of order K as one of order one over histories of K states."""

    model: MarkovModel
    """Over N^K histories."""
    histories: States
    """The K states of each history, oldest first, shape (N^K, K)."""


def markov_model(initial: ArrayLike, transition: ArrayLike) -> MarkovModel:
    """Return the model with initial probabilities (N,) and transition probabilities (N, N).

    Raises MarkovModelError when a shape is wrong or a row is no probability distribution.
    """
    transition = checked_rows(transition, "transition", columns=None)
    if transition.shape[0] != transition.shape[1]:
        raise MarkovModelError(
            f"transition has shape {transition.shape}: give a square matrix, a row for each state"
        )
    start = checked_rows(np.asarray(initial, dtype=float)[None], "initial", len(transition))[0]
    return MarkovModel(start, transition)


def log_probability(model: MarkovModel, states: ArrayLike) -> float:
    """Return log P(state sequence) of a sequence (T,) (2.4); −inf for an impossible one.

    Raises MarkovModelError for an empty sequence or a state the model does not have.
    """
    path = checked_states(states, len(model.initial))
    with np.errstate(divide="ignore"):
        return float(
            np.log(model.initial[path[0]])
            + np.log(model.transition[path[:-1], path[1:]]).sum(initial=0.0)
        )


def predict(model: MarkovModel, distribution: ArrayLike, steps: int) -> Array:
    """Return the distribution over states (N,) so many steps after `distribution` (N,).

    Raises MarkovModelError when `distribution` is none, or `steps` is negative.
    """
    if steps < 0:
        raise MarkovModelError(f"cannot predict {steps} steps ahead: give 0 or more")
    row = np.asarray(distribution, dtype=float)[None]
    here = checked_rows(row, "distribution", len(model.initial))[0]
    return np.asarray(here @ np.linalg.matrix_power(model.transition, steps))


def stationary(model: MarkovModel) -> Array:
    """Return the distribution (N,) that a step of the model leaves as it is.

    Raises MarkovModelError when there are several: when the states fall into more than one set
    that is never left.
    """
    reached = _reachable(model.transition)
    kept = (~reached | reached.T).all(axis=1)
    closed = np.unique(reached[kept], axis=0)
    if len(closed) > 1:
        sets = sorted(np.flatnonzero(row).tolist() for row in closed)
        raise MarkovModelError(
            f"no single stationary distribution: the sets of states {sets} are never left; "
            "ask for that of one set"
        )
    inside = np.flatnonzero(closed[0])
    balance = np.eye(len(inside)) - model.transition[np.ix_(inside, inside)].T
    balance[-1] = 1.0
    result = np.zeros(len(model.initial))
    result[inside] = np.linalg.solve(balance, np.eye(len(inside))[-1])
    return result


def mean_stay_steps(model: MarkovModel) -> Array:
    """Return the mean number of successive steps in each state, (N,): 1 / (1 − A[i, i])."""
    leaving = 1.0 - np.diag(model.transition)
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 / leaving)


def sample(model: MarkovModel, steps: int, rng: np.random.Generator) -> States:
    """Return a state sequence (T,) drawn from the model.

    Raises MarkovModelError when `steps` is less than one.
    """
    if steps < 1:
        raise MarkovModelError(f"cannot draw a sequence of {steps} states: ask for 1 or more")
    path = np.empty(steps, dtype=np.int64)
    path[0] = rng.choice(len(model.initial), p=model.initial)
    for t in range(1, steps):
        path[t] = rng.choice(len(model.initial), p=model.transition[path[t - 1]])
    return path


def learned(
    sequences: Sequence[ArrayLike],
    states: int,
    *,
    pseudo_count: float = 0.0,
    allowed: ArrayLike | None = None,
) -> MarkovModel:
    """Return the most likely model with so many states, from state sequences, by counting.

    `pseudo_count` is added to the count of every first state and every transition that `allowed`
    (N, N) does not rule out; a transition that is ruled out stays a structural zero.
    Raises MarkovModelError when there is no sequence, a sequence takes a transition that is ruled
    out, or nothing was seen to follow a state and no `pseudo_count` stands in.
    """
    if not sequences:
        raise MarkovModelError("no state sequence to learn from: give one or more")
    possible = np.ones((states, states), dtype=bool)
    if allowed is not None:
        possible = np.asarray(allowed, dtype=bool)
        if possible.shape != (states, states):
            raise MarkovModelError(
                f"allowed has shape {possible.shape}: {(states, states)} is expected"
            )
    first = np.full(states, pseudo_count)
    counts = np.where(possible, pseudo_count, 0.0)
    for number, sequence in enumerate(sequences):
        path = checked_states(sequence, states)
        ruled_out = np.flatnonzero(~possible[path[:-1], path[1:]])
        if len(ruled_out):
            t = int(ruled_out[0])
            raise MarkovModelError(
                f"sequence {number} goes from state {path[t]} to {path[t + 1]} at step {t + 1}, "
                "which the topology rules out: correct the labels or allow the transition"
            )
        first[path[0]] += 1.0
        np.add.at(counts, (path[:-1], path[1:]), 1.0)
    leaving = counts.sum(axis=1)
    if not (leaving > 0).all():
        raise MarkovModelError(
            f"nothing was seen to follow state {int(np.argmin(leaving > 0))}: give sequences in "
            "which something does, or a pseudo_count and an allowed transition"
        )
    return MarkovModel(first / first.sum(), counts / leaving[:, None])


def expanded(initial: ArrayLike, transition: ArrayLike) -> HigherOrder:
    """Return a model of order K as one of order one over histories of K states (2.1.1).

    `transition` has K + 1 axes of length N: P(next | last K states), oldest first; `initial` has K:
    P(first K states). Raises MarkovModelError when they do not, or are no distributions.
    """
    table, start = np.asarray(transition, dtype=float), np.asarray(initial, dtype=float)
    order = table.ndim - 1
    if order < 1 or len(set(table.shape)) != 1 or start.shape != table.shape[1:]:
        raise MarkovModelError(
            f"shapes {start.shape} of initial and {table.shape} of transition do not belong to a "
            "model of order K over N states: give K and K + 1 axes of length N"
        )
    states = table.shape[0]
    count = states**order
    rows = checked_rows(table.reshape(count, states), "transition", states)
    chain = np.zeros((count, count))
    here = np.repeat(np.arange(count), states)
    chain[here, _following(count, states)] = rows.ravel()
    histories = np.stack(np.unravel_index(np.arange(count), start.shape), axis=1)
    return HigherOrder(markov_model(start.ravel(), chain), histories.astype(np.int64))


def history_sequence(states: ArrayLike, count: int, order: int) -> States:
    """Return the histories (T − order + 1,) that a sequence (T,) over `count` states passes.

    They index the states of `expanded`, so `learned` on them learns a model of that order.
    Raises MarkovModelError when the sequence is shorter than `order`.
    """
    path = checked_states(states, count)
    if order < 1 or len(path) < order:
        raise MarkovModelError(
            f"a sequence of {len(path)} states has no history of {order}: give an order of 1 or "
            "more and at least as many states"
        )
    windows = np.lib.stride_tricks.sliding_window_view(path, order)
    return np.asarray(windows @ count ** np.arange(order - 1, -1, -1), dtype=np.int64)


def history_topology(count: int, order: int) -> NDArray[np.bool_]:
    """Return which history can follow which, (N^order, N^order): all but the newest state stay."""
    histories = count**order
    possible = np.zeros((histories, histories), dtype=bool)
    possible[np.repeat(np.arange(histories), count), _following(histories, count)] = True
    return possible


def enumeration_operations(states: int, steps: int) -> int:
    """Return the operations of evaluation by all state sequences, 2·T·N^T (after 2.4)."""
    return 2 * steps * int(states**steps)


def forward_operations(states: int, steps: int) -> int:
    """Return the operations of evaluation by the forward recursion, N²·T (after 2.7)."""
    return states**2 * steps


def checked_rows(
    values: ArrayLike, name: str, columns: int | None, *, leaving: bool = False
) -> Array:
    """Return `values` as a matrix, each row a distribution over `columns` (any number if None).

    With `leaving`, a row may sum to less than one: what is missing is P(leaving the model).
    Raises MarkovModelError that names the matrix and the first wrong row.
    """
    rows = np.asarray(values, dtype=float)
    if rows.ndim != 2 or rows.size == 0 or columns not in (None, rows.shape[1]):
        expected = "(rows, columns)" if columns is None else f"(rows, {columns})"
        raise MarkovModelError(f"{name} has shape {rows.shape}: {expected}, not empty, is expected")
    sums = rows.sum(axis=1)
    fits = (rows >= 0).all(axis=1) & (sums <= 1.0 + SUM_TOLERANCE)
    if not leaving:
        fits &= sums >= 1.0 - SUM_TOLERANCE
    if not fits.all():
        row = int(np.argmin(fits))
        most = "at most " if leaving else ""
        raise MarkovModelError(
            f"row {row} of {name} is {rows[row].tolist()} with sum {sums[row]:.6g}: give "
            f"probabilities of 0 or more with a sum of {most}1"
        )
    return rows


def checked_states(states: ArrayLike, count: int) -> States:
    """Return `states` as a sequence (T,) of indices below `count`.

    Raises MarkovModelError when it is empty or holds anything else; names the first such step.
    """
    path = np.asarray(states)
    if path.ndim != 1 or len(path) == 0 or path.dtype.kind not in "iu":
        raise MarkovModelError(
            f"a state sequence has shape {path.shape} and type {path.dtype}: give a sequence of "
            "one or more state indices"
        )
    outside = (path < 0) | (path >= count)
    if outside.any():
        t = int(np.argmax(outside))
        raise MarkovModelError(
            f"step {t} of a state sequence is {path[t]}: the model has the states 0..{count - 1}"
        )
    return path.astype(np.int64)


def _following(histories: int, states: int) -> States:
    """The histories that follow each history, newest state 0..N−1, shape (N^K · N,)."""
    shifted = np.arange(histories) * states % histories
    return np.asarray((shifted[:, None] + np.arange(states)).ravel(), dtype=np.int64)


def _reachable(transition: Array) -> NDArray[np.bool_]:
    """Which state can be reached from which in any number of steps, itself included."""
    reached = (transition > 0) | np.eye(len(transition), dtype=bool)
    for _ in range(len(transition).bit_length()):
        reached = reached @ reached
    return np.asarray(reached)
