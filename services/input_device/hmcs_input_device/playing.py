"""When a source plays: from when on, how far it is, and the stop that only a person ends.

Pure: times are passed in, s of one monotonic clock. A robot that was asked to stand stands until
somebody decides otherwise. The operator of a recording decides nothing: it lets go and waits, with
the time of the recording standing still, until a person asks it to play. A hand that is there is
not held: it takes hold again when it wants to.
"""

from __future__ import annotations

from hmcs_input_device.reaction import RELEASED_S

TAKES_S = 2.0
"""So long after the hand took hold again, a robot may still tell of the stop that is over."""
ROBOTS = 64
"""Of so many robots it is remembered that they were asked to stop."""


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
        self._on_from_s = -float("inf")
        self._held_s: float | None = None
        self._over: dict[str, bool] = {}
        self.stopped = ""
        """The robot that was asked to stop, so that the source waits; empty while it does not."""

    @property
    def begun(self) -> bool:
        """Whether it was told to play."""
        return self._began_s is not None

    def begin(self, now_s: float) -> None:
        """Play from the beginning."""
        self._began_s = now_s
        self._on_from(now_s)

    def go_on(self, now_s: float) -> None:
        """Play on from where it waits, once everybody has seen that the hand had let go."""
        assert self._began_s is not None
        assert self._waits_since_s is not None
        on_from_s = now_s + RELEASED_S
        self._began_s += on_from_s - self._waits_since_s
        self._on_from(on_from_s)

    def rests(self, now_s: float) -> bool:
        """Whether the hand has let go for a stop that was asked for."""
        return bool(self.stopped) or now_s < self._on_from_s

    def elapsed_s(self, now_s: float) -> float | None:
        """Return how far it is; None before it plays."""
        if self._began_s is None:
            return None
        at_s = max(now_s, self._on_from_s) if self._waits_since_s is None else self._waits_since_s
        return round((at_s - self._began_s) * self._rate_hz) / self._rate_hz

    def held(self, now_s: float) -> None:
        """Take in that the hand holds the dead-man's switch."""
        if self._held_s is None:
            self._held_s = now_s

    def robot_told(self, now_s: float, boot: str, instance: str, *, asked: bool) -> None:
        """Take in whether a robot stands because it was asked to stop."""
        if not self._minds_stops:
            return
        if not asked:
            self._over.pop(boot, None)
            return
        begins_to_move = self._held_s is None or now_s - self._held_s <= TAKES_S
        over = self._over.pop(boot, False) and begins_to_move
        self._over[boot] = over
        while len(self._over) > ROBOTS:
            del self._over[next(iter(self._over))]
        if not over and not self.stopped:
            self.stopped = instance
            if self._began_s is not None:
                self._waits_since_s = max(now_s, self._on_from_s)

    def _on_from(self, at_s: float) -> None:
        self.stopped, self._waits_since_s, self._held_s = "", None, None
        self._on_from_s = at_s
        self._over = dict.fromkeys(self._over, True)
