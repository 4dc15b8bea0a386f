"""Hierarchical hidden Markov models, as ordinary ones over their production states (thesis 2.1.3).

A state of the tree is a production state, which emits one observation, or an internal state, which
is a model of its own: it calls one of its children (vertical transition), goes from child to child
(horizontal transitions), and after a child may return to its parent (the terminating state). Every
call emits at least one observation, so between two observations control can only return through
some levels, go across once and descend again. Summing over all these ways is a closed form, level
by level, and the flattened model is exact (Fine, Singer & Tishby 1998).
Shapes: C children of an internal state, L production states in depth-first order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs.recognition.hmm.model import E, Hmm
from hmcs_baselines.hmm.markov import checked_rows

NodePath = tuple[str, ...]
"""The names from the root to a state of the tree."""


class HierarchyError(UserError, ValueError):
    """A tree that makes no hierarchical model; names the state."""


class Production(NamedTuple):
    """A state that emits one observation; how is said by the emission of the whole model."""

    name: str


@dataclass(frozen=True, eq=False)
class Internal:
    """A state that is a model of its own; made and checked by `internal`."""

    name: str
    children: tuple[Internal | Production, ...]
    entry: Array
    """P(child called first), shape (C,)."""
    transition: Array
    """P(child next | child before), shape (C, C)."""
    ending: Array
    """P(control returns to the parent | child before), shape (C,); with the row of transitions it
    sums to one."""


@dataclass(frozen=True, eq=False)
class Flattened(Generic[E]):
    """A hierarchical model as an HMM over its production states."""

    hmm: Hmm[E]
    """Where the root returns, the process ends: rows of A may sum to less than one."""
    paths: tuple[NodePath, ...]
    """Of each production state, root first, length L."""
    ending: Array
    """P(the root returns | production state before), shape (L,)."""


class _Flat(NamedTuple):
    paths: list[NodePath]
    entry: Array
    transition: Array
    ending: Array


def internal(
    name: str,
    children: tuple[Internal | Production, ...],
    entry: ArrayLike,
    transition: ArrayLike,
    ending: ArrayLike,
) -> Internal:
    """Return an internal state with C children, entry (C,), transition (C, C) and ending (C,).

    Raises HierarchyError when children are missing or share a name or a shape is wrong,
    MarkovModelError when probabilities do not sum to one.
    """
    names = [child.name for child in children]
    if not children or len(set(names)) < len(names):
        raise HierarchyError(
            f"internal state {name!r} has the children {names}: give one or more, each its own name"
        )
    count = len(children)
    first = checked_rows(np.asarray(entry, dtype=float)[None], f"entry of {name!r}", count)[0]
    across, back = np.asarray(transition, dtype=float), np.asarray(ending, dtype=float)
    if across.shape != (count, count) or back.shape != (count,):
        raise HierarchyError(
            f"transition of shape {across.shape} and ending of shape {back.shape} of {name!r}: "
            f"({count}, {count}) and ({count},) are expected for its {count} children"
        )
    checked_rows(
        np.hstack([across, back[:, None]]), f"transition and ending of {name!r}", count + 1
    )
    return Internal(name, tuple(children), first, across, back)


def flattened(root: Internal, emission: E) -> Flattened[E]:
    """Return the model as an HMM over production states.

    State l of `emission` belongs to the l-th production state, depth first. Raises HierarchyError
    when their numbers differ.
    """
    flat = _flat(root)
    if emission.states != len(flat.paths):
        raise HierarchyError(
            f"the emission has {emission.states} states, the tree {len(flat.paths)} production "
            f"states: give one for each of {['/'.join(path) for path in flat.paths]}"
        )
    hmm = Hmm(flat.entry, flat.transition, emission)
    return Flattened(hmm, tuple(flat.paths), flat.ending)


def summed(flat: Flattened[E], states: Array) -> dict[NodePath, Array]:
    """Return P(a state of the tree is active), shape (T,), for every path of the tree.

    `states` are probabilities of production states, shape (T, L): an internal state is active while
    one below it is. Raises HierarchyError for another shape.
    """
    if states.ndim != 2 or states.shape[1] != len(flat.paths):
        raise HierarchyError(
            f"probabilities of shape {states.shape}: (T, {len(flat.paths)}) is expected"
        )
    sums: dict[NodePath, Array] = {}
    for column, path in zip(states.T, flat.paths, strict=True):
        for depth in range(1, len(path) + 1):
            above = path[:depth]
            sums[above] = sums[above] + column if above in sums else column.copy()
    return sums


def _flat(node: Internal | Production) -> _Flat:
    """Flatten one call of a state: where it begins, moves and returns."""
    if isinstance(node, Production):
        return _Flat([(node.name,)], np.ones(1), np.zeros((1, 1)), np.ones(1))
    parts = [_flat(child) for child in node.children]
    child_of = np.repeat(np.arange(len(parts)), [len(part.paths) for part in parts])
    descent = np.concatenate([part.entry for part in parts])
    returning = np.concatenate([part.ending for part in parts])
    # A child that returned may be called again, or another: across, then down.
    transition = returning[:, None] * node.transition[np.ix_(child_of, child_of)] * descent
    for child, part in enumerate(parts):
        own = np.flatnonzero(child_of == child)
        transition[np.ix_(own, own)] += part.transition
    return _Flat(
        [(node.name, *path) for part in parts for path in part.paths],
        node.entry[child_of] * descent,
        transition,
        returning * node.ending[child_of],
    )
