"""Steps and what was believed after each, kept small, since an hour has many."""

from __future__ import annotations

from collections.abc import Sequence
from sys import intern
from typing import NamedTuple, overload

import numpy as np

from hmcs.bus.messages import Belief


class StepBeliefs(NamedTuple):
    """One step, and what is and was believed after it."""

    log_ns: int
    clock: str
    step: int
    sample: int | None
    """Number of the operator's sample that completed the step; None where it is unknown."""
    replayed: Belief
    recorded: Belief | None
    """Of the recognizer compared with; None where it said nothing of this step."""
    label: str | None
    """The state it truly was, where the recording has labels."""


class Packed(NamedTuple):
    """A belief in a tenth of the room."""

    model_hash: str
    clock: str
    step: int
    states: tuple[str, ...]
    probabilities: bytes
    unknown: float
    likely_gesteme: str
    segment_start: int
    log_likelihood: float
    mean_log_likelihood: float
    unknown_alarm: bool
    missing_gestemes: tuple[str, ...]

    def belief(self) -> Belief:
        """Return the belief; it was checked when it was read."""
        fields = self._asdict()
        return Belief.model_construct(
            **{**fields, "probabilities": np.frombuffer(self.probabilities, "<f8")}
        )


class Packer:
    """Packs the beliefs of one recording; what they have in common is held once."""

    def __init__(self) -> None:
        self._tuples: dict[tuple[str, ...], tuple[str, ...]] = {}

    def pack(self, belief: Belief) -> Packed:
        """Return a belief packed."""
        return Packed(
            intern(belief.model_hash),
            intern(belief.clock),
            belief.step,
            self._once(belief.states),
            belief.probabilities.tobytes(),
            belief.unknown,
            intern(belief.likely_gesteme),
            belief.segment_start,
            belief.log_likelihood,
            belief.mean_log_likelihood,
            belief.unknown_alarm,
            self._once(belief.missing_gestemes),
        )

    def _once(self, names: tuple[str, ...]) -> tuple[str, ...]:
        return self._tuples.setdefault(names, names)


class Beliefs(Sequence[StepBeliefs]):
    """The steps of a replay in their order, with what is and was believed."""

    def __init__(self) -> None:
        self._rows: list[tuple[int, str, int, int | None, Packed, Packed | None, str | None]] = []

    def add(
        self,
        log_ns: int,
        clock: str,
        step: int,
        sample: int | None,
        replayed: Packed,
        recorded: Packed | None,
        label: str | None,
    ) -> None:
        """Add a step; the arguments are as in `StepBeliefs`."""
        self._rows.append((log_ns, intern(clock), step, sample, replayed, recorded, label))

    def __len__(self) -> int:
        return len(self._rows)

    @overload
    def __getitem__(self, index: int) -> StepBeliefs: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[StepBeliefs, ...]: ...
    def __getitem__(self, index: int | slice) -> StepBeliefs | tuple[StepBeliefs, ...]:
        """Return steps as they were added."""
        if isinstance(index, slice):
            return tuple(self[number] for number in range(*index.indices(len(self))))
        log_ns, clock, step, sample, replayed, recorded, label = self._rows[index]
        then = None if recorded is None else recorded.belief()
        return StepBeliefs(log_ns, clock, step, sample, replayed.belief(), then, label)
