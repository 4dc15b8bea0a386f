"""What is known of a recording: channels, rates, gaps, who was there, what is missing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

from hmcs.bus.counters import Sequences
from hmcs.bus.messages import Envelope, Message
from hmcs.recordings.gaps import Gap
from hmcs.recordings.json_codec import NoMessageError, envelope_of, message_of, readable_as
from hmcs.recordings.reading import MODEL_SUFFIX, Recorded, RecordingContent


class ChannelSummary(NamedTuple):
    """What came on one key."""

    key: str
    schema: str
    messages: int
    rate_hz: float
    """Over the time from its first to its last message; 0 for one message."""
    lost: int
    """Missing in the numbers of its sources."""
    longest_gap_s: float


class Inspection(NamedTuple):
    """What a recording holds, and what it does not."""

    duration_s: float
    channels: tuple[ChannelSummary, ...]
    problems: tuple[str, ...]
    """What is missing, a sentence each; none for a recording that is whole and without gaps."""


class Loss(NamedTuple):
    """Messages that are missing in a recording."""

    at_s: float
    """When the next one came, since the recording's first message."""
    messages: int


def losses_of(content: RecordingContent, message_type: type[Message]) -> tuple[Loss, ...]:
    """Return where messages of a type are missing, in the order of time."""
    sequences, found = Sequences(), []
    schemas = [
        schema for schema in content.schemas if schema.partition("/")[0] == message_type.SCHEMA
    ]
    for message in content.messages.of_schemas(schemas):
        lost = _lost(sequences, message, _read(message).envelope)
        if lost:
            found.append(Loss((message.log_ns - content.first_ns) / 1e9, lost))
    return tuple(found)


def inspected(content: RecordingContent) -> Inspection:
    """Return what there is in a recording, channel by channel, and what is missing."""
    channels: dict[tuple[str, str], _Channel] = {}
    sequences, unreadable = Sequences(), _Unreadable()
    for message in content.messages:
        channel = channels.setdefault((message.key, message.schema), _Channel(message.log_ns))
        channel.heard(message.log_ns)
        envelope, why = _read(message)
        channel.lost += _lost(sequences, message, envelope)
        unreadable.note(message.key, why)
    summaries = tuple(
        channel.summary(key, schema) for (key, schema), channel in sorted(channels.items())
    )
    problems = [*damages(content), *unreadable.problems(), *_problems(content, summaries)]
    return Inspection(content.duration_s, summaries, tuple(problems))


def damages(content: RecordingContent) -> Iterator[str]:
    """Yield what is missing in a recording since its file is damaged or was not ended."""
    for gap in content.gaps:
        yield f"{_when(gap, content)} something is missing: {gap.why}"
    if content.gaps and content.lost:
        yield f"{content.lost} messages are missing in all, by the index of the file"
    if not content.whole:
        yield "it was cut off: what came in the last moments before its end is missing"
    for (key, why), count in sorted(content.passed_over.items()):
        yield _unread(count, key, why)


def unread(content: RecordingContent, *message_types: type[Message]) -> tuple[str, ...]:
    """Return what `content.of` passes over of some types, a sentence for each key."""
    unreadable = _Unreadable()
    schemas = [schema for schema in content.schemas if readable_as(schema) in message_types]
    for message in content.messages.of_schemas(schemas):
        unreadable.note(message.key, _read(message).why)
    return tuple(unreadable.problems())


class _Read(NamedTuple):
    envelope: Envelope | None
    why: str
    """Why it cannot be read; empty where it can."""


def _read(message: Recorded) -> _Read:
    message_type = readable_as(message.schema)
    try:
        if message_type is None:
            return _Read(envelope_of(message.text), "")
        return _Read(message_of(message_type, message.text)[0], "")
    except NoMessageError as error:
        return _Read(None, str(error))


class _Unreadable:
    """Messages that cannot be read, by key, each with why the first one cannot."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._why: dict[str, str] = {}

    def note(self, key: str, why: str) -> None:
        if why:
            self._counts[key] += 1
            self._why.setdefault(key, why)

    def problems(self) -> Iterator[str]:
        for key, count in sorted(self._counts.items()):
            yield _unread(count, key, self._why[key])


class _Channel:
    """What was heard on one key."""

    def __init__(self, first_ns: int) -> None:
        self._first_ns = self._last_ns = first_ns
        self._longest_gap_ns = 0
        self._messages = 0
        self.lost = 0

    def heard(self, log_ns: int) -> None:
        self._longest_gap_ns = max(self._longest_gap_ns, log_ns - self._last_ns)
        self._last_ns = log_ns
        self._messages += 1

    def summary(self, key: str, schema: str) -> ChannelSummary:
        span_s = (self._last_ns - self._first_ns) / 1e9
        rate_hz = (self._messages - 1) / span_s if span_s > 0 else 0.0
        gap_s = self._longest_gap_ns / 1e9
        return ChannelSummary(key, schema, self._messages, rate_hz, self.lost, gap_s)


def _lost(sequences: Sequences, message: Recorded, envelope: Envelope | None) -> int:
    """How many messages are missing before this one, by the number its source gave it."""
    if envelope is None:
        return 0
    return sequences.note(message.key, envelope.source.boot, envelope.seq) or 0


def _when(gap: Gap, content: RecordingContent) -> str:
    begin, end = (
        None if at is None or not content.messages else f"{(at - content.first_ns) / 1e9:.3f} s"
        for at in (gap.begin_ns, gap.end_ns)
    )
    if begin is None:
        return "somewhere" if end is None else f"before {end}"
    return f"after {begin}" if end is None else f"between {begin} and {end}"


def _unread(count: int, key: str, why: str) -> str:
    return f"{count} {'message' if count == 1 else 'messages'} on {key} cannot be read: {why}"


def _problems(content: RecordingContent, channels: tuple[ChannelSummary, ...]) -> Iterator[str]:
    for channel in channels:
        if channel.lost:
            yield f"{channel.lost} messages are missing on {channel.key}"
    version = content.metadata.get("hmcs", {}).get("version", "unknown")
    for schema in sorted(each for each in content.schemas if readable_as(each) is None):
        yield (
            f"{schema} cannot be read: it is of another version of the contract; replay and train "
            f"with version {version} of hmcs, which recorded it"
        )
    if "step" not in {schema.partition("/")[0] for schema in content.schemas}:
        yield "there are no steps: the hand did not move, nothing can be replayed"
    if not any(name.endswith(MODEL_SUFFIX) for name in content.attachments):
        yield "no model is kept with it: replay needs one by --model"
