"""Gathering: evidence of several classifiers, step by step, until all of it is there or time is up.

Pure: times are passed in, and all of them are times of arrival: evidence that had arrived in time
counts, however late a busy process comes to handle it. Steps are released in order, each once.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Literal

import numpy as np

from hmcs.recognition.recognizer import StepEvidence

Verdict = Literal["taken", "duplicate", "late"]


class Gathering:
    """Holds evidence until its step can be released."""

    def __init__(self, gestemes: Collection[int], deadline_ns: int) -> None:
        """Wait for evidence of all `gestemes` (indices into the model), at most `deadline_ns`."""
        self._needed = frozenset(gestemes)
        self._deadline_ns = deadline_ns
        self._parts: dict[int, list[StepEvidence]] = {}
        self._due_ns: dict[int, int] = {}
        self._early_until_ns: dict[int, int] = {}
        """Of steps released before their deadline, oldest first: until when evidence is in time."""
        self._next = 0
        self._handled_until_ns = -1
        """Whatever arrived before has been handled."""

    def restart(self, index: int) -> None:
        """Forget everything; step `index` is the next."""
        self._parts.clear()
        self._due_ns.clear()
        self._early_until_ns.clear()
        self._next = index

    def begin(self, index: int, now_ns: int) -> None:
        """Note that step `index` was made: its deadline runs from now."""
        self._due_ns[index] = now_ns + self._deadline_ns

    def add(self, evidence: StepEvidence, now_ns: int) -> Verdict:
        """Take what is new of a classifier's evidence: the first to arrive wins.

        Evidence may come before its step is noted. For a step that needed no more of it, it is a
        duplicate up to the step's deadline, as a second classifier sends at every step, and late
        after that.
        """
        self.caught_up(now_ns)
        step = evidence.step
        if step < self._next:
            return "duplicate" if now_ns <= self._early_until_ns.get(step, -1) else "late"
        parts = self._parts.setdefault(step, [])
        fresh = set(evidence.gestemes) - _covered(parts)
        if not fresh:
            return "duplicate"
        parts.append(_only(evidence, fresh))
        return "taken"

    def caught_up(self, now_ns: int) -> None:
        """Note that whatever arrived before `now_ns` has been handled."""
        self._handled_until_ns = max(self._handled_until_ns, now_ns)

    def release(self, now_ns: int) -> StepEvidence | None:
        """Return the next step at `now_ns` if its evidence is complete or its deadline has passed.

        The deadline has passed once everything has been handled that arrived before it; that the
        clock is past it means nothing while this process is behind with its messages.
        """
        step = self._next
        if step not in self._due_ns:
            return None
        complete = self._needed <= _covered(self._parts.get(step, []))
        due_ns = self._due_ns[step]
        if not complete and self._handled_until_ns < due_ns:
            return None
        self._next = step + 1
        self._due_ns.pop(step)
        if complete:
            self._note_early(step, due_ns, now_ns)
        return _joined(step, self._parts.pop(step, []))

    def _note_early(self, step: int, due_ns: int, now_ns: int) -> None:
        for past in [s for s, until_ns in self._early_until_ns.items() if until_ns < now_ns]:
            del self._early_until_ns[past]
        self._early_until_ns[step] = due_ns

    @property
    def due_ns(self) -> int | None:
        """When the next step is released whatever is missing; None while no step waits."""
        return self._due_ns.get(self._next)


def _covered(parts: list[StepEvidence]) -> set[int]:
    return {gesteme for part in parts for gesteme in part.gestemes}


def _only(evidence: StepEvidence, gestemes: set[int]) -> StepEvidence:
    if gestemes == set(evidence.gestemes):
        return evidence
    kept = np.isin(evidence.pair_gesteme, list(gestemes))
    return StepEvidence(
        evidence.step,
        tuple(sorted(gestemes)),
        evidence.pair_gesteme[kept],
        evidence.pair_start[kept],
        evidence.exit[kept],
        evidence.log_ratio[kept],
    )


def _joined(step: int, parts: list[StepEvidence]) -> StepEvidence:
    none = np.zeros(0, dtype=np.int32)
    return StepEvidence(
        step,
        tuple(sorted(g for part in parts for g in part.gestemes)),
        np.concatenate([none, *(part.pair_gesteme for part in parts)]),
        np.concatenate([none, *(part.pair_start for part in parts)]),
        np.concatenate([np.zeros(0), *(part.exit for part in parts)]),
        np.concatenate([np.zeros(0), *(part.log_ratio for part in parts)]),
    )
