"""Whose samples count where several input devices are in a recording: the hand's that drives.

One hand drives at a time. It is the one that engaged first, until it lets go of the dead-man or is
silent for as long as lets another drive a robot; what others do meanwhile changes nothing. A robot
may not have followed it: which one it follows is decided more strictly, see `hmcs.driving`. What
the hand did is a demonstration all the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from hmcs.bus.messages import Motion
from hmcs.driving import TAKEOVER_S
from hmcs.recordings.reading import RecordingContent

_SILENT_AFTER_NS = round(TAKEOVER_S * 1e9)


class Sample(NamedTuple):
    """A sample of the device that drives, or that drove last."""

    log_ns: int
    device: str
    """Its boot."""
    motion: Motion
    captured_ns: int
    """When it was taken, by the recorder's clock."""

    @property
    def engaged(self) -> bool:
        """Whether it moves the robot: the dead-man is held, the clutch is not."""
        return self.motion.dead_man and not self.motion.clutch


def hand_of(content: RecordingContent) -> Iterator[Sample]:
    """Yield the samples of the hand that drives, or while none does of the one that did last.

    Raises RecordingError as `content.of` does.
    """
    drives = drove = ""
    heard_ns = 0
    for recorded, envelope, motion in content.of(Motion):
        device = envelope.source.boot
        if drives and device != drives:
            if recorded.log_ns - heard_ns <= _SILENT_AFTER_NS:
                continue
            drives = ""
        if motion.dead_man:
            drives, drove, heard_ns = device, device, recorded.log_ns
        elif device == drove:
            drives = ""
        else:
            continue
        yield Sample(recorded.log_ns, device, motion, recorded.captured_ns)
