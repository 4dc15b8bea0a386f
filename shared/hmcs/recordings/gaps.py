"""What is missing in a recording, with the times of what was recorded around it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

MOST_GAPS = 100
"""Noted one by one; in a file with more the rest is noted as one."""


class Gap(NamedTuple):
    """Something that is missing."""

    begin_ns: int | None
    """Log time of the last message before it; None where there is none."""
    end_ns: int | None
    """Of the first one after it."""
    why: str


class Gaps:
    """Gaps as they are met while a file is read from its beginning to its end."""

    def __init__(self) -> None:
        self._gaps: list[Gap] = []
        self._unended = 0
        """The first of those that no message was read after."""
        self._last_ns: int | None = None

    def __iter__(self) -> Iterator[Gap]:
        return iter(self._gaps)

    def __len__(self) -> int:
        return len(self._gaps)

    def read(self, log_ns: int) -> None:
        """Note that a message was read."""
        self._last_ns = log_ns
        for number in range(self._unended, len(self._gaps)):
            if self._gaps[number].end_ns is None:
                self._gaps[number] = self._gaps[number]._replace(end_ns=log_ns)
        self._unended = len(self._gaps)

    def miss(self, why: str, begin_ns: int | None = None, end_ns: int | None = None) -> None:
        """Note that something is missing, from `begin_ns` to `end_ns` where that is known.

        Where it is not it is between the messages that are read before and after.
        """
        begin_ns = self._last_ns if begin_ns is None else begin_ns
        last = self._gaps[-1] if self._gaps else None
        goes_on = last is not None and last.why == why and self._unended < len(self._gaps)
        if last is not None and (goes_on or len(self._gaps) == MOST_GAPS):
            self._gaps[-1] = last._replace(end_ns=end_ns)
            self._unended = min(self._unended, len(self._gaps) - 1)
        else:
            self._gaps.append(Gap(begin_ns, end_ns, why))
