"""The messages of a recording one after another, with a small part of the file in memory."""

from __future__ import annotations

import heapq
from array import array
from collections.abc import Iterator, Set
from typing import NamedTuple

import numpy as np

from hmcs.errors import UserError
from hmcs.recordings.mcap_chunks import DamageError, Message, messages_in
from hmcs.recordings.mcap_records import RecordFile
from hmcs.recordings.scan import LATEST_NS, Block, Scan, records_of, why_passed_over

MOST_OVERLAPPING_BYTES = 64 * 1024 * 1024
"""Of parts of a file whose times overlap: they are held at once while they are put in order. Those
of writers that mix several sources have some megabytes."""


class RecordingError(UserError):
    """A recording that cannot be used for what was asked; says why and what to do."""


class Found(NamedTuple):
    """One message, and the bytes in which it stands."""

    message: Message
    data: bytes


def found_in(file: RecordFile, scan: Scan, channels: Set[int], types: int) -> Iterator[Found]:
    """Yield the messages on some channels, whose message types have the bits `types`.

    In the order in which they stand in the file where HMCS wrote it, else by log time, as MCAP's
    own readers do; those of one time as they stand in the file. Raises RecordingError where more
    than MOST_OVERLAPPING_BYTES would have to be held, and where the file changed since the scan.
    """
    if scan.as_it_stands:
        for block in scan.blocks(types):
            data = _records_of(file, block)
            for message in _usable(scan, channels, data):
                yield Found(message, data)
    else:
        yield from _by_time(file, scan, channels, types)


class _Opened:
    """The messages of a block by their times."""

    def __init__(self, block: Block, data: bytes, messages: Iterator[Message]) -> None:
        self.at, self.data = block.at, data
        numbers = array("q")
        for message in messages:
            numbers.extend(message)
        self._messages = np.frombuffer(numbers, np.int64).reshape(-1, len(Message._fields))
        self._order = np.argsort(self._messages[:, 1], kind="stable")
        self.bytes = len(data) + self._messages.nbytes + self._order.nbytes

        self.count = len(self._order)

    def message(self, number: int) -> Message:
        """Return the message at that place in the order of time."""
        return Message(*self._messages[self._order[number]].tolist())


class _Merging:
    """Blocks whose times overlap, as one row of messages."""

    def __init__(self) -> None:
        self._opened: dict[int, _Opened] = {}
        self._coming: list[tuple[int, int, int]] = []
        """For each block: log time of its next message, where the block stands, which message."""
        self.bytes = 0
        """That are held."""

    def open(self, one: _Opened) -> None:
        self._opened[one.at] = one
        self.bytes += one.bytes
        self._push(one, 0)

    def until(self, log_ns: int) -> Iterator[Found]:
        """Yield what comes before that time."""
        while self._coming and self._coming[0][0] < log_ns:
            _, at, number = heapq.heappop(self._coming)
            one = self._opened[at]
            yield Found(one.message(number), one.data)
            self._push(one, number + 1)

    def _push(self, one: _Opened, number: int) -> None:
        if number < one.count:
            heapq.heappush(self._coming, (one.message(number).log_ns, one.at, number))
        else:
            self.bytes -= self._opened.pop(one.at).bytes


def _by_time(file: RecordFile, scan: Scan, channels: Set[int], types: int) -> Iterator[Found]:
    merging = _Merging()
    for block in scan.blocks(types, by_time=True):
        yield from merging.until(block.first_ns)
        data = _records_of(file, block)
        merging.open(_Opened(block, data, _usable(scan, channels, data)))
        if merging.bytes > MOST_OVERLAPPING_BYTES:
            raise RecordingError(
                f"more than {MOST_OVERLAPPING_BYTES / 1e6:.0f} MB of its messages would have to be "
                "put in the order of time at once: sort the file, e.g. with `mcap sort`"
            )
    yield from merging.until(LATEST_NS + 1)


def _records_of(file: RecordFile, block: Block) -> bytes:
    try:
        return records_of(file, block)
    except (DamageError, IndexError, ValueError) as error:
        raise RecordingError(f"it changed while it was read ({error})") from error


def _usable(scan: Scan, channels: Set[int], data: bytes) -> Iterator[Message]:
    """The messages on these channels, as far as the records in a block go."""
    try:
        for message in messages_in(data):
            channel = message.channel
            if channel in channels and not why_passed_over(scan.channels[channel], message, data):
                yield message
    except DamageError:
        # Noted as a gap when the block was scanned.
        return
