"""The last steps, for those who missed them."""

from __future__ import annotations

import numpy as np

from hmcs.bus.messages import LastSteps, LastStepsQuestion, Origin, Step

_ROW = np.dtype(
    [
        ("index", np.int64),
        ("position", np.float64, 3),
        ("displacement", np.float64, 3),
        ("orientation", np.float64, 4),
        ("wrench", np.float64, 6),
        ("mark", np.bool_),
        ("seq", np.int64),
        ("captured_ns", np.int64),
    ]
)
"""A step and the sample that completed it; NaN for what the device does not have."""


class KeptSteps:
    """The newest steps with the sample that completed each, in memory that is taken at once."""

    def __init__(self, most: int) -> None:
        self._rows = np.empty(most, _ROW)
        # The system hands out memory when it is first written to.
        self._rows.fill(0)
        self._number = 0

    def keep(self, step: Step, origin: Origin) -> None:
        """Add the next step; `origin` is a sample of this device."""
        self._rows[self._number % len(self._rows)] = (
            step.index,
            step.position,
            step.displacement,
            np.nan if step.orientation is None else step.orientation,
            np.nan if step.wrench is None else step.wrench,
            step.mark,
            origin.seq,
            origin.captured_ns,
        )
        self._number += 1

    def asked(self, question: LastStepsQuestion, clock: str) -> LastSteps:
        """Return the steps a question is for; `clock` is the boot they count in."""
        oldest = max(self._number - len(self._rows), 0)
        end = self._number
        if question.before is not None and end:
            first = int(self._rows[oldest % len(self._rows)]["index"])
            end = min(max(oldest + question.before - first, oldest), end)
        chosen = range(max(end - question.count, oldest), end)
        rows = [self._rows[number % len(self._rows)] for number in chosen]
        return LastSteps(
            clock=clock,
            steps=tuple(_step(row) for row in rows),
            origins=tuple(
                Origin(boot=clock, seq=int(row["seq"]), captured_ns=int(row["captured_ns"]))
                for row in rows
            ),
        )


def _step(row: np.void) -> Step:
    orientation, wrench = row["orientation"], row["wrench"]
    return Step(
        index=int(row["index"]),
        position=row["position"].copy(),
        displacement=row["displacement"].copy(),
        orientation=None if np.isnan(orientation[0]) else orientation.copy(),
        wrench=None if np.isnan(wrench[0]) else wrench.copy(),
        mark=bool(row["mark"]),
    )
