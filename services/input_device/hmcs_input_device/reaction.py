"""The operator of a recording: sees the robot stand, lets go of the dead-man, and presses again.

After a stop fixture and robot move again only once they have seen the dead-man released and then
pressed. A hand that is there does that by itself; a recording needs somebody who does it.
"""

from __future__ import annotations

import numpy as np

from hmcs_input_device.playback import Playback
from hmcs_input_device.sources import DeviceSample

RELEASED_S = 0.5
"""How long the dead-man is let go; longer than fixture and robot ignore samples after a stall."""
HEARD_WITHIN_S = 0.5
"""A robot that has sent nothing for longer is not there."""
HANG_S = 0.1
"""A longer time between two samples is a hang of this process; the others stop on it."""


class Reaction:
    """When the operator lets go of the dead-man; all times in s of one clock, passed in.

    That is when the robot has stood for longer than `reaction_s` with the dead-man pressed; it is
    pressed again after RELEASED_S, and so on for as long as the robot stands. A robot that is not
    there, or has not followed yet in this pass of the recording, is not waited for.
    """

    def __init__(self, reaction_s: float) -> None:
        self.count = 0
        """How often the dead-man was pressed again."""
        self._reaction_s = reaction_s
        self._robot_follows = False
        self._robot_told_s: float | None = None
        self._fixture_engaged = True
        self.forget()

    def forget(self) -> None:
        """Begin anew, with a clock that begins anew."""
        self._robot_told_s = None
        self._followed = False
        self._stands_since_s: float | None = None
        self._let_go_s: float | None = None

    @property
    def released(self) -> bool:
        """Whether the dead-man is let go."""
        return self._let_go_s is not None

    def robot_told(self, now_s: float, *, follows: bool) -> None:
        """Take in whether the robot follows commands."""
        self._robot_told_s, self._robot_follows = now_s, follows

    def fixture_told(self, *, engaged: bool) -> None:
        """Note whether the fixture lets the operator drive; it does until this is called."""
        self._fixture_engaged = engaged

    def lets_go(self, now_s: float, *, pressing: bool) -> bool:
        """Return whether the dead-man is let go at `now_s`, where the recording is `pressing`."""
        if self._let_go_s is not None:
            if now_s - self._let_go_s < RELEASED_S:
                return True
            self._let_go_s = self._stands_since_s = None
            self.count += 1
            return False
        if not pressing:
            self._followed, self._stands_since_s = False, None
        elif self._robot_told_s is None or now_s - self._robot_told_s > HEARD_WITHIN_S:
            self._stands_since_s = None
        elif self._robot_follows and self._fixture_engaged:
            self._followed, self._stands_since_s = True, None
        elif self._followed:
            if self._stands_since_s is None:
                self._stands_since_s = now_s
            elif now_s - self._stands_since_s > self._reaction_s:
                self._let_go_s = now_s
        return self.released


class ReEngaging:
    """A playback that waits while its operator has let go, or this process hung.

    The `Source` goes on with the very sample it stopped at, so that no motion is lost and the hand
    does not jump.
    """

    plays = True

    def __init__(self, playback: Playback, reaction: Reaction) -> None:
        self.reaction = reaction
        self._playback = playback
        self._seen_s: float | None = None
        self._waited_s = 0.0

    @property
    def rate_hz(self) -> float:
        """Samples a second."""
        return self._playback.rate_hz

    @property
    def duration_s(self) -> float:
        """How long all passes take, with the waiting so far."""
        return self._playback.duration_s + self._waited_s

    @property
    def reach_m(self) -> float:
        """How far the motion goes from where it begins."""
        return self._playback.reach_m

    def sample(self, elapsed_s: float | None) -> DeviceSample:
        """Return the device `elapsed_s` after the request to play, the waiting included."""
        if elapsed_s is None:
            return self._playback.sample(None)
        if self._seen_s is None or elapsed_s < self._seen_s:
            self._seen_s, self._waited_s = elapsed_s, 0.0
            self.reaction.forget()
        since_s, self._seen_s = elapsed_s - self._seen_s, elapsed_s
        was_released = self.reaction.released
        sample = self._at(elapsed_s)
        released = self.reaction.lets_go(elapsed_s, pressing=sample.dead_man)
        if released or was_released or since_s > HANG_S:
            self._waited_s += since_s
            sample = self._at(elapsed_s)
        return sample._replace(velocity=np.zeros(3), dead_man=False) if released else sample

    def close(self) -> None:
        """Nothing is held."""

    def _at(self, elapsed_s: float) -> DeviceSample:
        # Sums of differences must not slip off the grid the recording is played on.
        return self._playback.sample(round(elapsed_s - self._waited_s, 9))
