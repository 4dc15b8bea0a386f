"""The last steps, for those who missed them."""

from __future__ import annotations

from collections import deque
from itertools import islice

from hmcs.bus.messages import LastSteps, LastStepsQuestion, Origin, Step


class KeptSteps:
    """The newest steps with the sample that completed each."""

    def __init__(self, most: int) -> None:
        self._kept: deque[tuple[Step, Origin]] = deque(maxlen=most)

    def keep(self, step: Step, origin: Origin) -> None:
        """Add the next step."""
        self._kept.append((step, origin))

    def asked(self, question: LastStepsQuestion, clock: str) -> LastSteps:
        """Return the steps a question is for; `clock` is the boot they count in."""
        oldest = self._kept[0][0].index if self._kept else 0
        end = len(self._kept)
        if question.before is not None:
            end = min(max(question.before - oldest, 0), end)
        chosen = list(islice(self._kept, max(end - question.count, 0), end))
        return LastSteps(
            clock=clock,
            steps=tuple(step for step, _ in chosen),
            origins=tuple(origin for _, origin in chosen),
        )
