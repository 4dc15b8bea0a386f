"""What a recording holds, as far as it can be read; its messages are read when they are asked for.

However large the file is, and whatever is in it, little of it is in memory at once. What is damaged
is passed over and noted, with the times around it; all that is whole is read.
"""

from __future__ import annotations

import os
import stat
import zlib
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import BinaryIO, NamedTuple, TypeVar, cast

from hmcs.bus.messages import Envelope
from hmcs.bus.messages import Message as BusMessage
from hmcs.bus.wire import schema_of
from hmcs.recordings.gaps import Gap
from hmcs.recordings.in_order import RecordingError, found_in
from hmcs.recordings.json_codec import Fields, NoMessageError, json_fields, message_of, readable_as
from hmcs.recordings.mcap_records import MAGIC, RecordFile
from hmcs.recordings.scan import Scan
from hmcs.recordings.scanning import scanned

M = TypeVar("M", bound=BusMessage)

__all__ = ["Recorded", "RecordingContent", "RecordingError", "read"]

MODEL_SUFFIX = ".hmcs"
"""Of the names of models that are kept with a recording."""
LARGEST_ATTACHMENT_BYTES = 64 * 1024 * 1024
"""Of a file kept with a recording, when it is read. Models have up to some megabytes."""


class Recorded(NamedTuple):
    """One message of a recording."""

    key: str
    schema: str
    """With its version, e.g. `motion/1`."""
    text: bytes
    """JSON of envelope and body."""
    log_ns: int
    """When the recorder got it, ns since 1970."""
    captured_ns: int
    """When the operator's sample that caused it was taken, by the recorder's clock."""

    @property
    def fields(self) -> Fields:
        """Envelope and body as JSON has them; NoMessageError where the text is none."""
        return json_fields(self.text)


class Messages(Collection[Recorded]):
    """The messages of the contract in a recording; each use reads the file anew."""

    def __init__(self, path: Path, scan: Scan) -> None:
        self._path, self._scan = path, scan

    def __len__(self) -> int:
        return self._scan.counts.total()

    def __iter__(self) -> Iterator[Recorded]:
        return self.of_schemas(None)

    def __contains__(self, message: object) -> bool:
        return any(each == message for each in self)

    def __getitem__(self, number: int) -> Recorded:
        """Return one of them; all before it are read."""
        return next(islice(self, range(len(self))[number], None))

    def of_schemas(self, schemas: Sequence[str] | None) -> Iterator[Recorded]:
        """Yield those with one of these schemas, with version, or all; raises as `read`."""
        scan = self._scan
        channels = {
            number: (channel.topic, channel.message_type)
            for number, channel in scan.channels.items()
            if schemas is None or channel.message_type in schemas
        }
        types = 0
        for _, message_type in channels.values():
            types |= scan.bit(message_type)
        try:
            with self._path.open("rb") as stream:
                file = RecordFile(stream, scan.size, None, ())
                for message, data in found_in(file, scan, channels.keys(), types):
                    key, schema = channels[message.channel]
                    text = data[message.begin : message.end]
                    yield Recorded(key, schema, text, message.log_ns, message.captured_ns)
        except OSError as error:
            raise _unreadable(self._path, error) from error
        except MemoryError as error:
            raise _too_little_memory(self._path) from error
        except RecordingError as error:
            raise RecordingError(f"{self._path}: {error}") from error


class Attachments(Mapping[str, bytes]):
    """Files kept with a recording by their names, which are data and never paths.

    Each is read when it is asked for; RecordingError where it is larger than
    LARGEST_ATTACHMENT_BYTES or damaged.
    """

    def __init__(self, path: Path, scan: Scan) -> None:
        self._path, self._attached = path, scan.attachments

    def __len__(self) -> int:
        return len(self._attached)

    def __iter__(self) -> Iterator[str]:
        return iter(self._attached)

    def __getitem__(self, name: str) -> bytes:
        attached = self._attached[name]
        if attached.size > LARGEST_ATTACHMENT_BYTES:
            raise RecordingError(
                f"{self._path}: {name[:64]!r} is kept with it and has {attached.size / 1e6:.0f} "
                f"MB, more than the {LARGEST_ATTACHMENT_BYTES / 1e6:.0f} that are read"
            )
        try:
            with self._path.open("rb") as stream:
                stream.seek(attached.record.content)
                content = stream.read(attached.record.end - attached.record.content)
        except OSError as error:
            raise _unreadable(self._path, error) from error
        crc = int.from_bytes(content[-4:], "little")
        if crc and crc != zlib.crc32(content[:-4]):
            raise RecordingError(f"{self._path}: {name[:64]!r}, which is kept with it, is damaged")
        begin = attached.at - attached.record.content
        return content[begin : begin + attached.size]


@dataclass(frozen=True)
class RecordingContent:
    """What a recording holds."""

    path: Path
    messages: Messages
    """Of the contract, in the order they came."""
    metadata: Mapping[str, Mapping[str, str]]
    attachments: Attachments
    whole: bool
    """Whether the recorder ended it; else it was cut off, and what came last may be missing."""
    gaps: tuple[Gap, ...]
    """Where it is damaged: what is missing between the messages that are read."""
    lost: int
    """Messages that its index counts and that are missing; 0 where it has no index."""
    passed_over: Mapping[tuple[str, str], int]
    """Messages that cannot be read, by key and reason."""
    schemas: Mapping[str, int]
    """How many messages there are of each schema, with its version."""
    first_ns: int
    """When its first message was logged; 0 where there is none."""
    last_ns: int
    """When the latest one was; 0 where there is none."""

    @property
    def duration_s(self) -> float:
        """From the first to the last message."""
        return (self.last_ns - self.first_ns) / 1e9

    @property
    def damage(self) -> str:
        """Why something is missing in it; empty where nothing is known to be."""
        return "; ".join(dict.fromkeys(gap.why for gap in self.gaps))

    def of(self, message_type: type[M]) -> Iterator[tuple[Recorded, Envelope, M]]:
        """Yield the messages of a type; those that are none of it are passed over.

        Raises RecordingError where they are of another version of the contract.
        """
        for recorded, envelope, message in self.of_any(message_type):
            yield recorded, envelope, cast(M, message)

    def of_any(
        self, *message_types: type[BusMessage]
    ) -> Iterator[tuple[Recorded, Envelope, BusMessage]]:
        """Yield the messages of several types in the order they came; raises as `of` does."""
        types = {
            schema: message_type
            for schema in self.schemas
            if (message_type := readable_as(schema)) in message_types and message_type is not None
        }
        self._check_versions(types, message_types)
        for recorded in self.messages.of_schemas(tuple(types)):
            try:
                envelope, message = message_of(types[recorded.schema], recorded.text)
            except NoMessageError:
                continue
            yield recorded, envelope, message

    def _check_versions(
        self, types: Mapping[str, type[BusMessage]], message_types: Sequence[type[BusMessage]]
    ) -> None:
        wanted = {message_type.SCHEMA: schema_of(message_type) for message_type in message_types}
        for schema in self.schemas:
            expected = wanted.get(schema.partition("/")[0])
            if expected is not None and schema not in types:
                raise RecordingError(
                    f"{self.path}: has {schema}, expected {expected}: it was recorded "
                    f"with version {self.metadata.get('hmcs', {}).get('version', 'unknown')} of "
                    "hmcs; read it with that one"
                )


def read(path: str | Path) -> RecordingContent:
    """Look at a recording; its messages are read from the file when they are asked for.

    Raises RecordingError where there is no such file, or it is none of MCAP at all.
    """
    file = Path(path)
    try:
        if not stat.S_ISREG(file.stat().st_mode):
            raise RecordingError(f"{file}: is no file: name an MCAP file")
        with file.open("rb") as stream:
            size = os.fstat(stream.fileno()).st_size
            _check_magic(file, stream, size)
            scan = scanned(stream, size)
    except OSError as error:
        raise _unreadable(file, error) from error
    except MemoryError as error:
        raise _too_little_memory(file) from error
    return RecordingContent(
        file,
        Messages(file, scan),
        scan.metadata,
        Attachments(file, scan),
        scan.whole,
        tuple(scan.gaps),
        scan.lost,
        scan.passed_over,
        Counter(scan.types),
        scan.first_ns,
        scan.last_ns,
    )


def _check_magic(file: Path, stream: BinaryIO, size: int) -> None:
    """Raise RecordingError for what is neither the beginning of an MCAP file nor has its end."""
    begun = stream.read(len(MAGIC))
    stream.seek(max(size - len(MAGIC), 0))
    if not MAGIC.startswith(begun) and stream.read() != MAGIC:
        raise RecordingError(f"{file}: no recording: it does not begin as an MCAP file does")


def _unreadable(file: Path, error: OSError) -> RecordingError:
    return RecordingError(f"{file}: cannot be read: {error.strerror or error}")


def _too_little_memory(file: Path) -> RecordingError:
    return RecordingError(f"{file}: there is too little memory to read it: end other programs")
