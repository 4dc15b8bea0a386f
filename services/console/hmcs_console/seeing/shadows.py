"""How often recognizers that only watch agree with the one that is followed."""

from __future__ import annotations

from collections import defaultdict, deque
from typing import NamedTuple


class Agreement(NamedTuple):
    """What a recognizer has in common with the one that is followed."""

    same: int
    """Steps both took the same state for the likely one."""
    compared: int
    """Steps both said something of."""


class Shadows:
    """Compares the newest steps of recognizers, whichever is followed."""

    def __init__(self, steps: int = 200) -> None:
        self._said: defaultdict[str, deque[tuple[str, int, str]]] = defaultdict(
            lambda: deque(maxlen=steps)
        )

    def heard(self, recognizer: str, clock: str, step: int, state: str) -> None:
        """Write down which state a recognizer holds likely after step `step` of a device."""
        self._said[recognizer].append((clock, step, state))

    def forget(self, recognizer: str) -> None:
        """Leave out what was said so far under a name."""
        self._said.pop(recognizer, None)

    @property
    def recognizers(self) -> tuple[str, ...]:
        """Who was heard, by name."""
        return tuple(sorted(self._said))

    def agreement(self, active: str) -> dict[str, Agreement]:
        """Return how every other recognizer agrees with the active one over the newest steps."""
        if active not in self._said:
            return {}
        truth = {(clock, step): state for clock, step, state in self._said[active]}
        found = {}
        for name in self.recognizers:
            if name != active:
                both = [
                    (state, truth[clock, step])
                    for clock, step, state in self._said[name]
                    if (clock, step) in truth
                ]
                found[name] = Agreement(sum(one == other for one, other in both), len(both))
        return found
