"""Chains: demonstrations performed one after another by one hand that never jumps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration, DemonstrationError


def chained(name: str, demonstrations: Sequence[Demonstration], start: np.ndarray) -> Demonstration:
    """Return one demonstration of all in turn, the first beginning at `start`, m, shape (3,).

    Each is moved to where the one before it ended; the sample they share carries the later one's
    label, so a label begins exactly where its own demonstration does. Orientations and wrenches
    are those that were recorded.
    Raises ValueError when there is nothing to chain, and DemonstrationError when some have
    orientations or wrenches and others have not.
    """
    if not demonstrations:
        raise ValueError("no demonstrations to chain")
    last = len(demonstrations) - 1
    times, positions = [], []
    states: list[str | None] = []
    here, now_s = np.asarray(start, dtype=float), 0.0
    for k, demonstration in enumerate(demonstrations):
        stop = None if k == last else -1
        moved = here + demonstration.positions - demonstration.positions[0]
        timed = now_s + demonstration.time_s - demonstration.time_s[0]
        times.append(timed[:stop])
        positions.append(moved[:stop])
        states.extend(demonstration.states[:stop])
        here, now_s = moved[-1], float(timed[-1])
    return Demonstration(
        name,
        np.concatenate(times),
        np.concatenate(positions),
        tuple(states),
        _in_turn("orientations", demonstrations),
        _in_turn("wrenches", demonstrations),
    )


def closed(demonstration: Demonstration) -> Demonstration:
    """Return the demonstration bent so that it ends where it began, to be performed over and over.

    What was missing is spread evenly over the length of the path, so no part of it is bent more
    than another. Raises ValueError for a demonstration that never moves.
    """
    positions = demonstration.positions
    moved = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(positions, axis=0), axis=1))])
    if not moved[-1] > 0:
        raise ValueError(f"demonstration {demonstration.name!r} never moves")
    missing = positions[0] - positions[-1]
    return demonstration._replace(positions=positions + np.outer(moved / moved[-1], missing))


def _in_turn(sense: str, demonstrations: Sequence[Demonstration]) -> Array | None:
    recorded: list[Array | None] = [getattr(each, sense) for each in demonstrations]
    there = [samples for samples in recorded if samples is not None]
    if not there:
        return None
    if len(there) < len(recorded):
        lacking = demonstrations[[samples is None for samples in recorded].index(True)]
        raise DemonstrationError(
            f"{lacking.name}: has no {sense}, but others in the chain have: record them in all, or "
            "leave their columns out of all"
        )
    return np.asarray(np.concatenate([*(samples[:-1] for samples in there[:-1]), there[-1]]))
