"""Structured logs: one line an event, for people on a terminal, as JSON for everything else.

Facts about an event go in `extra`: `log.info("router lost", extra={"endpoint": endpoint})`. They
may come from other processes: no control character of theirs stands in a line.
"""

from __future__ import annotations

import json
import logging
import re
import time
from collections import OrderedDict
from collections.abc import Callable
from typing import Any, TextIO

from hmcs.shown import plain

MOST_KINDS = 32
"""Kinds of events that one log follows; there are more only where what is logged makes them up."""
_LONGEST_KIND, _LONGEST_FACT = 200, 2000
"""Characters."""
_US_PER_S = 1_000_000
_STANDARD = set(vars(logging.makeLogRecord({}))) | {"message", "asctime", "taskName"}


class JsonLines(logging.Formatter):
    """One JSON object a line: `time` (UTC), `level`, `process`, `event`, the event's facts."""

    def __init__(self, process: str) -> None:
        super().__init__()
        self._process = process

    def format(self, record: logging.LogRecord) -> str:
        """Return the line of one event."""
        event: dict[str, Any] = {
            "time": _utc(record.created),
            "level": record.levelname.lower(),
            "process": self._process,
            "event": _cut(record.getMessage()),
            **{name: _cut(value) for name, value in _facts(record).items()},
        }
        if record.exc_info:
            event["traceback"] = self.formatException(record.exc_info)
        line = json.dumps(event, default=str, ensure_ascii=False)
        return line if line.isprintable() else "".join(map(_in_json, line))


class Readable(logging.Formatter):
    """One line for people; a traceback follows, indented, where there is one."""

    def __init__(self, process: str) -> None:
        super().__init__()
        self._process = process

    def format(self, record: logging.LogRecord) -> str:
        """Return the line of one event."""
        clock = time.strftime("%H:%M:%S", time.localtime(record.created))
        facts = "".join(
            f"  {plain(name)}={plain(str(value), _LONGEST_FACT)}"
            for name, value in _facts(record).items()
        )
        event = plain(record.getMessage(), _LONGEST_FACT)
        lines = [
            f"{clock}.{int(record.msecs):03d} {record.levelname.lower():7} "
            f"{self._process}  {event}{facts}"
        ]
        if record.exc_info:
            lines += [
                f"  {_indent(line)}{plain(line.strip(), _LONGEST_FACT)}"
                for line in self.formatException(record.exc_info).split("\n")
            ]
        return "\n".join(lines)


class RateLimitedLog:
    """Logs an event of one kind at once, then at most once a period, with how many it left out.

    What follows a colon and a blank tells of one event and is no kind: `BadStepError: step 7 …` is
    one with `BadStepError: step 8 …`. Nor are numbers, except in keys of the bus.
    """

    def __init__(
        self,
        log: logging.Logger,
        period_s: float = 5.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._log = log
        self._period_s = period_s
        self._clock = clock
        self._last_s: OrderedDict[str, float] = OrderedDict()
        """When each kind was logged last, the one that was logged longest ago first."""
        self._left_out: dict[str, int] = {}
        """Events of a kind that were left out since then."""
        self._others_left_out = 0
        """Events of kinds that are not followed."""

    def warning(self, kind: str, event: str, *, exc_info: bool = False, **facts: object) -> None:
        """Log `event` unless one of its kind was logged less than a period ago.

        Of more than `MOST_KINDS` kinds the oldest is forgotten; where even that was logged less
        than a period ago the event is left out. A later event says how many of such were left out.
        """
        now_s, kind = self._clock(), _kind_in(kind)
        if now_s - self._last_s.get(kind, -float("inf")) < self._period_s:
            self._left_out[kind] = self._left_out.get(kind, 0) + 1
            return
        if kind not in self._last_s and not self._has_place(now_s):
            self._others_left_out += 1
            return
        self._last_s[kind] = now_s
        self._last_s.move_to_end(kind)
        if left_out := self._left_out.pop(kind, 0):
            facts["left_out"] = left_out
        if self._others_left_out:
            facts["others_left_out"], self._others_left_out = self._others_left_out, 0
        self._log.warning(event, extra=facts, exc_info=exc_info)

    def _has_place(self, now_s: float) -> bool:
        """Whether a new kind can be followed; the oldest gives way where it may."""
        if len(self._last_s) < MOST_KINDS:
            return True
        oldest = next(iter(self._last_s))
        if now_s - self._last_s[oldest] < self._period_s:
            return False
        del self._last_s[oldest]
        self._others_left_out += self._left_out.pop(oldest, 0)
        return True


def open_log(process: str, level: str, stream: TextIO) -> logging.Logger:
    """Return the log of a process, e.g. `task_hmm/a1b2`, written to `stream`."""
    handler = logging.StreamHandler(stream)
    handler.setFormatter(Readable(process) if stream.isatty() else JsonLines(process))
    log = logging.getLogger(f"hmcs.{process}")
    log.propagate = False
    log.handlers[:] = [handler]
    log.setLevel(level.upper())
    return log


def _facts(record: logging.LogRecord) -> dict[str, Any]:
    return {name: value for name, value in vars(record).items() if name not in _STANDARD}


def _kind_in(reason: str) -> str:
    kind = reason[:_LONGEST_KIND].partition(": ")[0]
    return kind if "/" in kind else re.sub(r"\d+", "#", kind)


def _cut(value: Any) -> Any:
    return (
        value[:_LONGEST_FACT] + "…"
        if isinstance(value, str) and len(value) > _LONGEST_FACT
        else value
    )


def _in_json(character: str) -> str:
    return character if character.isprintable() else json.dumps(character)[1:-1]


def _indent(line: str) -> str:
    return " " * (len(line) - len(line.lstrip(" ")))


def _utc(seconds: float) -> str:
    whole_s, us = divmod(round(seconds * _US_PER_S), _US_PER_S)
    return time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(whole_s)) + f".{us:06d}Z"
