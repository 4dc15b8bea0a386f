"""What is near what among MuJoCo's geometries: few of many pairs are asked exactly."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np

from hmcs.arrays import Array

_NO_WAY_M = 1e-9
"""Points nearer than this have no direction from one to the other."""


class Closest(NamedTuple):
    """Where two geometries are closest; points have shape (3,)."""

    one: int
    other: int
    distance_m: float
    """Negative in penetration."""
    on_one: Array
    """m, base frame."""
    on_other: Array
    normal: Array
    """Unit vector from the other to the one."""


class OwnPairs:
    """Pairs of geometries of an arm, of links that may meet."""

    def __init__(self, model: mujoco.MjModel, pairs: list[tuple[int, int]]) -> None:
        self._model = model
        self._ones, self._others = np.array(pairs, dtype=int).reshape(-1, 2).T
        self._reach_m = model.geom_rbound[self._ones] + model.geom_rbound[self._others]
        self._links = model.geom_bodyid

    def near(self, data: mujoco.MjData, within_m: float) -> dict[tuple[int, int], Closest]:
        """Return where links are so near to each other: the closest geometries of each two."""
        away = data.geom_xpos[self._ones] - data.geom_xpos[self._others]
        bound = np.sqrt(np.vecdot(away, away)) - self._reach_m
        nearest: dict[tuple[int, int], Closest] = {}
        for pair in np.flatnonzero(bound <= within_m).tolist():
            one, other = int(self._ones[pair]), int(self._others[pair])
            found = closest(self._model, data, one, other, within_m)
            links = int(self._links[one]), int(self._links[other])
            if found and (links not in nearest or found.distance_m < nearest[links].distance_m):
                nearest[links] = found
        return nearest


class Pairs:
    """Geometries of an arm, and others that it may come near to."""

    def __init__(self, model: mujoco.MjModel, ours: list[int], theirs: list[int]) -> None:
        self._model = model
        self._ours, self._theirs = np.array(ours, dtype=int), np.array(theirs, dtype=int)
        self._reach_m = model.geom_rbound[self._ours]
        boxes = model.geom_aabb[self._theirs].reshape(-1, 2, 3)
        self._middles, self._halves = boxes[:, 0], boxes[:, 1]

    def near(self, data: mujoco.MjData, within_m: float) -> Iterator[Closest]:
        """Yield the pairs that are so near to each other."""
        turns = data.geom_xmat[self._theirs].reshape(-1, 3, 3)
        # In the frame of each other geometry, whose box bounds it: shape (theirs, ours, 3).
        away = data.geom_xpos[self._ours] - data.geom_xpos[self._theirs][:, None]
        local = away @ turns - self._middles[:, None]
        outside = np.maximum(np.abs(local) - self._halves[:, None], 0.0)
        bound = np.sqrt(np.vecdot(outside, outside)) - self._reach_m
        for other, one in np.argwhere(bound <= within_m).tolist():
            found = closest(
                self._model, data, int(self._ours[one]), int(self._theirs[other]), within_m
            )
            if found is not None:
                yield found


def closest(
    model: mujoco.MjModel, data: mujoco.MjData, one: int, other: int, within_m: float
) -> Closest | None:
    """Return where two geometries are closest; None where they are farther than that."""
    ends = np.zeros((6, 1))
    distance_m = mujoco.mj_geomDistance(model, data, one, other, within_m, ends)
    if distance_m >= within_m:
        return None
    on_one, on_other = ends[:3, 0], ends[3:, 0]
    way = on_one - on_other if distance_m > 0 else on_other - on_one
    length_m = float(np.linalg.norm(way))
    if length_m < _NO_WAY_M:
        way = data.geom_xpos[one] - data.geom_xpos[other]
        length_m = float(np.linalg.norm(way)) or 1.0
    return Closest(one, other, distance_m, on_one, on_other, way / length_m)
