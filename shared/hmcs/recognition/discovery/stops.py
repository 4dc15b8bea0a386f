"""Where the hand stops on its way: who stops between two motions says that they are two."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.recognition.discovery.consensus import Consensus

_SLACK_STEPS = 3
"""Aligned by its shape alone, a performance passes a point of the path so many steps too early or
too late."""
_SAMPLES = 3.0
"""The pace of the hand is looked at over so many samples, lest the length of single ones counts."""


class Stop(NamedTuple):
    """A place at which several performances slow down almost to a halt."""

    point: int
    """Index of the path's point."""
    at: tuple[float, ...]
    """For each performance the step in which it is slowest there, with fractions."""
    support: float
    """Share of the performances that stop there."""


def dwells(time_s: Array, at_sample: Array) -> Array:
    """Return how long each step lasts as a multiple of the median step, shape (T − 1,).

    `time_s` are the times of the samples, shape (S,), `at_sample` where between them the points of
    the performance in equal steps lie, shape (T,). With few samples to a step it is that of several
    steps about it.
    """
    points = len(at_sample)
    width = min(max(_SAMPLES * points / len(time_s), 1.0), points - 1.0)
    begin = np.clip(np.arange(points - 1) + 0.5 - width / 2, 0, points - 1 - width)

    def time(point: Array) -> Array:
        sample = np.interp(point, np.arange(points), at_sample)
        return np.asarray(np.interp(sample, np.arange(len(time_s)), time_s))

    lasts = time(begin + width) - time(begin)
    return np.asarray(lasts / np.median(lasts))


def stops(
    mean: Consensus, dwell: Sequence[Array], *, ratio: float, support: float, margin_steps: int
) -> list[Stop]:
    """Return the stops on a path of which at least a share `support` of the performances knows.

    A performance stops where a step takes `ratio` times as long as its median step; where all
    stop, on geometric average, too. No slowness counts that reaches to within `margin_steps` of
    either end, where every motion begins and ends at rest.
    `dwell` is that of each performance, see `dwells`.
    """
    slowest = np.array([_slowest(own, at) for own, at in zip(dwell, mean.at, strict=True)])
    share = (slowest >= ratio).mean(axis=0)
    halts = (np.exp(np.log(slowest).mean(axis=0)) >= ratio) & (share >= support)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], halts.astype(int), [0]])))
    margin = margin_steps + _SLACK_STEPS
    found = []
    for begin, end in edges.reshape(-1, 2):
        if begin < margin or end > len(halts) - margin:
            continue
        own = []
        for steps, at in zip(dwell, mean.at, strict=True):
            lower = max(int(at[begin]) - _SLACK_STEPS, 0)
            upper = min(int(at[end - 1]) + _SLACK_STEPS + 1, len(steps))
            own.append(lower + int(steps[lower:upper].argmax()) + 0.5)
        found.append(Stop(int(begin + end - 1) // 2, tuple(own), float(share[begin:end].max())))
    return found


def _slowest(dwell: Array, at: Array) -> Array:
    """The longest step near each point of the path, shape (N,)."""
    near = np.rint(at).astype(int)[:, None] + np.arange(-_SLACK_STEPS, _SLACK_STEPS)
    return np.asarray(dwell[np.clip(near, 0, len(dwell) - 1)].max(axis=1))
