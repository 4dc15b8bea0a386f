"""What a recording tells of itself: channels, rates, gaps, who was there, what is missing."""

from __future__ import annotations

from collections import defaultdict
from itertools import pairwise
from typing import NamedTuple

from hmcs.bus.counters import Sequences
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
    schemas = {channel.schema.partition("/")[0] for channel in channels}
    if "step" not in schemas:
        problems.append("there are no steps: the hand did not move, nothing can be replayed")
    if not content.attachments:
        problems.append("no model is kept with it: replay needs one by --model")
    return problems
