"""What the observer saw on the bus, as arrays; kept beside the report as `recording.npz`.

Every row carries the index of the operator sample it goes back to (its `seq`) and that sample's
capture time. The observer runs on the machine of the input device, so its own receive times and
the capture times are readings of one clock and may be subtracted.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array

IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
TextArray = NDArray[np.str_]

NO_SAMPLE = -1
"""Stands for the sample of a message that goes back to none."""


class Motions(NamedTuple):
    """Samples of the operator's device, n of them."""

    sample: IntArray
    captured_ns: IntArray
    received_ns: IntArray
    position: Array
    """m, operator frame, shape (n, 3)."""
    dead_man: BoolArray


class Steps(NamedTuple):
    """Steps, n of them."""

    sample: IntArray
    """The one that completed the step."""
    captured_ns: IntArray
    received_ns: IntArray
    number: IntArray
    """t."""
    position: Array
    """x_t, m, shape (n, 3)."""
    displacement: Array
    """x_{t+1} − x_t, m, shape (n, 3)."""


class Beliefs(NamedTuple):
    """Beliefs, n of them."""

    received_ns: IntArray
    step: IntArray
    """t."""
    probabilities: Array
    """Of each state, shape (n, S)."""
    unknown: Array
    missing_gestemes: IntArray
    """How many gestemes no evidence came for."""


class Commands(NamedTuple):
    """Commands, n of them."""

    sample: IntArray
    captured_ns: IntArray
    received_ns: IntArray
    engaged: BoolArray


class Fixtures(NamedTuple):
    """States of the fixture, n of them."""

    sample: IntArray
    captured_ns: IntArray
    received_ns: IntArray
    factor: Array
    """k."""
    engaged: BoolArray
    reason: TextArray


class RobotStates(NamedTuple):
    """States of the robot, n of them."""

    sample: IntArray
    """The one whose command the robot follows."""
    captured_ns: IntArray
    received_ns: IntArray
    tool_position: Array
    """m, base frame, shape (n, 3)."""
    tool_velocity: Array
    """m/s, shape (n, 3)."""
    reference_velocity: Array
    """m/s, shape (n, 3)."""
    in_contact: BoolArray
    stop: TextArray
    limited: TextArray
    """Limits that shape the motion, with commas between them."""


class Members(NamedTuple):
    """Recognizer processes as they came, replayed and ready, and went; n of them."""

    received_ns: IntArray
    instance: TextArray
    alive: BoolArray


class Recording(NamedTuple):
    """One run as it was seen on the bus."""

    states: TextArray
    """Names of the task states in the order of the beliefs' columns, shape (S,)."""
    motions: Motions
    steps: Steps
    beliefs: Beliefs
    commands: Commands
    fixtures: Fixtures
    robot: RobotStates
    members: Members


TABLES: dict[str, type[Any]] = {
    "motions": Motions,
    "steps": Steps,
    "beliefs": Beliefs,
    "commands": Commands,
    "fixtures": Fixtures,
    "robot": RobotStates,
    "members": Members,
}

T = TypeVar("T")


def table(kind: type[T], rows: Sequence[tuple[Any, ...]]) -> T:
    """Return rows as the columns of a table of this kind."""
    names: tuple[str, ...] = kind._fields  # type: ignore[attr-defined]
    columns = zip(*rows, strict=True) if rows else ([] for _ in names)
    return kind(*(np.array(column) for column in columns))


def save_recording(path: Path, recording: Recording) -> None:
    """Write a recording; its arrays are named `TABLE.COLUMN`."""
    arrays: dict[str, Any] = {"states": recording.states}
    for name in TABLES:
        arrays |= {f"{name}.{c}": a for c, a in getattr(recording, name)._asdict().items()}
    np.savez_compressed(path, allow_pickle=False, **arrays)


def load_recording(path: Path) -> Recording:
    """Read a recording; raises OSError, KeyError or ValueError where there is none."""
    with np.load(path, allow_pickle=False) as arrays:
        tables = {
            name: kind(*(arrays[f"{name}.{column}"] for column in kind._fields))
            for name, kind in TABLES.items()
        }
        return Recording(states=arrays["states"], **tables)
