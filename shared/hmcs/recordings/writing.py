"""A recording as a file that is whole up to its last chunk whatever happens to its writer."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any, cast

from mcap.writer import CompressionType, Writer

from hmcs.recordings.foxglove import SCHEMAS
from hmcs.recordings.json_codec import BY_SCHEMA, json_schema_of
from hmcs.recordings.mcap_channels import CHANNEL_TOLD, HMCS
from hmcs.recordings.scan import LARGEST_MESSAGE_BYTES

PROFILE = "hmcs"
CHUNK_BYTES = 256 * 1024
"""Before compression; a chunk is the unit that can be lost."""
MOST_CHANNELS = 4096
"""Of a file. A stack has some ten; MCAP has room for sixteen times as many, and each is described
in several hundred bytes."""


class RecordingFile:
    """One MCAP file that is being written: JSON with its schema for every channel.

    Every write may raise OSError, after which the file is to be left as it is; what it holds up to
    its last whole chunk can be read.
    """

    def __init__(self, path: Path, library: str) -> None:
        """Begin the file; raises FileExistsError where there is one, OSError as writing does."""
        # Unbuffered: what was written is the system's and outlives this process.
        self._stream = path.open("xb", buffering=0)
        self.path = path
        self._writer = Writer(
            cast("IO[Any]", _Whole(self._stream)),
            chunk_size=CHUNK_BYTES,
            compression=CompressionType.ZSTD,
        )
        self._writer.start(PROFILE, library)
        self._schemas: dict[str, int] = {}
        self._channels: dict[tuple[str, str], int] = {}
        self._number = 0

    @property
    def size_bytes(self) -> int:
        """What is on the disk."""
        return self._stream.tell()

    def write(
        self, topic: str, schema: str, fields: Mapping[str, Any], log_ns: int, captured_ns: int
    ) -> None:
        """Add a message, ns since 1970, in a schema of this contract or of Foxglove's.

        Raises ValueError for numbers that are not finite, for a text larger than
        LARGEST_MESSAGE_BYTES, and for the first message of one channel more than MOST_CHANNELS.
        """
        text = json.dumps(fields, separators=(",", ":"), allow_nan=False).encode()
        if len(text) > LARGEST_MESSAGE_BYTES:
            raise ValueError(
                f"{len(text) / 1e6:.1f} MB as JSON, at most {LARGEST_MESSAGE_BYTES / 1e6:.1f} MB "
                "are recorded"
            )
        channel = self._channels.get((topic, schema))
        if channel is None:
            channel = self._register(topic, schema)
        # MCAP numbers messages in 32 bits.
        number, self._number = self._number, (self._number + 1) % 2**32
        self._writer.add_message(channel, log_ns, text, captured_ns, number)

    def tell(self, name: str, facts: Mapping[str, str]) -> None:
        """Add what is to be known about the recording."""
        self._writer.add_metadata(name, dict(facts))

    def attach(self, name: str, content: bytes, log_ns: int) -> None:
        """Add a file, e.g. the model that was active."""
        self._writer.add_attachment(log_ns, log_ns, name, "application/octet-stream", content)

    @property
    def is_there(self) -> bool:
        """Whether it has a name on the disk still: else what is written to it is lost."""
        # Of a file that was only moved there is a link; some file systems never count any.
        return os.fstat(self._stream.fileno()).st_nlink > 0 or self.path.exists()

    def flush(self) -> None:
        """End the chunk, so that all until now is safe from the end of this process."""
        self._writer.flush()  # type: ignore[no-untyped-call]

    def finish(self) -> None:
        """Write the index and close; OSError leaves it closed without one.

        A second time does nothing.
        """
        if self._stream.closed:
            return
        try:
            self._writer.finish()  # type: ignore[no-untyped-call]
        finally:
            self._stream.close()

    def abandon(self) -> None:
        """Close it as it is."""
        self._stream.close()

    def _register(self, topic: str, schema: str) -> int:
        if len(self._channels) >= MOST_CHANNELS:
            raise ValueError(f"there are messages of {MOST_CHANNELS} kinds and keys already")
        number = self._writer.register_channel(topic, "json", self._schema(schema))
        self._channels[topic, schema] = number
        # Said outside of the chunk as well: should that be damaged, the others can be read.
        facts = {"channel": str(number), "topic": topic, "schema": _title(schema)}
        self.tell(CHANNEL_TOLD, facts)
        return number

    def _schema(self, name: str) -> int:
        if name not in self._schemas:
            known = SCHEMAS.get(name) or json_schema_of(BY_SCHEMA[name])
            title = _title(name)
            content = json.dumps({"title": title, **known}).encode()
            self._schemas[name] = self._writer.register_schema(title, "jsonschema", content)
        return self._schemas[name]


def _title(schema: str) -> str:
    """The name of a schema in the file; the viewer shows what it knows by its own names."""
    return schema if schema in SCHEMAS else f"{HMCS}{schema}"


class _Whole:
    """A stream that writes all of what it is given or raises: a raw one may write a part."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream

    def write(self, data: bytes) -> int:
        left = memoryview(data)
        while left:
            left = left[self._stream.write(left) :]
        return len(data)

    def tell(self) -> int:
        return int(self._stream.tell())

    def flush(self) -> None:
        self._stream.flush()
