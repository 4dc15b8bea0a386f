"""Structured logs: one line an event, for people on a terminal, as JSON for everything else.

Facts about an event go in `extra`: `log.info("router lost", extra={"endpoint": endpoint})`.
"""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable
from typing import Any, TextIO

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
            "event": record.getMessage(),
            **_facts(record),
        }
        if record.exc_info:
            event["traceback"] = self.formatException(record.exc_info)
        return json.dumps(event, default=str, ensure_ascii=False)


class Readable(logging.Formatter):
    """One line for people; a traceback follows where there is one."""

    def __init__(self, process: str) -> None:
        super().__init__()
        self._process = process

    def format(self, record: logging.LogRecord) -> str:
        """Return the line of one event."""
        clock = time.strftime("%H:%M:%S", time.localtime(record.created))
        facts = "".join(f"  {name}={value}" for name, value in _facts(record).items())
        line = (
            f"{clock}.{int(record.msecs):03d} {record.levelname.lower():7} "
            f"{self._process}  {record.getMessage()}{facts}"
        )
        return line + ("\n" + self.formatException(record.exc_info) if record.exc_info else "")


class Seldom:
    """Logs an event of one kind at once, then at most once a period, with how many it left out."""

    def __init__(
        self,
        log: logging.Logger,
        period_s: float = 5.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._log = log
        self._period_s = period_s
        self._clock = clock
        self._last_s: dict[str, float] = {}
        self._left_out: dict[str, int] = {}

    def warning(self, kind: str, event: str, *, exc_info: bool = False, **facts: object) -> None:
        """Log `event` unless one of its kind was logged less than a period ago."""
        now_s = self._clock()
        if now_s - self._last_s.get(kind, -float("inf")) < self._period_s:
            self._left_out[kind] = self._left_out.get(kind, 0) + 1
            return
        self._last_s[kind] = now_s
        if left_out := self._left_out.pop(kind, 0):
            facts["left_out"] = left_out
        self._log.warning(event, extra=facts, exc_info=exc_info)


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


def _utc(seconds: float) -> str:
    return (
        time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(seconds)) + f".{seconds % 1:.6f}"[2:] + "Z"
    )
