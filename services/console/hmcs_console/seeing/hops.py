"""How long a hop takes: what one cause makes of itself, by the clock of this one observer.

Messages of one origin are distinguished by nothing else, and their times are those of their arrival
here. So no clocks are compared across hosts; what differs between the ways to this observer counts
in, for better or worse.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, takewhile
from statistics import median

from hmcs.bus.messages import Origin

FAST = ("input", "fixture", "robot")
"""Stages of the fast loop: Motion, FixtureState, RobotState."""
SLOW = ("step", "belief")
"""Stages of the slow loop: Step, Belief."""
SPAN_NS = 1_000_000_000
"""Hops that were made so long ago or less count."""
_NS_PER_MS = 1e6

Cause = tuple[str, int]


def cause_of(origin: Origin) -> Cause:
    """Return what messages of one cause have in common: boot and number of its sample."""
    return origin.boot, origin.seq


def hop_names(stages: Sequence[str]) -> tuple[str, ...]:
    """Return what the hops between stages are called, e.g. `input → fixture`."""
    return tuple(f"{one} → {other}" for one, other in pairwise(stages))


class Arrivals:
    """When the messages of each cause came, stage by stage, in whatever order they came."""

    def __init__(self, stages: Sequence[str], causes: int = 512) -> None:
        """Keep the newest `causes`."""
        self._names = hop_names(stages)
        self._empty = [0] * len(stages)
        self._causes = causes
        self._came: dict[Cause, list[int]] = {}

    def came(self, stage: int, cause: Cause, at_ns: int) -> None:
        """Write down that a message of a stage came; of several the first counts."""
        times = self._came.get(cause)
        if times is None:
            if len(self._came) >= self._causes:
                del self._came[next(iter(self._came))]
            times = self._came[cause] = self._empty.copy()
        if not times[stage]:
            times[stage] = at_ns

    def medians_ms(self, now_ns: int) -> dict[str, float]:
        """Return the median of each hop over the last second, ms; without hops nothing."""
        # A stage that no message was of has 0.
        since_ns = max(now_ns - SPAN_NS, 1)
        # The newest causes stand last; one that nothing came of any more ends what is new.
        new = list(takewhile(lambda times: max(times) >= since_ns, reversed(self._came.values())))
        found = {}
        for stage, name in enumerate(self._names):
            took = [
                times[stage + 1] - times[stage]
                for times in new
                if times[stage] and times[stage + 1] >= since_ns
            ]
            if took:
                found[name] = median(took) / _NS_PER_MS
        return found
