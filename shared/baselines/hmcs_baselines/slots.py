"""One hidden state for each gesteme of each task state, with dwell times as demonstrated (2.33).

Where every task state has one gesteme, as in Hannaford & Lee (1990), hidden states are task states.
Shapes: S task states, M gestemes, K slots (a slot is one gesteme in one state), T steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.recognition.belief_builder import BeliefBuilder
from hmcs.recognition.checking import check_distributions, check_shapes
from hmcs.recognition.hmm.inference import shortest_path, smooth
from hmcs.recognition.recognizer import Recognition
from hmcs.recognition.segmentation import (
    StateSegment,
    edges_where,
    segments_between,
    summed_by,
)
from hmcs.recognition.segments import Segment
from hmcs.recognition.task_chain import TaskChain
from hmcs_baselines.hmm.bank import ForwardBank
from hmcs_baselines.hmm.durations import dwell_transition, mean_dwells_s

Integers = NDArray[np.int64]


class SlotChain(NamedTuple):
    """The Markov chain of slots, in the order of `TaskChain`."""

    initial: Array
    """P(slot at the first step), shape (K,)."""
    transition: Array
    """P(slot j at the next step | slot i), shape (K, K)."""


def learn_slot_chain(chain: TaskChain, segments: Sequence[Segment], any_state: float) -> SlotChain:
    """Return the chain whose stays are as long as the segments are on average (2.33).

    What follows a slot shares the probability of leaving it as the task says; a state that nothing
    follows is never left. With the probability `any_state` a step goes to any state whatever. A
    slot without a segment stays as long as slots do on average.
    """
    slots = slots_of(chain, segments)
    seen, index = np.unique(slots, return_inverse=True)
    stays = [np.full(len(each.steps), k) for each, k in zip(segments, index, strict=True)]
    dwells = mean_dwells_s(stays, len(seen), 1.0)
    dwell = np.full(len(chain.slot_state), dwells.mean())
    dwell[seen] = dwells
    branches = chain.transition[np.ix_(chain.slot_state, chain.slot_state)] * chain.slot_share
    np.fill_diagonal(branches, 0.0)
    total = branches.sum(axis=1, keepdims=True)
    branches = np.divide(branches, total, out=np.zeros_like(branches), where=total > 0)
    anywhere = _anywhere(chain)
    return SlotChain(
        (1.0 - any_state) * chain.initial[chain.slot_state] * chain.slot_share
        + any_state * anywhere,
        (1.0 - any_state) * dwell_transition(dwell, 1.0, branches) + any_state * anywhere,
    )


def slots_of(chain: TaskChain, segments: Sequence[Segment]) -> Integers:
    """Return the slot that each segment was performed in."""
    index = slot_index(chain)
    return np.array([index[each.state, each.gesteme] for each in segments], dtype=np.int64)


def slot_index(chain: TaskChain) -> dict[tuple[int, int], int]:
    """Return the slot of each state with one of its gestemes."""
    pairs = zip(chain.slot_state.tolist(), chain.slot_gesteme.tolist(), strict=True)
    return {pair: slot for slot, pair in enumerate(pairs)}


def slot_rows(chain: TaskChain, segments: Sequence[Segment], rows: Sequence[Array]) -> list[Array]:
    """Return what was observed in each slot, K arrays of shape (n, …), given rows of each segment.

    A slot without a segment has what was observed in its gesteme.
    """
    slots = slots_of(chain, segments)
    gestemes = np.array([each.gesteme for each in segments])
    found = []
    for slot, gesteme in enumerate(chain.slot_gesteme):
        own = np.flatnonzero(slots == slot)
        own = own if len(own) else np.flatnonzero(gestemes == gesteme)
        found.append(np.concatenate([rows[k] for k in own.tolist()]))
    return found


class SlotFilter:
    """Moves the belief over slots by what each says of a step."""

    def __init__(self, chain: TaskChain, slots: SlotChain, *, anywhere: bool = False) -> None:
        """Begin as the task does or, with `anywhere`, in any state."""
        initial = _anywhere(chain) if anywhere else slots.initial
        self._bank = ForwardBank(initial[None], slots.transition[None])
        self._beliefs = BeliefBuilder()
        self._where = (chain.slot_state, chain.slot_gesteme)
        self._shape = (len(chain.initial), int(chain.slot_gesteme.max()) + 1)

    def step(self, index: int, log_emission: Array) -> Recognition:
        """Take log P(step | slot), shape (K,), up to a term that is the same for all slots."""
        log_likelihood = float(self._bank.step(log_emission[None])[0])
        joint = np.zeros(self._shape)
        joint[self._where] = self._bank.states[0]
        return self._beliefs.recognition(index, joint.sum(axis=1), joint, log_likelihood)


def most_probable_segments(
    chain: TaskChain, slots: SlotChain, log_emission: Array, first: int, *, anywhere: bool
) -> tuple[StateSegment, ...]:
    """Return the segments on the most probable path of slots (Viterbi), its first step `first`.

    Given log P(step | slot), shape (T, K). With `anywhere` the path may begin in any state.
    """
    initial = _anywhere(chain) if anywhere else slots.initial
    path = shortest_path(initial, slots.transition, log_emission).path
    posterior = smooth(initial, slots.transition, log_emission).states
    return segments_between(
        edges_where(path[1:] != path[:-1]),
        chain.slot_state[path].astype(np.int64),
        chain.slot_gesteme[path].astype(np.int64),
        summed_by(chain.slot_state.astype(np.int64), posterior, len(chain.initial)),
        first,
    )


def check_slot_chain(slots: SlotChain, count: int) -> None:
    """Raise ValueError where the arrays are no Markov chain of so many slots."""
    shapes = {"initial": (count,), "transition": (count, count)}
    check_shapes(slots._asdict(), shapes)
    for field, array in slots._asdict().items():
        check_distributions(field, array)


def _anywhere(chain: TaskChain) -> Array:
    return np.asarray(chain.slot_share / len(chain.initial))
