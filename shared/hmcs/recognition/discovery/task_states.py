"""Task states from the order in which gestemes were performed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array

Integers = NDArray[np.int64]


class TaskStates(NamedTuple):
    """States, and the chain between them; S states."""

    gestemes: Integers
    """Index of the gesteme each is performed with, shape (S,)."""
    sequences: tuple[Integers, ...]
    """For each demonstration the state of each of its pieces."""
    starts: Integers
    """How many demonstrations began in each, shape (S,)."""
    followed: Integers
    """How often a state, the row, was followed by another, the column, shape (S, S)."""

    @property
    def initial(self) -> Array:
        """P(first state), shape (S,)."""
        return np.asarray(self.starts / self.starts.sum())

    @property
    def transition(self) -> Array:
        """P(next state | state over and the task not), shape (S, S).

        A row of zeros where nothing ever followed.
        """
        return np.asarray(self.followed / np.maximum(self.followed.sum(axis=1, keepdims=True), 1))


def task_states(sequences: Sequence[Integers]) -> TaskStates:
    """Return the states of demonstrations whose pieces have these gestemes, in order.

    A state is a gesteme the first, second, … time that it comes in a demonstration: an arc between
    three lines serves two states (thesis, fig. 4.11), and gestemes performed once each in any
    order are a state each. Where all demonstrations repeat the same round of pieces, and one does
    so twice, a state is a place in the round. States are numbered as they first occur.
    """
    rounds = _round(sequences)
    named = [
        [(int(g), t % rounds if rounds else int((own[:t] == g).sum())) for t, g in enumerate(own)]
        for own in sequences
    ]
    number = {name: k for k, name in enumerate(dict.fromkeys(n for own in named for n in own))}
    found = tuple(np.array([number[name] for name in own], dtype=np.int64) for own in named)
    starts = np.zeros(len(number), dtype=np.int64)
    followed = np.zeros((len(number), len(number)), dtype=np.int64)
    for own in found:
        starts[own[0]] += 1
        np.add.at(followed, (own[:-1], own[1:]), 1)
    return TaskStates(np.array([gesteme for gesteme, _ in number]), found, starts, followed)


def _round(sequences: Sequence[Integers]) -> int:
    """Length of the round that all sequences repeat; 0 where there is none."""
    longest = max(sequences, key=len)
    for length in range(2, len(longest) // 2 + 1):
        base = np.resize(longest[:length], len(longest))
        if all((own == base[: len(own)]).all() for own in sequences):
            return length
    return 0
