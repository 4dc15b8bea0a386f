"""What every message is, and the envelope that it travels in."""

from __future__ import annotations

from typing import ClassVar

from pydantic import BaseModel, ConfigDict

from hmcs.bus.messages.fields import Chunk, Count, Nanoseconds


class Part(BaseModel):
    """A part of a message: frozen, strict about types, tolerant of fields it does not know."""

    model_config = ConfigDict(
        frozen=True,
        strict=True,
        extra="ignore",
        allow_inf_nan=False,
        arbitrary_types_allowed=True,
        use_attribute_docstrings=True,
    )


class Message(Part):
    """The body of a message: `SCHEMA` names it on the wire, `VERSION` counts breaking changes."""

    SCHEMA: ClassVar[str]
    VERSION: ClassVar[int] = 1


class Source(Part):
    """Who sent a message."""

    service: Chunk
    """Kind of process, e.g. `gesteme_classifier`."""
    instance: Chunk
    """Which one of its kind."""
    boot: Chunk
    """A new value at every start of the process: sequence numbers count within one boot."""


class Origin(Part):
    """The operator sample that caused a message, handed on from hop to hop."""

    boot: Chunk
    """Boot of the input device that captured the sample."""
    seq: Count
    """Sequence number of its Motion."""
    captured_ns: Nanoseconds
    """Capture time by that device's own monotonic clock, ns; comparable only where it was taken."""


class Envelope(Part):
    """What every message carries besides its body."""

    source: Source
    seq: Count
    """Counts what this source published on this key, from 0."""
    origin: Origin | None = None
    """None where no operator sample caused the message."""
