"""A surface of triangles covered by few boxes: how the links of an arm see a mesh.

A physics engine that is asked for the distance of a link to a mesh answers for every triangle
within reach, of which a fine mesh has thousands. Boxes that cover all of them are as many as asked
for, however fine the mesh is. Halved where most of them is empty, they lie along the surface.
"""

from __future__ import annotations

import heapq
from itertools import count
from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.fixtures.regions.clusters import principal_boxes
from hmcs.fixtures.regions.surfaces import area_vectors

LEAST_HALF_M = 1e-4
"""Half as thick as any box at least: flat ones have no inside."""
_GROWN_M = 1e-3
"""A surface fills the room so near to it: what a box grown by as much has beyond that is empty."""


class CoveringBox(NamedTuple):
    """A box along the principal axes of some triangles, with all of them in it."""

    center: Array
    """m, shape (3,)."""
    axes: Array
    """As columns, a rotation, shape (3, 3)."""
    halves: Array
    """Half of its lengths along them, m, shape (3,)."""

    @classmethod
    def about(cls, corners: Array) -> CoveringBox:
        """Return the box about triangles, m, shape (T, 3, 3)."""
        (center,), (axes,), (halves,) = principal_boxes(corners.reshape(1, -1, 3))
        axes[:, 0] *= np.sign(np.linalg.det(axes))
        return cls(center, axes, halves)


def covering(corners: Array, most: int) -> tuple[CoveringBox, ...]:
    """Return at most so many boxes that cover all triangles, m, shape (T, 3, 3).

    The one with most empty room is halved across its longest axis until there are as many.
    """
    numbers = count()

    def entry(some: Array) -> tuple[float, int, Array, CoveringBox]:
        box = CoveringBox.about(some)
        filled_m3 = _GROWN_M * float(np.linalg.norm(area_vectors(some), axis=1).sum())
        empty_m3 = 8.0 * float(np.prod(box.halves + _GROWN_M)) - filled_m3
        return -empty_m3 if len(some) > 1 else 0.0, next(numbers), some, box

    heap = [entry(corners)]
    while len(heap) < most and heap[0][0] < 0.0:
        _, _, some, box = heapq.heappop(heap)
        along = some.mean(axis=1) @ box.axes[:, int(box.halves.argmax())]
        order = np.argsort(along, kind="stable")
        for half in np.array_split(order, 2):
            heapq.heappush(heap, entry(some[half]))
    return tuple(box._replace(halves=np.maximum(box.halves, LEAST_HALF_M)) for _, _, _, box in heap)
