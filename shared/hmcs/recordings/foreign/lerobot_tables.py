"""Tables of a data set of LeRobot: the frames of each episode, in Parquet."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.recordings.demonstrations import MOST_SAMPLES
from hmcs.recordings.foreign.libraries import missing
from hmcs.recordings.reading import RecordingError

INFO = Path("meta") / "info.json"
"""What describes a data set, in its folder."""
MOST_FILES = 10_000
LARGEST_TABLE_BYTES = 2 * 1024**3
"""Of the columns that are read of one file, unpacked."""
STATE = "state"
"""A feature with the task state of each frame, as `hmcs export` writes it."""
_BATCH_ROWS = 65_536


class Feature(NamedTuple):
    """A row of numbers that each frame has."""

    name: str
    names: tuple[str, ...]
    """Of its numbers."""


class Frames(NamedTuple):
    """The frames of one episode."""

    episode: int
    time_s: list[float]
    values: list[Array]
    states: list[str | None]


def episodes_of(folder: Path, feature: Feature, *, labeled: bool) -> Iterator[Frames]:
    """Yield the frames of each episode, in the order in which they stand in the files.

    `labeled` where the tables have a column STATE. Raises RecordingError for a table that cannot be
    read, lacks a column or has too much, and for a row that is none.
    """
    current: Frames | None = None
    seen = set[int]()
    rows = enumerate(_rows(folder, feature, labeled))
    for count, (episode, at_s, values, state) in rows:
        if count >= MOST_SAMPLES:
            raise RecordingError(f"{folder}: more than {MOST_SAMPLES} frames: take a part of it")
        if current is None or episode != current.episode:
            if current is not None:
                yield current
            if episode in seen:
                raise RecordingError(f"{folder}: frames of episode {episode} stand apart")
            seen.add(episode)
            current = Frames(episode, [], [], [])
        current.time_s.append(at_s)
        current.values.append(values)
        current.states.append(state)
    if current is not None:
        yield current


def _rows(
    folder: Path, feature: Feature, labeled: bool
) -> Iterator[tuple[int, float, Array, str | None]]:
    try:
        import pyarrow as arrow
        import pyarrow.parquet as parquet
    except ImportError as error:
        raise missing("lerobot", f"{folder}: is read by pyarrow, which is not here") from error
    files = sorted((folder / "data").glob("chunk-*/*.parquet"))[: MOST_FILES + 1]
    if len(files) > MOST_FILES:
        raise RecordingError(f"{folder}: more than {MOST_FILES} files under data/")
    wanted = ["episode_index", "timestamp", feature.name, *([STATE] if labeled else [])]
    for file in files:
        try:
            with parquet.ParquetFile(file) as table:
                _check_table(file, table, wanted)
                for batch in table.iter_batches(_BATCH_ROWS, columns=wanted, use_threads=False):
                    yield from _of_batch(file, batch, feature, labeled)
        except (arrow.ArrowException, OSError, MemoryError) as error:
            raise RecordingError(
                f"{file}: cannot be read ({str(error)[:200] or type(error).__name__}): was it "
                "copied whole? Fetch it again"
            ) from error


def _check_table(file: Path, table: Any, wanted: Sequence[str]) -> None:
    absent = [name for name in wanted if name not in table.schema_arrow.names]
    if absent:
        raise RecordingError(
            f"{file}: has no column {absent[0]!r}; it has "
            f"{', '.join(table.schema_arrow.names[:40])}"
        )
    if table.metadata.num_rows > MOST_SAMPLES:
        raise RecordingError(f"{file}: more than {MOST_SAMPLES} frames")
    groups = (table.metadata.row_group(k) for k in range(table.metadata.num_row_groups))
    size = 0
    for group in groups:
        for k in range(group.num_columns):
            column = group.column(k)
            if column.path_in_schema.startswith(tuple(wanted)):
                size += column.total_uncompressed_size
    if size > LARGEST_TABLE_BYTES:
        raise RecordingError(f"{file}: its numbers unpack to {size / 1e9:.1f} GB")


def _of_batch(
    file: Path, batch: Any, feature: Feature, labeled: bool
) -> Iterator[tuple[int, float, Array, str | None]]:
    episodes = batch.column("episode_index").to_pylist()
    times = batch.column("timestamp").to_pylist()
    vectors = batch.column(feature.name).to_pylist()
    states = batch.column(STATE).to_pylist() if labeled else [None] * len(episodes)
    width = len(feature.names)
    for row, (episode, at_s, vector, state) in enumerate(
        zip(episodes, times, vectors, states, strict=True)
    ):
        at_s, episode = _one(at_s), _one(episode)
        if not isinstance(vector, list) or len(vector) != width or None in vector:
            raise RecordingError(
                f"{file}: row {row}: {feature.name} has not the {width} numbers that {INFO} says"
            )
        if not isinstance(episode, int) or at_s is None or not math.isfinite(at_s):
            raise RecordingError(f"{file}: row {row}: has no episode or no finite timestamp")
        label = str(_one(state) or "")
        if not label.isprintable():
            raise RecordingError(f"{file}: row {row}: its {STATE} is no name: {label[:40]!r}")
        yield episode, float(at_s), np.array(vector, dtype=float), label or None


def _one(value: Any) -> Any:
    """A number that some versions keep as a list of one."""
    return value[0] if isinstance(value, list) and len(value) == 1 else value
