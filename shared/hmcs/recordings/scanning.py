"""One pass over a recording, however damaged, that finds what stands where in it."""

from __future__ import annotations

import re
import struct
from collections import Counter
from typing import BinaryIO

from mcap import records as mcap
from mcap.exceptions import McapError
from mcap.opcode import Opcode

from hmcs.recordings.gaps import Gap, Gaps
from hmcs.recordings.mcap_channels import (
    CHANNEL_TOLD,
    HMCS,
    LARGEST_TEXT_BYTES,
    Channel,
    Channels,
    Strict,
    TextBudget,
)
from hmcs.recordings.mcap_chunks import (
    LARGEST_CHUNK_BYTES,
    Chunk,
    DamageError,
    Message,
    check,
    chunk_of,
    message_at,
    records_in,
    unpacked,
)
from hmcs.recordings.mcap_index import Index, index_of
from hmcs.recordings.mcap_records import OF_INDEX, Record, RecordFile, Torn
from hmcs.recordings.scan import (
    LARGEST_MESSAGE_BYTES,
    LATEST_NS,
    Block,
    Scan,
    attached_at,
    why_passed_over,
)

MOST_EXPANSION = 200
"""So many times the size of the file may come out of it. JSON of a stack at rest is packed to a
fortieth, of one in motion to a fifth; a file packed more densely than that was made to keep its
reader busy for hours."""
EXPANSION_SLACK_BYTES = 64 * 1024 * 1024
"""Besides, so that no small file is refused."""
_HEAD_ROOM_BYTES = 128
_LARGEST_LOOSE_BYTES = 1 << 20
_SAYS_SCHEMA = re.compile(rb'\{"schema": ?"([a-z_]{1,64}/[0-9]{1,4})"')
"""How messages of the contract begin in a recording."""
_DAY_NS = 86_400_000_000_000


def scanned(stream: BinaryIO, size: int) -> Scan:
    """Return what is in the first `size` bytes of a file that begins as an MCAP file does."""
    return _Scanner(stream, size).scan()


class _Scanner:
    def __init__(self, stream: BinaryIO, size: int) -> None:
        self._told = TextBudget()
        self._gaps = Gaps()
        self._no_index = ""
        self._index = index = self._index_of(stream, size)
        self._channels = Channels(self._told)
        self._said = Channels(self._told)
        """What metadata say of channels, in case their own descriptions are damaged."""
        self._file = RecordFile(
            stream, size, None if index is None else index.at, () if index is None else index.places
        )
        self._scan = Scan(size, whole=index is not None)
        self._seen: Counter[int] = Counter()
        """Messages of the contract by channel, those passed over as well."""
        self._left_bytes = size * MOST_EXPANSION + EXPANSION_SLACK_BYTES
        self._last_ns = self._earliest_ns = 0
        self._undescribed = _Span()
        self._loose: Block | None = None

    def _index_of(self, stream: BinaryIO, size: int) -> Index | None:
        try:
            return index_of(stream, size, self._told)
        except DamageError as error:
            self._no_index = str(error)
            return None

    def scan(self) -> Scan:
        for record in self._file.records():
            try:
                if isinstance(record, Record):
                    self._take(record)
                elif isinstance(record, Torn):
                    self._gaps.miss("no record can be read there")
            except DamageError as error:
                self._gaps.miss(str(error))
        self._end_loose()
        scan, index = self._scan, self._index
        scan.channels = {number: self._channels[number] for number in scan.counts}
        scan.lost = sum(
            max(0, count - self._seen[number])
            for number, count in ({} if index is None else index.counts).items()
            if (channel := self._channel(number)) is not None and channel.of_contract
        )
        if not scan.as_it_stands:
            scan.first_ns = min(scan.first_ns, self._earliest_ns)
        scan.gaps = tuple(self._all_gaps())
        return scan

    def _all_gaps(self) -> list[Gap]:
        gaps = list(self._gaps)
        unknown = self._undescribed
        if unknown.count:
            why = f"{unknown.count} messages of channels that nothing describes"
            gaps.append(Gap(unknown.first_ns, unknown.last_ns, why))
        elif self._scan.lost and not gaps:
            gaps.append(Gap(None, None, "messages that its index counts"))
        if self._no_index:
            gaps.append(Gap(None, None, self._no_index))
        return gaps

    def _take(self, record: Record) -> None:
        opcode = record.opcode
        if opcode != Opcode.MESSAGE:
            self._end_loose()
        if opcode == Opcode.CHUNK:
            self._chunk(record)
        elif opcode == Opcode.MESSAGE:
            self._loose_message(record)
        elif opcode == Opcode.DATA_END or opcode in OF_INDEX:
            self._scan.whole = True
        elif opcode == Opcode.ATTACHMENT:
            attached = attached_at(self._file, record)
            self._told.hold(attached.name)
            self._scan.attachments[attached.name] = attached
        elif opcode in (Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA):
            self._words(record)
        elif opcode != Opcode.MESSAGE_INDEX:
            raise DamageError(f"a record of a kind that is unknown here ({opcode})")

    def _chunk(self, record: Record) -> None:
        # Of one that is too large only the head is read.
        room = record.content + LARGEST_CHUNK_BYTES + _HEAD_ROOM_BYTES
        end = record.end if record.end <= room else record.content + _HEAD_ROOM_BYTES
        chunk = chunk_of(self._file.read(record.content, end))
        try:
            if record.end > room:
                raise DamageError(f"a chunk of more than {LARGEST_CHUNK_BYTES / 1e6:.0f} MB")
            self._within_chunk(record, self._unpacked(chunk))
        except DamageError as error:
            self._file.doubt(record)
            self._gaps.miss(str(error), *_times_of(chunk))

    def _unpacked(self, chunk: Chunk) -> bytes:
        size = chunk.unpacked_bytes
        if LARGEST_CHUNK_BYTES >= size > self._left_bytes:
            raise DamageError(f"more than {MOST_EXPANSION} times what the file has, unpacked")
        # What cannot be unpacked may have been as long in the making as it says it is large.
        self._left_bytes -= size
        data = unpacked(chunk)
        self._left_bytes += size - len(data)
        check(chunk, data)
        return data

    def _within_chunk(self, record: Record, data: bytes) -> None:
        span, types = _Span(), 0
        try:
            for opcode, begin, end in records_in(data):
                if opcode == Opcode.MESSAGE:
                    message = message_at(data, begin, end)
                    if bit := self._message(message, data):
                        types |= bit
                        span.take(message.log_ns)
                elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                    self._channels.take(opcode, data[begin:end])
        finally:
            if types:
                block = Block(record.at, record.end, span.first_ns, span.last_ns, types)
                self._scan.note(block)

    def _loose_message(self, record: Record) -> None:
        room = record.content + LARGEST_MESSAGE_BYTES + _HEAD_ROOM_BYTES
        data = self._file.read(record.content, min(record.end, room))
        message = message_at(data, 0, len(data))
        bit = self._message(message, data)
        loose = self._loose
        if loose is not None and (
            loose.end != record.at or record.end - loose.at > _LARGEST_LOOSE_BYTES
        ):
            self._end_loose()
            loose = None
        if loose is not None:
            first_ns = min(loose.first_ns, message.log_ns) if bit else loose.first_ns
            last_ns = max(loose.last_ns, message.log_ns) if bit else loose.last_ns
            self._loose = Block(loose.at, record.end, first_ns, last_ns, loose.types | bit)
        elif bit:
            self._loose = Block(record.at, record.end, message.log_ns, message.log_ns, bit)

    def _end_loose(self) -> None:
        if self._loose is not None:
            self._scan.note(self._loose)
            self._loose = None

    def _message(self, message: Message, data: bytes) -> int:
        """Count a message; return the bit of its type, 0 where it is passed over."""
        channel = self._channel(message.channel) or self._guessed(message, data)
        if channel is None:
            self._undescribed.take(message.log_ns)
            return 0
        if not channel.of_contract:
            return 0
        scan, log_ns = self._scan, message.log_ns
        self._seen[message.channel] += 1
        why = why_passed_over(channel, message, data)
        if why:
            scan.passed_over[channel.topic, why] += 1
            return 0
        if not scan.counts:
            scan.last_ns = self._last_ns = self._earliest_ns = log_ns
            # What is said in seconds since then stays true though the first chunk is damaged.
            begins = (gap.begin_ns or log_ns for gap in self._gaps)
            scan.first_ns = min([log_ns, *(at for at in begins if at > log_ns - _DAY_NS)])
        scan.in_order = scan.in_order and log_ns >= self._last_ns
        scan.counts[message.channel] += 1
        scan.last_ns = max(scan.last_ns, log_ns)
        self._earliest_ns = min(self._earliest_ns, log_ns)
        self._last_ns = log_ns
        self._gaps.read(log_ns)
        return scan.bit(channel.message_type)

    def _channel(self, number: int) -> Channel | None:
        channel = self._channels.get(number)
        if channel is None:
            if self._index is not None:
                channel = self._index.channels.get(number)
            channel = channel or self._said.get(number)
            if channel is not None:
                self._channels.add(number, channel)
        return channel

    def _guessed(self, message: Message, data: bytes) -> Channel | None:
        """What a channel must be whose description is damaged, by what its message says it is."""
        said = _SAYS_SCHEMA.match(data, message.begin, message.end)
        if said is None:
            return None
        topic = self._channels.topics.get(message.channel, f"unknown/{message.channel}")
        guess = Channel(topic, f"{HMCS}{said[1].decode()}", "json")
        self._channels.add(message.channel, guess)
        return guess

    def _words(self, record: Record) -> None:
        if record.end - record.content > LARGEST_TEXT_BYTES:
            raise DamageError(f"a record of words of more than {LARGEST_TEXT_BYTES / 1e6:.0f} MB")
        content = self._file.read(record.content, record.end)
        try:
            if record.opcode == Opcode.HEADER:
                self._scan.library = mcap.Header.read(Strict(content)).library
            elif record.opcode == Opcode.METADATA:
                metadata = mcap.Metadata.read(Strict(content))
                self._metadata(metadata.name, metadata.metadata)
            else:
                self._channels.take(record.opcode, content)
        except (McapError, struct.error, ValueError, OverflowError) as error:
            raise DamageError(f"damaged metadata ({error})") from error

    def _metadata(self, name: str, facts: dict[str, str]) -> None:
        if name == CHANNEL_TOLD:
            topic, schema = facts.get("topic", ""), facts.get("schema", "")
            self._said.add(int(facts.get("channel", "")), Channel(topic, schema, "json"))
        else:
            self._told.hold(name, *facts, *facts.values())
            self._scan.metadata[name] = facts


class _Span:
    """The times of some messages."""

    def __init__(self) -> None:
        self.count = 0
        self.first_ns = self.last_ns = 0

    def take(self, log_ns: int) -> None:
        """Note one more."""
        self.first_ns = min(self.first_ns, log_ns) if self.count else log_ns
        self.last_ns = max(self.last_ns, log_ns) if self.count else log_ns
        self.count += 1


def _times_of(chunk: Chunk) -> tuple[int | None, int | None]:
    """The log times a chunk's head says it has, where they can be true."""
    first_ns, last_ns = chunk.first_ns, chunk.last_ns
    if 0 < first_ns <= last_ns <= min(first_ns + _DAY_NS, LATEST_NS):
        return first_ns, last_ns
    return None, None
