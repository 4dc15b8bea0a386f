"""Mean paths of motions, as nodes a mean step apart, and where they lead.

Shapes as in `closed_loop`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hmcs.arrays import Array
from hmcs_laboratory.single_gestemes.closed_loop import Paths, unit
from hmcs_laboratory.single_gestemes.even_points import evenly, length_of, step_lengths


def smoothed_mean_path(performances: Sequence[Array], step: float, smoothing: float) -> Array:
    """Return the smoothed mean at equal shares of time, as nodes about a step apart, shape (n, D).

    Minimizes the squared distances to the performances and `smoothing` times the squared second
    differences, with the start held at 0 and the end counted twice more.
    """
    weight = float(len(performances))
    samples = max(4, round(float(np.mean([len(positions) for positions in performances]))))
    mean = np.mean([evenly(positions, samples) for positions in performances], axis=0)
    bend = np.diff(np.eye(samples), 2, axis=0)
    pull = np.full(samples, weight)
    pull[0] += 1e6 * weight
    pull[-1] += 2.0 * weight
    smooth = np.linalg.solve(np.diag(pull) + smoothing * bend.T @ bend, pull[:, None] * mean)
    smooth = smooth - smooth[0]
    travelled = np.concatenate([[0.0], np.cumsum(step_lengths(smooth))])
    nodes = max(4, round(travelled[-1] / step) + 1)
    wanted = np.linspace(0.0, travelled[-1], nodes)
    return np.stack([np.interp(wanted, travelled, column) for column in smooth.T], axis=1)


def padded(paths: Sequence[Array]) -> Paths:
    """Return paths of nodes, shape (n, D) each, together."""
    longest = max(len(path) for path in paths)
    nodes = [np.pad(path, ((0, longest - len(path)), (0, 0)), mode="edge") for path in paths]
    return Paths(np.stack(nodes), np.array([len(path) for path in paths]))


def ahead(paths: Paths, step: float, look_ahead_steps: float) -> Array:
    """Return a, shape (M, N, D); beyond its end a path goes on as it ended."""
    leading = np.zeros_like(paths.nodes)
    for motion, count in enumerate(paths.counts):
        nodes = paths.nodes[motion, :count]
        gap = length_of(nodes) / (count - 1)
        onward = unit(nodes[-1] - nodes[max(0, count - 3)]) * gap
        beyond = nodes[-1] + onward * np.arange(1, int(look_ahead_steps) + 2)[:, None]
        longer = np.concatenate([nodes, beyond])
        wanted = np.arange(count) + look_ahead_steps
        target = np.stack([np.interp(wanted, np.arange(len(longer)), c) for c in longer.T], axis=1)
        leading[motion, :count] = (target - nodes) / (look_ahead_steps * step)
    return leading


def normals(own: Sequence[Sequence[Array]]) -> Array:
    """Return the unit directions in which motions end, from performances of each, (M, D)."""
    ends = [[unit(p[-1] - p[max(len(p) - 3, 0)]) for p in motion] for motion in own]
    return unit(np.array([np.mean(motion, axis=0) for motion in ends]))
