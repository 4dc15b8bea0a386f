"""A service's log line, JSON in its file, as people read it."""

from __future__ import annotations

import json

_HEAD = ("time", "level", "process", "event", "traceback")


def readable(line: str) -> str:
    """Return a JSON log line as `level event  fact=value …`; any other line as it is."""
    try:
        event = json.loads(line)
    except ValueError:
        return line
    if not isinstance(event, dict) or "event" not in event:
        return line
    facts = "".join(f"  {name}={value}" for name, value in event.items() if name not in _HEAD)
    traceback = f"\n{event['traceback']}" if event.get("traceback") else ""
    return f"{event.get('level', ''):7} {event['event']}{facts}{traceback}"
