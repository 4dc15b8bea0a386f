"""What a process counts of its traffic, per schema, and how a loss is seen in sequence numbers."""

from __future__ import annotations

from collections import Counter, OrderedDict
from dataclasses import dataclass, field

REMEMBERED_BOOTS = 4096
"""Of so many sources and keys the numbers are followed; the one unheard for longest goes first."""
LARGEST_GAP = 1000
"""A source that jumps further ahead is confirmed by its next message before it counts: two seconds
of a 500 Hz stream may be lost while a router starts anew, and more than that is a new start."""
CONFIRMED_WITHIN = 8
"""The message that confirms a jump may itself follow a loss, of so few at most."""
STREAMS = 4
"""So many ways to go on are followed for one source: its own, and those of what claims its name."""


class Counters:
    """Messages received, sent, lost, refused and late; keys are schema names such as `motion`."""

    def __init__(self) -> None:
        self.received: Counter[str] = Counter()
        self.sent: Counter[str] = Counter()
        self.lost: Counter[str] = Counter()
        self.refused: Counter[str] = Counter()
        self.late: Counter[str] = Counter()
        self.handled = 0
        """Messages, questions and timers handled since the bus was opened."""

    def count_refused(self, schema: str, reason: str = "") -> None:
        """Count a message that cannot be used: malformed, or against a service's own rules."""
        self.refused[schema] += 1

    def count_late(self, schema: str) -> None:
        """Count a message that came too late to be used."""
        self.late[schema] += 1


class Sequences:
    """Follows the sequence numbers of every source, by key and boot."""

    def __init__(self) -> None:
        self._sources: OrderedDict[tuple[str, str], _Numbers] = OrderedDict()

    def note(self, key: str, boot: str, seq: int, overwritten: int = 0) -> int | None:
        """Return how many messages were lost before this one, or None if it is no news.

        `overwritten` messages arrived but gave way to newer ones in the mailbox; they are no loss.
        The first message of a boot starts its count; one numbered below an earlier one is a
        duplicate or was overtaken, neither of them a loss.

        A number may be a forgery, so that none is the end of a stream: after a jump the stream may
        also go on where it was, and a jump by more than `LARGEST_GAP`, either way, counts once the
        next message confirms it and none came that goes on as before.
        """
        numbers = self._sources.get((key, boot))
        if numbers is None:
            self._sources[key, boot] = _Numbers([_Stream(seq + 1)])
            if len(self._sources) > REMEMBERED_BOOTS:
                self._sources.popitem(last=False)
            return 0
        self._sources.move_to_end((key, boot))
        lost = numbers.note(seq)
        return None if lost is None else max(0, lost - overwritten)


@dataclass
class _Stream:
    """One way a source may go on."""

    expected: int
    length: int = 1
    """Messages that went on in it."""


@dataclass
class _Numbers:
    """The numbers of one source, the stream it went on in last first."""

    streams: list[_Stream]
    jumped_to: int | None = field(default=None)
    """What would confirm a jump."""

    def note(self, seq: int) -> int | None:
        for stream in self.streams:
            if seq == stream.expected:
                self._go_on(stream)
                return 0
        leading = self.streams[0].expected
        if 0 <= seq - leading <= LARGEST_GAP:
            self._begin(seq)
            return seq - leading
        if 0 < leading - seq <= LARGEST_GAP:
            return None
        if self.jumped_to is not None and 0 <= seq - self.jumped_to < CONFIRMED_WITHIN:
            self._begin(seq)
            return 0
        self.jumped_to = seq + 1
        return None

    def _go_on(self, stream: _Stream) -> None:
        stream.expected, stream.length = stream.expected + 1, stream.length + 1
        self.jumped_to = None
        self.streams.remove(stream)
        self.streams.insert(0, stream)

    def _begin(self, seq: int) -> None:
        if len(self.streams) == STREAMS:
            self.streams.remove(min(self.streams, key=lambda stream: stream.length))
        self.streams.insert(0, _Stream(seq + 1))
        self.jumped_to = None
