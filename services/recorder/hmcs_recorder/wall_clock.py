"""Times of arrivals as ns since 1970, by a clock that may be set at any moment."""

from __future__ import annotations

from collections.abc import Callable

SET_NS = 1_000_000_000
"""A clock that goes another way by this much was set, or the machine slept; one that is kept right
by the network is slowed or hurried by less than half as much in a quarter of an hour."""
STEADY_NS = 10_000_000
"""Two clocks are compared only where so little passed between looks at them."""


class WallClock:
    """The clock on the wall, reckoned from the one that nobody sets.

    Times of one reckoning rise as they were; it stays until somebody begins another.
    """

    def __init__(self, wall_ns: Callable[[], int], monotonic_ns: Callable[[], int]) -> None:
        """Take the clocks, both in ns, and reckon from how they stand now."""
        self._wall_ns, self._monotonic_ns = wall_ns, monotonic_ns
        self._offset_ns = wall_ns() - monotonic_ns()
        self._compared_ns = self._offset_ns

    def of(self, monotonic_ns: int) -> int:
        """Return a time of the clock that nobody sets as ns since 1970."""
        return monotonic_ns + self._offset_ns

    def now_ns(self) -> int:
        """Return the time now as it is reckoned."""
        return self.of(self._monotonic_ns())

    def set_by_ns(self) -> int:
        """Return by how much the clock on the wall was set, or slept for, since it was asked last.

        0 where it was not, and where the machine is too busy to tell.
        """
        before_ns = self._monotonic_ns()
        offset_ns = self._wall_ns() - before_ns
        if self._monotonic_ns() - before_ns > STEADY_NS:
            return 0
        by_ns, self._compared_ns = offset_ns - self._compared_ns, offset_ns
        return by_ns if abs(by_ns) >= SET_NS else 0

    def reckon_anew(self) -> None:
        """Reckon from how the clocks stand now."""
        self._offset_ns = self._compared_ns = self._wall_ns() - self._monotonic_ns()
