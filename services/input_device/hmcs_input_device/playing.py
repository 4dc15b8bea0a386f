"""When a source plays: from when on, how far it is, and the stop that only a person ends.

Pure: times are passed in, s of one monotonic clock. A robot that was asked to stand stands until
somebody decides otherwise. The operator of a recording decides nothing: it lets go and waits, with
the time of the recording standing still, until a person asks it to play. A hand that is there is
not held: it takes hold again when it wants to.
"""

from __future__ import annotations

from typing import NamedTuple

from hmcs_input_device.reaction import HEARD_WITHIN_S, RELEASED_S

GIVES_WAY_S = 2.0
"""A robot that still says so long after a person ended the stop was asked to stop anew."""
ROBOTS = 64
"""Of so many robots it is remembered that they were asked to stop."""


class _Asked(NamedTuple):
    """A robot that says that it was asked to stop."""

    instance: str
    heard_s: float


class Playing:
    """The time of a source, which begins when it is to play and stands still while it waits."""

    def __init__(self, rate_hz: float, *, minds_stops: bool) -> None:
        """Tell the time on the grid of `rate_hz`: a recording then gives the same samples every
        time. `minds_stops` is whether a stop that was asked for makes it wait.
        """
        self._rate_hz = rate_hz
        self._minds_stops = minds_stops
        self._began_s: float | None = None
        self._waits_since_s: float | None = None
        self._wanted_s = self._from_s = -float("inf")
        self._asked: dict[str, _Asked] = {}
        self.stopped = ""
        """The robot that was asked to stop, so that the source waits; empty while it does not."""

    @property
    def begun(self) -> bool:
        """Whether play was requested."""
        return self._began_s is not None

    @property
    def rests(self) -> bool:
        """Whether the hand has let go, for a stop that was asked for."""
        return bool(self.stopped) or self._waits_since_s is not None

    def begin(self, now_s: float) -> None:
        """Play from the beginning, once no robot says any more that it was asked to stop."""
        self._began_s = self._waits_since_s = now_s
        self.stopped, self._wanted_s, self._from_s = "", now_s, now_s

    def go_on(self, now_s: float) -> None:
        """Play on from where it waits, once everybody has seen that the hand had let go."""
        assert self._waits_since_s is not None
        self.stopped, self._wanted_s = "", now_s
        self._from_s = self._waits_since_s + RELEASED_S

    def elapsed_s(self, now_s: float) -> float | None:
        """Return how far it is; None before it plays."""
        if self._began_s is None:
            return None
        at_s = now_s if self._waits_since_s is None else self._waits_since_s
        return round((at_s - self._began_s) * self._rate_hz) / self._rate_hz

    def on_timeout(self, now_s: float) -> None:
        """Take in the time: it goes on where nothing is in the way any more."""
        if self._began_s is None or self._waits_since_s is None or self.stopped:
            return
        for robot in self._asked.values():
            if now_s - robot.heard_s <= HEARD_WITHIN_S:
                if now_s - self._wanted_s > GIVES_WAY_S:
                    self.stopped = robot.instance
                return
        if now_s >= self._from_s:
            self._began_s += now_s - self._waits_since_s
            self._waits_since_s = None

    def robot_told(self, now_s: float, boot: str, instance: str, *, asked: bool) -> None:
        """Take in whether a robot stands because it was asked to stop."""
        known = self._asked.pop(boot, None)
        if not asked or not self._minds_stops:
            return
        self._asked[boot] = _Asked(instance, now_s)
        while len(self._asked) > ROBOTS:
            del self._asked[next(iter(self._asked))]
        if known is None and not self.stopped:
            self.stopped = instance
            if self._began_s is not None and self._waits_since_s is None:
                self._waits_since_s = max(now_s, self._began_s)
