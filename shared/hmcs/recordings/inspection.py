"""What a recording tells of itself: channels, rates, gaps, who was there, what is missing."""

from __future__ import annotations

from collections import defaultdict
from itertools import pairwise
from typing import NamedTuple

from hmcs.bus.counters import Sequences
from hmcs.bus.messages import Message
from hmcs.recordings.plain import BY_SCHEMA
from hmcs.recordings.reading import RecordingContent


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
    for message in content.messages:
        if message.schema.partition("/")[0] != message_type.SCHEMA:
            continue
        fields = message.fields
        lost = sequences.note(message.key, fields["source"]["boot"], fields["seq"])
        if lost:
            found.append(Loss((message.log_ns - content.first_ns) / 1e9, lost))
    return tuple(found)


def inspected(content: RecordingContent) -> Inspection:
    """Return what there is in a recording, channel by channel, and what is missing."""
    times: dict[tuple[str, str], list[int]] = defaultdict(list)
    lost: dict[tuple[str, str], int] = defaultdict(int)
    sequences = Sequences()
    for message in content.messages:
        channel = (message.key, message.schema)
        times[channel].append(message.log_ns)
        fields = message.fields
        lost[channel] += sequences.note(message.key, fields["source"]["boot"], fields["seq"]) or 0
    channels = tuple(
        _summary(key, schema, own, lost[key, schema])
        for (key, schema), own in sorted(times.items())
    )
    return Inspection(content.duration_s, channels, tuple(_problems(content, channels)))


def _summary(key: str, schema: str, log_ns: list[int], lost: int) -> ChannelSummary:
    span_s = (log_ns[-1] - log_ns[0]) / 1e9
    gaps = [after - before for before, after in pairwise(log_ns)]
    return ChannelSummary(
        key,
        schema,
        len(log_ns),
        (len(log_ns) - 1) / span_s if span_s > 0 else 0.0,
        lost,
        max(gaps, default=0) / 1e9,
    )


def _problems(content: RecordingContent, channels: tuple[ChannelSummary, ...]) -> list[str]:
    problems = []
    if not content.whole:
        why = f" ({content.damage})" if content.damage else ""
        problems.append(
            f"it was cut off{why}: what came in the last moments before its end is missing"
        )
    problems += [
        f"{channel.lost} messages are missing on {channel.key}"
        for channel in channels
        if channel.lost
    ]
    schemas = {channel.schema for channel in channels}
    version = content.metadata.get("hmcs", {}).get("version", "unknown")
    problems += [
        f"{schema} cannot be read: it is of another version of the contract; replay and train with "
        f"version {version} of hmcs, which recorded it"
        for schema in sorted(schemas - BY_SCHEMA.keys())
    ]
    if "step" not in {schema.partition("/")[0] for schema in schemas}:
        problems.append("there are no steps: the hand did not move, nothing can be replayed")
    if not content.attachments:
        problems.append("no model is kept with it: replay needs one by --model")
    return problems
