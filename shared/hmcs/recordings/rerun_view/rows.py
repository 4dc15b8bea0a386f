"""Values over time, sent to Rerun in columns: a call for each value takes a hundred times as long.

Described at https://rerun.io/docs/howto/logging-and-ingestion/send-columns.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import Any

import numpy as np

TIMELINE = "time"
"""When the recorder got it."""
MOST_ROWS = 4096
"""Held of each entity before they are sent."""
MOST_ENTITIES = 4096
"""A recording of somebody's may name models, states and robots without end."""


class Rows:
    """Collects rows by entity and archetype, and sends them many at a time."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self._rows: dict[tuple[str, type[Any]], list[tuple[int, dict[str, Any]]]] = defaultdict(
            list
        )

    def add(self, entity: str, archetype: type[Any], log_ns: int, **values: Any) -> None:
        """Add what an entity has from then on; always the same values for it.

        Of entities beyond MOST_ENTITIES nothing is shown.
        """
        key = (entity, archetype)
        if key not in self._rows and len(self._rows) >= MOST_ENTITIES:
            return
        rows = self._rows[key]
        rows.append((log_ns, values))
        if len(rows) >= MOST_ROWS:
            self._send(key, rows)

    def finish(self) -> None:
        """Send what is left."""
        for key, rows in self._rows.items():
            if rows:
                self._send(key, rows)

    def _send(self, key: tuple[str, type[Any]], rows: list[tuple[int, dict[str, Any]]]) -> None:
        import rerun as rr

        entity, archetype = key
        times = np.array([log_ns for log_ns, _ in rows], dtype="datetime64[ns]")
        columns = {name: [values[name] for _, values in rows] for name in rows[0][1]}
        self._stream.send_columns(
            entity, [rr.TimeColumn(TIMELINE, timestamp=times)], archetype.columns(**columns)
        )
        rows.clear()


def entity(*parts: str) -> str:
    """Return the path of an entity; its parts may have any characters."""
    import rerun as rr

    return str(rr.new_entity_path(list(parts)))


def listed(vector: Any) -> Sequence[float]:
    """Return an array as Rerun takes a row of a column."""
    return [float(value) for value in vector]
