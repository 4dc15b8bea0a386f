"""Demonstrations of a recording as a data set of LeRobot, version 2.1.

Each demonstration is an episode, sampled anew at whole frames a second. `observation.state` is
where the hand was, with its orientation and force where all have them, `action` where it is in the
next frame, `state` the label. Positions in m, forces in N.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.quaternions import continuous
from hmcs.recordings.foreign.columns import FORCE, PLACE, TURN
from hmcs.recordings.foreign.lerobot import FEATURES
from hmcs.recordings.foreign.lerobot_tables import INFO, STATE
from hmcs.recordings.foreign.libraries import missing
from hmcs.recordings.reading import RecordingError
from hmcs.whole_files import folder_written_whole

FPS = 30
"""Frames a second where nobody says how many."""
CHUNK = 1000
"""Episodes of a folder."""
_DATA = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet"
_COUNTERS = ("frame_index", "episode_index", "index", "task_index")


def write_data_set(
    shown: Sequence[Demonstration], folder: Path, task: str, *, fps: int = FPS
) -> int:
    """Write demonstrations as the folder of a data set; return how many frames it has.

    Raises FileExistsError where there is such a folder, OSError as writing does, RecordingError
    without a demonstration, and MissingLibraryError without `pyarrow`.
    """
    try:
        import pyarrow as arrow
        import pyarrow.parquet as parquet
    except ImportError as error:
        raise missing("lerobot", "data sets are written by pyarrow, which is not here") from error
    if not shown:
        raise RecordingError(f"{folder}: there is no demonstration to be written to it")
    names = _names(shown)
    lines = dict[str, list[Mapping[str, Any]]](episodes=[], episodes_stats=[])
    begin = 0
    with folder_written_whole(folder) as beside:
        root = beside / folder.name
        for number, demonstration in enumerate(shown):
            vectors, states = _frames(demonstration, len(names), fps)
            columns = _columns(vectors, number, begin, fps)
            file = root / _DATA.format(episode_chunk=number // CHUNK, episode_index=number)
            file.parent.mkdir(parents=True, exist_ok=True)
            table = {name: _arrow(arrow, values) for name, values in columns.items()}
            parquet.write_table(arrow.table({**table, STATE: arrow.array(states)}), file)
            count = len(vectors)
            begin += count
            lines["episodes"].append({"episode_index": number, "tasks": [task], "length": count})
            stats = {name: _stats(values) for name, values in columns.items()}
            lines["episodes_stats"].append({"episode_index": number, "stats": stats})
        (root / INFO).parent.mkdir()
        info = _info(names, len(shown), begin, fps)
        (root / INFO).write_text(json.dumps(info, indent=4), encoding="utf-8")
        _write_lines(root / "meta" / "tasks.jsonl", [{"task_index": 0, "task": task}])
        for name, rows in lines.items():
            _write_lines(root / "meta" / f"{name}.jsonl", rows)
    return begin


def _names(shown: Sequence[Demonstration]) -> tuple[str, ...]:
    turn = TURN if all(each.orientations is not None for each in shown) else ()
    force = FORCE if all(each.wrenches is not None for each in shown) else ()
    return (*PLACE, *turn, *force)


def _frames(shown: Demonstration, width: int, fps: int) -> tuple[Array, list[str]]:
    """The vectors of a demonstration at whole frames, shape (T, width), and their labels."""
    parts = [shown.positions]
    if width in (7, 13) and shown.orientations is not None:
        parts.append(continuous(shown.orientations))
    if width in (9, 13) and shown.wrenches is not None:
        parts.append(shown.wrenches)
    given = np.hstack(parts)
    since_s = shown.time_s - shown.time_s[0]
    at_s = np.arange(int(since_s[-1] * fps + 1e-6) + 1) / fps
    vectors = np.stack([np.interp(at_s, since_s, each) for each in given.T], axis=1)
    if width in (7, 13):
        turns = vectors[:, 3:7]
        vectors[:, 3:7] = turns / np.linalg.norm(turns, axis=1, keepdims=True)
    before = np.searchsorted(since_s, at_s + 1e-9, side="right") - 1
    return vectors, [shown.states[k] or "" for k in before.tolist()]


def _columns(vectors: Array, episode: int, begin: int, fps: int) -> dict[str, NDArray[Any]]:
    frames = np.arange(len(vectors))
    state, action = FEATURES
    counters = (frames, np.full_like(frames, episode), begin + frames, np.zeros_like(frames))
    return {
        state: vectors.astype(np.float32),
        action: np.vstack([vectors[1:], vectors[-1:]]).astype(np.float32),
        "timestamp": (frames / fps).astype(np.float32),
        **dict(zip(_COUNTERS, counters, strict=True)),
    }


def _arrow(arrow: Any, values: NDArray[Any]) -> Any:
    if values.ndim == 1:
        return arrow.array(values)
    return arrow.FixedSizeListArray.from_arrays(arrow.array(values.ravel()), values.shape[1])


def _stats(values: NDArray[Any]) -> dict[str, list[Any]]:
    rows = values.reshape(len(values), -1)
    measures = {"min": rows.min(0), "max": rows.max(0), "mean": rows.mean(0), "std": rows.std(0)}
    return {**{name: each.tolist() for name, each in measures.items()}, "count": [len(rows)]}


def _info(names: Sequence[str], episodes: int, frames: int, fps: int) -> dict[str, Any]:
    vector = {"dtype": "float32", "shape": [len(names)], "names": list(names)}
    one = {"shape": [1], "names": None}
    return {
        "codebase_version": "v2.1",
        "robot_type": None,
        "total_episodes": episodes,
        "total_frames": frames,
        "total_tasks": 1,
        "total_videos": 0,
        "total_chunks": (episodes - 1) // CHUNK + 1,
        "chunks_size": CHUNK,
        "fps": fps,
        "splits": {"train": f"0:{episodes}"},
        "data_path": _DATA,
        "video_path": None,
        "features": {
            **dict.fromkeys(FEATURES, vector),
            "timestamp": {"dtype": "float32", **one},
            **{name: {"dtype": "int64", **one} for name in _COUNTERS},
            STATE: {"dtype": "string", **one},
        },
    }


def _write_lines(file: Path, rows: Iterable[Mapping[str, Any]]) -> None:
    text = "".join(json.dumps(row) + "\n" for row in rows)
    file.write_text(text, encoding="utf-8")
