"""Offline segmentation by the segment filter's own model: Viterbi and smoothing over segments.

A hypothesis is what it is in the filter: a slot and the step its segment started at, or unknown
motion. The most probable history of hypotheses is the segmentation; the forward–backward recursion
tells how probable each state is at each step, all steps given. Both are exact: unlike the filter
they drop no hypothesis that the evidence leaves possible. Shapes: S states, K slots, h hypotheses
of a step, n of the step before, T steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.recognition.hmm.log_transitions import log_of
from hmcs.recognition.recognizer import StepEvidence
from hmcs.recognition.segment_filter.filter import (
    EvidenceTable,
    FilterSettings,
    missing_gestemes,
    moves_of,
)
from hmcs.recognition.segmentation import StateSegment
from hmcs.recognition.task_chain import TaskChain

Integers = NDArray[np.int32]

_LEAST_LOG_UNKNOWN = float(np.log(np.finfo(np.float64).tiny))
"""As in the filter: evidence against unknown motion leaves so much of it beside the likeliest."""


class Posterior(NamedTuple):
    """How probable each state is, the whole motion given."""

    states: Array
    """Shape (T, S)."""
    unknown: Array
    """P(unknown motion), shape (T,)."""


class _Moment(NamedTuple):
    """The hypotheses of a step, and what became of those of the step before."""

    slot: Integers
    """Shape (h,)."""
    start: Integers
    """Shape (h,)."""
    stayed: Integers
    """Which of the hypotheses before are the first ones here, in this order."""
    log_ratio: Array
    """Of the step, shape (h,)."""
    log_mass: Array
    """Up to a term of the step, shape (h,)."""
    log_unknown: float
    log_stay: Array
    """log P(goes on) of the hypotheses before, shape (n,)."""
    log_exit: Array
    """log P(over) of the hypotheses before, shape (n,)."""
    log_lost: Array
    """log P(unknown motion comes next) of the hypotheses before, shape (n,)."""


class OfflineSegmenter:
    """Finds the segments of a whole motion from the evidence for all of its steps."""

    def __init__(
        self, chain: TaskChain, settings: FilterSettings, evidence: Sequence[StepEvidence]
    ) -> None:
        """Take the evidence for steps that follow each other, one at least."""
        self._evidence = evidence
        self._state_of = chain.slot_state
        self._slot_gesteme = chain.slot_gesteme
        self._gestemes = tuple(int(g) for g in np.unique(chain.slot_gesteme))
        self._abandon = settings.abandon
        self._moves = moves_of(chain, settings)
        self._log_share = log_of(chain.slot_share)
        self._log_follows = log_of(self._moves.follows)
        self._log_from_unknown = log_of(self._moves.from_unknown)
        self._log_unknown_stays = float(log_of(np.array(self._moves.unknown_stays)))

    def segments(self) -> tuple[StateSegment, ...]:
        """Return the most probable segmentation, with how probable each segment's state is."""
        posterior = self.posterior()
        first = self._evidence[0].step
        segments = []
        for slot, start, stop in self._most_probable():
            steps = slice(start - first, stop - first)
            if slot is None:
                probability = float(posterior.unknown[steps].mean())
                segments.append(StateSegment(None, None, start, stop, probability))
                continue
            state = int(self._state_of[slot])
            probability = float(posterior.states[steps, state].mean())
            gesteme = int(self._slot_gesteme[slot])
            segments.append(StateSegment(state, gesteme, start, stop, probability))
        return tuple(segments)

    def posterior(self) -> Posterior:
        """Return the probabilities of the states at each step by the forward–backward recursion."""
        moments = self._forward(np.logaddexp)
        count = len(self._log_follows)
        states, unknown = np.zeros((len(moments), count)), np.zeros(len(moments))
        log_later, log_later_unknown = np.zeros(len(moments[-1].slot)), 0.0
        for t in reversed(range(len(moments))):
            moment = moments[t]
            log_joint = np.append(
                moment.log_mass + log_later, moment.log_unknown + log_later_unknown
            )
            joint = np.exp(log_joint - log_joint.max())
            joint /= joint.sum()
            states[t] = np.bincount(self._state_of[moment.slot], joint[:-1], count)
            unknown[t] = joint[-1]
            if t:
                log_later, log_later_unknown = self._back(
                    moments[t - 1], moment, log_later, log_later_unknown
                )
        return Posterior(states, unknown)

    def _forward(self, combine: np.ufunc) -> list[_Moment]:
        """Pass through all steps; `combine` adds the ways to a hypothesis, or takes the best."""
        moments: list[_Moment] = []
        for evidence in self._evidence:
            missing = missing_gestemes(evidence, self._gestemes)
            table = EvidenceTable(evidence, missing, self._slot_gesteme)
            before = moments[-1] if moments else None
            moments.append(self._moment(before, table, evidence.step, combine))
        return moments

    def _moment(
        self, before: _Moment | None, table: EvidenceTable, step: int, combine: np.ufunc
    ) -> _Moment:
        slots = np.arange(len(self._state_of), dtype=np.int32)
        if before is None:
            none, no_hypothesis = np.zeros(0), np.zeros(0, dtype=np.int32)
            log_stay = log_exit = log_lost = log_stayed = none
            slot_before = start_before = no_hypothesis
            log_states = log_of(self._moves.first)
            log_unknown = float(log_of(np.array(self._moves.first_unknown)))
        else:
            slot_before, start_before = before.slot, before.start
            state_before = self._state_of[slot_before]
            left = table.exit(slot_before, start_before)
            log_exit = log_of(left)
            log_stay = log_of((1.0 - left) * (1.0 - self._abandon))
            log_lost = log_of(
                left * self._moves.to_unknown[state_before] + (1.0 - left) * self._abandon
            )
            log_leaving = np.full(len(self._log_follows), -np.inf)
            combine.at(log_leaving, state_before, before.log_mass + log_exit)
            log_states = combine(
                combine.reduce(log_leaving[:, None] + self._log_follows, axis=0),
                before.log_unknown + self._log_from_unknown,
            )
            log_unknown = float(
                combine.reduce(
                    np.append(
                        before.log_mass + log_lost, before.log_unknown + self._log_unknown_stays
                    )
                )
            )
            log_stayed = before.log_mass + log_stay
        log_new = log_states[self._state_of] + self._log_share
        slot = np.concatenate([slot_before, slots])
        start = np.concatenate([start_before, np.full(len(slots), step, dtype=np.int32)])
        log_ratio = table.log_ratio(slot, start)
        log_mass = np.concatenate([log_stayed, log_new]) + log_ratio
        possible = np.isfinite(log_mass)
        top = max(log_unknown, float(log_mass.max(initial=-np.inf)))
        return _Moment(
            slot[possible],
            start[possible],
            np.flatnonzero(possible[: len(slot_before)]).astype(np.int32),
            log_ratio[possible],
            log_mass[possible] - top,
            max(log_unknown - top, _LEAST_LOG_UNKNOWN),
            log_stay,
            log_exit,
            log_lost,
        )

    def _back(
        self, before: _Moment, moment: _Moment, log_later: Array, log_later_unknown: float
    ) -> tuple[Array, float]:
        """log P(this step and all later ones | hypothesis before it), up to a term."""
        log_here = moment.log_ratio + log_later
        stayed = len(moment.stayed)
        begun = moment.slot[stayed:]
        log_arriving = np.full(len(self._log_follows), -np.inf)
        np.logaddexp.at(
            log_arriving, self._state_of[begun], self._log_share[begun] + log_here[stayed:]
        )
        log_after_exit = np.logaddexp.reduce(self._log_follows + log_arriving, axis=1)
        result = np.logaddexp(
            moment.log_exit + log_after_exit[self._state_of[before.slot]],
            moment.log_lost + log_later_unknown,
        )
        kept = moment.stayed
        result[kept] = np.logaddexp(result[kept], moment.log_stay[kept] + log_here[:stayed])
        unknown = float(
            np.logaddexp.reduce(
                np.append(
                    self._log_from_unknown + log_arriving,
                    self._log_unknown_stays + log_later_unknown,
                )
            )
        )
        top = max(unknown, float(result.max(initial=-np.inf)))
        return result - top, unknown - top

    def _most_probable(self) -> list[tuple[int | None, int, int]]:
        """The segments (slot, start, stop) of the most probable history; None: unknown motion."""
        moments, first = self._forward(np.maximum), self._evidence[0].step
        last = moments[-1]
        at = int(np.append(last.log_unknown, last.log_mass).argmax()) - 1
        found: list[tuple[int | None, int, int]] = []
        stop = len(moments)
        while stop > 0:
            moment = moments[stop - 1]
            if at < 0:
                begin, at = self._begin_of_unknown(moments, stop)
                found.append((None, first + begin, first + stop))
            else:
                slot, begin = int(moment.slot[at]), int(moment.start[at]) - first
                found.append((slot, first + begin, first + stop))
                at = self._before_segment(moments, begin, int(self._state_of[slot]))
            stop = begin
        return found[::-1]

    def _begin_of_unknown(self, moments: Sequence[_Moment], stop: int) -> tuple[int, int]:
        """The first step of the unknown motion that ends at `stop`, and the hypothesis before."""
        for t in range(stop - 1, 0, -1):
            before = moments[t - 1]
            ways = np.append(
                before.log_unknown + self._log_unknown_stays, before.log_mass + moments[t].log_lost
            )
            at = int(ways.argmax()) - 1
            if at >= 0:
                return t, at
        return 0, -1

    def _before_segment(self, moments: Sequence[_Moment], begin: int, state: int) -> int:
        """The hypothesis before a segment of a state that starts at `begin`; −1: unknown motion."""
        if begin == 0:
            return -1
        before = moments[begin - 1]
        ways = before.log_mass + moments[begin].log_exit
        ways = ways + self._log_follows[self._state_of[before.slot], state]
        unknown = before.log_unknown + self._log_from_unknown[state]
        return int(np.append(unknown, ways).argmax()) - 1
