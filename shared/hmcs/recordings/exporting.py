"""Recordings as tables: a CSV file, or a file of NumPy arrays, for every channel."""

from __future__ import annotations

import csv
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hmcs.recordings.reading import Recorded, RecordingContent
from hmcs.whole_files import written_whole

Format = Literal["csv", "npz"]
_ENVELOPE = ("schema",)


def export(content: RecordingContent, folder: Path, form: Format) -> list[Path]:
    """Write a file for every channel into `folder`; return which.

    Each row is a message: `time_s` since the first message, then its fields, arrays spread over
    columns `name_0`, `name_1`, …. Where an array's length changes, missing places are empty in CSV
    and NaN in NumPy files.
    """
    folder.mkdir(parents=True, exist_ok=True)
    channels: dict[str, list[Recorded]] = defaultdict(list)
    for message in content.messages:
        channels[message.key].append(message)
    first_ns = content.first_ns
    written = []
    for key, messages in sorted(channels.items()):
        rows = [
            {"time_s": (message.log_ns - first_ns) / 1e9, **dict(_flat(message.fields))}
            for message in messages
        ]
        columns = list(dict.fromkeys(name for row in rows for name in row))
        target = folder / f"{_file_name(key)}.{form}"
        with written_whole(target) as unfinished:
            if form == "csv":
                _write_csv(unfinished, columns, rows)
            else:
                _write_arrays(unfinished, columns, rows)
        written.append(target)
    return written


def _file_name(key: str) -> str:
    """The key without what all keys of a cell begin with."""
    return "_".join(key.split("/")[3:])


def _flat(fields: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in fields.items():
        if not prefix and name in _ENVELOPE:
            continue
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}_")
        elif isinstance(value, list):
            yield from ((f"{prefix}{name}_{k}", part) for k, part in enumerate(value))
        else:
            yield f"{prefix}{name}", value


def _write_csv(path: Path, columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, columns, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def _write_arrays(path: Path, columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> None:
    with path.open("wb") as stream:
        np.savez_compressed(stream, allow_pickle=False, **_arrays(columns, rows))


def _arrays(
    columns: Sequence[str], rows: Sequence[Mapping[str, Any]]
) -> dict[str, np.ndarray[Any, Any]]:
    arrays: dict[str, np.ndarray[Any, Any]] = {}
    for name in columns:
        values = [row.get(name) for row in rows]
        if any(isinstance(value, str) for value in values):
            arrays[name] = np.array(["" if value is None else str(value) for value in values])
        else:
            arrays[name] = np.array([np.nan if v is None else float(v) for v in values])
    return arrays
