"""Whether a geometry of MuJoCo is near a surface of triangles, which MuJoCo has no shape for."""

from __future__ import annotations

import mujoco
import numpy as np

from hmcs.arrays import Array
from hmcs_robot.covering import CoveringBox

PROBE = "probe"
"""A box of the model that collides with nothing and is put where something is to be measured."""
_SMALL_M = 5e-4
"""A box no longer than twice this is as good as the triangle in it."""
_THIN_M = 1e-5
"""Half as thick as any box at least: flat ones have no inside."""


class Probe:
    """Triangles, m, base frame, shape (T, 3, 3), before the arm moves: they are asked one by one.

    A triangle is near a geometry where a small part of it is: boxes about its halves, and theirs,
    are measured until all are clear or a small one is near.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, corners: Array) -> None:
        self._model, self._data, self._corners = model, data, corners
        self._box = int(model.geom(PROBE).id)
        self._middles = corners.mean(axis=1)
        self._reaches = np.linalg.norm(corners - self._middles[:, None], axis=2).max(axis=1)

    def touches(self, geom: int, within_m: float) -> bool:
        """Return whether a triangle is so near to a geometry."""
        away = np.linalg.norm(self._middles - self._data.geom_xpos[geom], axis=1) - self._reaches
        around = self._corners[away <= self._model.geom_rbound[geom] + within_m]
        return any(self._is_near(geom, triangle, within_m) for triangle in around)

    def _is_near(self, geom: int, triangle: Array, within_m: float) -> bool:
        box = CoveringBox.about(triangle[None])
        if self._distance_m(geom, box, within_m) >= within_m:
            return False
        if float(box.halves.max()) <= _SMALL_M:
            return True
        longest = int(np.linalg.norm(triangle - np.roll(triangle, -1, axis=0), axis=1).argmax())
        one, other, opposite = np.roll(triangle, -longest, axis=0)
        middle = 0.5 * (one + other)
        halves = (np.array([one, middle, opposite]), np.array([middle, other, opposite]))
        return any(self._is_near(geom, half, within_m) for half in halves)

    def _distance_m(self, geom: int, box: CoveringBox, within_m: float) -> float:
        halves = np.maximum(box.halves, _THIN_M)
        self._model.geom_size[self._box] = halves
        self._model.geom_rbound[self._box] = np.linalg.norm(halves)
        self._data.geom_xpos[self._box] = box.center
        self._data.geom_xmat[self._box] = box.axes.reshape(-1)
        found: float = mujoco.mj_geomDistance(
            self._model, self._data, geom, self._box, within_m, None
        )
        return found
