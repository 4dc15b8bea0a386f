"""The task level's chain: which states there are, what follows what, and with which gestemes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.task import Task

Integers = NDArray[np.int32]


class TaskChain(NamedTuple):
    """What the filter knows of the task; a slot is one gesteme in one state."""

    initial: Array
    """P(first state), shape (S,)."""
    transition: Array
    """P(next state | state, segment over), shape (S, S); a row that sums to less than one ends
    the task there, and what follows is unknown motion."""
    slot_state: Integers
    """The state of each slot, shape (K,)."""
    slot_gesteme: Integers
    """The gesteme of each slot, shape (K,)."""
    slot_share: Array
    """P(gesteme | state) of each slot, shape (K,)."""


def chain_of(task: Task, *, anywhere: bool = False) -> TaskChain:
    """Return the task's states as the filter wants them; gestemes of a state are equally likely.

    With `anywhere` every state may be the first.
    """
    states = [state.name for state in task.states]
    gestemes = [gesteme.name for gesteme in task.gestemes]
    slots = [
        (q, gestemes.index(name), 1.0 / len(state.gestemes))
        for q, state in enumerate(task.states)
        for name in state.gestemes
    ]
    uniform = np.full(len(states), 1.0 / len(states))
    return TaskChain(
        initial=uniform if anywhere else np.array([task.start.get(name, 0.0) for name in states]),
        transition=np.array(
            [[state.next.get(name, 0.0) for name in states] for state in task.states]
        ),
        slot_state=np.array([slot[0] for slot in slots], dtype=np.int32),
        slot_gesteme=np.array([slot[1] for slot in slots], dtype=np.int32),
        slot_share=np.array([slot[2] for slot in slots]),
    )
