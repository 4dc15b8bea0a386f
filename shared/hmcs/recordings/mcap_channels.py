"""What the channels of an MCAP file are: topic, schema and encoding, by their number."""

from __future__ import annotations

import io
import struct
from typing import NamedTuple

from mcap import records as mcap
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode

from hmcs.recordings.mcap_chunks import DamageError

HMCS = "hmcs."
"""What schemas of the contract begin with in a recording."""
CHANNEL_TOLD = "hmcs/channel"
"""A metadata record of this name says what a channel is, as a chunk says it too: where that chunk
is damaged, messages in the others are still known."""
LARGEST_TEXT_BYTES = 16 * 1024 * 1024
"""Of all names and metadata in a file, which are held while it is used, and of each record of them;
those of a whole stack have some hundred kilobytes."""


class Channel(NamedTuple):
    """What a channel is."""

    topic: str
    schema: str
    """Empty where it has none."""
    encoding: str

    @property
    def of_contract(self) -> bool:
        """Whether its messages are of the contract, of whatever version and encoding."""
        return self.schema.startswith(HMCS)

    @property
    def message_type(self) -> str:
        """Name and version of its messages as on the wire, e.g. `motion/1`."""
        return self.schema.removeprefix(HMCS)


class Strict(ReadDataStream):
    """What mcap parses records from; raises EndOfFile where there is less than was asked for."""

    def __init__(self, content: bytes) -> None:
        super().__init__(io.BytesIO(content))

    def read(self, length: int) -> bytes:
        """Return exactly `length` bytes."""
        data = super().read(length)
        if len(data) != length:
            raise EndOfFile
        return data


class TextBudget:
    """Counts what is held of a file's own words."""

    def __init__(self) -> None:
        self._left = LARGEST_TEXT_BYTES

    def hold(self, *words: str) -> None:
        """Note some more; DamageError where it is too much."""
        self._left -= sum(len(word) + 64 for word in words)
        if self._left < 0:
            raise DamageError(f"more than {LARGEST_TEXT_BYTES / 1e6:.0f} MB of names and metadata")


class Channels:
    """The channels described so far; the first description of a number counts."""

    def __init__(self, budget: TextBudget) -> None:
        self._budget = budget
        self._schemas: dict[int, str] = {0: ""}
        self._channels: dict[int, Channel] = {}
        self.topics: dict[int, str] = {}
        """Of channels whose schema was never described."""

    def __getitem__(self, number: int) -> Channel:
        return self._channels[number]

    def get(self, number: int) -> Channel | None:
        """Return what a channel is; None where nothing said so."""
        return self._channels.get(number)

    def take(self, opcode: int, content: bytes) -> None:
        """Take in a record, if it is of a schema or a channel; DamageError where it is none."""
        try:
            if opcode == Opcode.SCHEMA:
                schema = mcap.Schema.read(Strict(content))
                if schema.id not in self._schemas:
                    self._budget.hold(schema.name)
                    self._schemas[schema.id] = schema.name
            elif opcode == Opcode.CHANNEL:
                channel = mcap.Channel.read(Strict(content))
                if channel.schema_id in self._schemas:
                    name = self._schemas[channel.schema_id]
                    self.add(channel.id, Channel(channel.topic, name, channel.message_encoding))
                elif channel.id not in self.topics:
                    self._budget.hold(channel.topic)
                    self.topics[channel.id] = channel.topic
        except (McapError, struct.error, ValueError, OverflowError) as error:
            raise DamageError(f"a damaged description of a channel ({error})") from error

    def add(self, number: int, channel: Channel) -> None:
        """Take in what a channel is, unless it is known; DamageError where it is too much."""
        if number not in self._channels:
            self._budget.hold(*channel)
            self._channels[number] = channel
