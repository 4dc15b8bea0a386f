"""What a process counts of its traffic, per schema, and how a loss is seen in sequence numbers."""

from __future__ import annotations

from collections import Counter, OrderedDict

_REMEMBERED_BOOTS = 4096


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
        self._expected: OrderedDict[tuple[str, str], int] = OrderedDict()

    def note(self, key: str, boot: str, seq: int, overwritten: int = 0) -> int | None:
        """Return how many messages were lost before this one, or None if it is no news.

        `overwritten` messages arrived but gave way to newer ones in the mailbox; they are no loss.
        The first message of a boot starts its count; one numbered below an earlier one is a
        duplicate or was overtaken, neither of them a loss.
        """
        expected = self._expected.get((key, boot))
        if expected is not None and seq < expected:
            return None
        self._expected[key, boot] = seq + 1
        self._expected.move_to_end((key, boot))
        if len(self._expected) > _REMEMBERED_BOOTS:
            self._expected.popitem(last=False)
        return 0 if expected is None else max(0, seq - expected - overwritten)
