"""A service's log line, JSON in its file, as people read it."""

from __future__ import annotations

import json

from hmcs.shown import plain

LONGEST = 4000
"""Characters of a line that are shown."""
_HEAD = ("time", "level", "process", "event", "traceback")


def readable(line: str) -> str:
    """Return a JSON log line as `level event  fact=value …`; any other line as it is.

    Control characters are shown as their escapes: what a line quotes may come from anywhere.
    """
    try:
        event = json.loads(line)
    except (ValueError, RecursionError):
        return plain(line, LONGEST)
    if not isinstance(event, dict) or "event" not in event:
        return plain(line, LONGEST)
    facts = "".join(f"  {name}={value}" for name, value in event.items() if name not in _HEAD)
    lines = [plain(f"{event.get('level', '')!s:7} {event['event']}{facts}", LONGEST)]
    if traceback := event.get("traceback"):
        lines += [
            line[: len(line) - len(line.lstrip(" "))] + plain(line.lstrip(" "), LONGEST)
            for line in str(traceback).split("\n")
        ]
    return "\n".join(lines)
