"""The task level: an exact filter over (task state, segment start) with one unknown state.

The layered HMM of thesis chapter 4 asks when one gesteme ends and the next begins (4.2, 4.3, 5).
Here that question is part of the state: a hypothesis is a task state, the gesteme it is performed
with, and the step its segment started at. Summing over all hypotheses is exact inference in the
layered model with soft evidence upward, and no restart has to be assumed.

Each step: exit, new starts, condition on the evidence, normalize, drop what is negligible. The
cost of a step grows with h, which dropping keeps near the number of starts that are plausible (tens
for a task of five states): some 210 µs a step on one core with five gestemes, the gestemes' own
share, which grows with the pairs of gesteme and start, included (`hmcs study restart`).
Shapes: S states, K slots (a slot is one gesteme in one state), h living hypotheses.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.recognition.recognizer import StepEvidence, TaskBelief
from hmcs.recognition.task_chain import TaskChain

Integers = NDArray[np.int32]

_LEAST_UNKNOWN = float(np.finfo(np.float64).tiny)
"""Mass of unknown motion that evidence against it leaves."""


class FilterSettings(NamedTuple):
    """The probabilities of what the task does not foresee."""

    any_state: float = 0.05
    """That a segment is followed by any state at all instead of one the task names."""
    again: float = 0.5
    """That a segment which ends the task is followed by any state instead of unknown motion."""
    unknown_after: float = 1e-3
    """That a segment is followed by unknown motion."""
    abandon: float = 1e-4
    """That a segment is left for unknown motion at any one step."""
    recover: float = 0.05
    """That unknown motion ends at any one step, in a new segment of any state."""
    drop_below: float = 1e-6
    """A hypothesis less probable than this is dropped."""


class Moves(NamedTuple):
    """What comes after a segment, and after unknown motion."""

    first: Array
    """P(state of the first step), shape (S,)."""
    first_unknown: float
    """P(the first step is unknown motion)."""
    follows: Array
    """P(state j begins next | a segment of state i is over), shape (S, S)."""
    to_unknown: Array
    """P(unknown motion next | a segment of state i is over), shape (S,)."""
    from_unknown: Array
    """P(state j begins at the next step | unknown motion), shape (S,)."""
    unknown_stays: float
    """P(unknown motion at the next step | unknown motion)."""


def moves_of(chain: TaskChain, settings: FilterSettings) -> Moves:
    """Return what comes after what, by the task's chain and what it does not foresee."""
    count = len(chain.initial)
    expected = 1.0 - settings.any_state - settings.unknown_after
    ended = expected * np.maximum(1.0 - chain.transition.sum(axis=1), 0.0)
    anywhere = settings.any_state + settings.again * ended
    return Moves(
        first=chain.initial * (1.0 - settings.unknown_after),
        first_unknown=settings.unknown_after,
        follows=expected * chain.transition + anywhere[:, None] / count,
        to_unknown=settings.unknown_after + (1.0 - settings.again) * ended,
        from_unknown=np.full(count, settings.recover / count),
        unknown_stays=1.0 - settings.recover,
    )


class SegmentFilter:
    """Moves the belief over (state, segment start) from step to step.

    A forward recursion whose states come and go with the evidence: none over a fixed set serves.
    """

    def __init__(self, chain: TaskChain, settings: FilterSettings) -> None:
        self._chain = chain
        self._settings = settings
        self._moves = moves_of(chain, settings)
        self._gestemes = tuple(int(g) for g in np.unique(chain.slot_gesteme))
        self.reset()

    @property
    def gestemes(self) -> tuple[int, ...]:
        """Indices of the gestemes the task needs evidence for."""
        return self._gestemes

    def reset(self) -> None:
        """Forget everything: the next step applies the prior."""
        self._slot = np.zeros(0, dtype=np.int32)
        self._start = np.zeros(0, dtype=np.int32)
        self._mass = np.zeros(0)
        self._unknown = 0.0
        self._begun = False

    def step(self, evidence: StepEvidence) -> TaskBelief:
        """Move the belief by the evidence for the next step.

        A pair that is absent is impossible; a gesteme that is absent altogether has ratio 0 and
        exit 0 and is named in `missing`.
        """
        missing = missing_gestemes(evidence, self._gestemes)
        table = EvidenceTable(evidence, missing, self._chain.slot_gesteme)
        stayed, new_slots, unknown = self._move(table)

        slots = len(self._chain.slot_state)
        slot = np.concatenate([self._slot, np.arange(slots, dtype=np.int32)])
        start = np.concatenate([self._start, np.full(slots, evidence.step, dtype=np.int32)])
        mass = np.concatenate([stayed, new_slots])

        log_ratio = table.log_ratio(slot, start)
        # Nothing impossible sets the scale, and the unknown never vanishes: evidence of thousands
        # of nats would leave no mass to divide by.
        top = max(0.0, float(log_ratio.max(initial=-np.inf, where=mass > 0.0)))
        mass = mass * np.exp(np.minimum(log_ratio - top, 0.0))
        unknown = max(unknown * float(np.exp(-top)), _LEAST_UNKNOWN)
        total = float(mass.sum()) + unknown
        log_likelihood = top + float(np.log(total))

        living = mass > self._settings.drop_below * total
        self._slot, self._start, mass = slot[living], start[living], mass[living]
        total = float(mass.sum()) + unknown
        self._mass, self._unknown, self._begun = mass / total, unknown / total, True
        return self._belief(evidence.step, log_likelihood, missing)

    def _move(self, table: EvidenceTable) -> tuple[Array, Array, float]:
        """Exit and new starts: (mass that stays (h,), mass of new starts (K,), unknown mass)."""
        chain, moves, abandon = self._chain, self._moves, self._settings.abandon
        if not self._begun:
            return self._mass, self._spread(moves.first), moves.first_unknown
        exit_probability = table.exit(self._slot, self._start)
        leaving = np.bincount(
            chain.slot_state[self._slot],
            weights=self._mass * exit_probability,
            minlength=len(chain.initial),
        )
        stays = self._mass * (1.0 - exit_probability)
        states = leaving @ moves.follows + self._unknown * moves.from_unknown
        unknown = (
            self._unknown * moves.unknown_stays
            + float(leaving @ moves.to_unknown)
            + abandon * float(stays.sum())
        )
        return stays * (1.0 - abandon), self._spread(states), unknown

    def _spread(self, states: Array) -> Array:
        return np.asarray(states[self._chain.slot_state] * self._chain.slot_share)

    def _belief(self, step: int, log_likelihood: float, missing: tuple[int, ...]) -> TaskBelief:
        state_of = self._chain.slot_state[self._slot]
        states = np.zeros(len(self._chain.initial))
        np.add.at(states, state_of, self._mass)
        gesteme, segment_start = int(self._chain.slot_gesteme[0]), step
        mine = np.flatnonzero(state_of == states.argmax())
        if len(mine):
            best = mine[self._mass[mine].argmax()]
            gesteme = int(self._chain.slot_gesteme[self._slot[best]])
            segment_start = int(self._start[best])
        return TaskBelief(
            step, states, self._unknown, gesteme, segment_start, log_likelihood, missing
        )


def missing_gestemes(evidence: StepEvidence, wanted: Sequence[int]) -> tuple[int, ...]:
    """Return those of the gestemes `wanted` that a step has no evidence for."""
    held = set(evidence.gestemes)
    return tuple(g for g in wanted if g not in held)


class EvidenceTable:
    """One step's pairs, looked up by (slot, start)."""

    def __init__(
        self, evidence: StepEvidence, missing: tuple[int, ...], slot_gesteme: Integers
    ) -> None:
        self._slot_gesteme = slot_gesteme
        self._oldest = int(evidence.pair_start.min(initial=evidence.step))
        shape = (
            int(max(slot_gesteme.max(), evidence.pair_gesteme.max(initial=0))) + 1,
            evidence.step - self._oldest + 2,
        )
        self._exit = np.zeros(shape)
        self._log_ratio = np.full(shape, -np.inf)
        where = (evidence.pair_gesteme, evidence.pair_start - self._oldest + 1)
        self._exit[where] = evidence.exit
        self._log_ratio[where] = evidence.log_ratio
        self._log_ratio[list(missing), :] = 0.0

    def exit(self, slot: Integers, start: Integers) -> Array:
        """Return P(leaving before the step) of each (slot, start), shape (h,)."""
        return np.asarray(self._exit[self._where(slot, start)])

    def log_ratio(self, slot: Integers, start: Integers) -> Array:
        """Return the log-likelihood ratio of the step for each (slot, start), −inf where it is
        impossible, shape (h,)."""
        return np.asarray(self._log_ratio[self._where(slot, start)])

    def _where(self, slot: Integers, start: Integers) -> tuple[Integers, Integers]:
        """Column 0 stands for every start older than the oldest pair."""
        return self._slot_gesteme[slot], np.maximum(start - self._oldest + 1, 0)
