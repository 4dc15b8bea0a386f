"""Variants: one gesteme demonstrated in ways so different that a mean of them is none of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array

_POINTS = 20


class VariantSettings(NamedTuple):
    """When demonstrations of one gesteme are different motions."""

    apart: float = 4.0
    """Demonstrations are of one variant only where no two of them are farther apart than so many
    times the median distance between demonstrations of a gesteme, over all gestemes."""


def split_into_variants(
    motions: Sequence[Sequence[Array]],
    settings: VariantSettings = VariantSettings(),  # noqa: B008
) -> list[list[list[int]]]:
    """Return for each gesteme the groups of its demonstrations, as indices.

    `motions[g]` are the positions of gesteme g's demonstrations from their origins, m, shape
    (T + 1, D). Complete-linkage clustering: a gesteme with one demonstration has one variant, and
    so has every gesteme where none has two.
    """
    apart = [_distances(own) for own in motions]
    pairs = [far[np.triu_indices(len(far), 1)] for far in apart if len(far) > 1]
    limit = settings.apart * float(np.median(np.concatenate(pairs))) if pairs else np.inf
    return [_grouped(far, limit) for far in apart]


def _grouped(far: Array, limit: float) -> list[list[int]]:
    groups = [[k] for k in range(len(far))]
    while len(groups) > 1:
        least, a, b = min(
            (float(far[np.ix_(groups[a], groups[b])].max()), a, b)
            for b in range(len(groups))
            for a in range(b)
        )
        if least > limit:
            break
        groups[a] += groups.pop(b)
    return [sorted(group) for group in groups]


def _distances(motions: Sequence[Array]) -> Array:
    """RMS distance between demonstrations at equal shares of their steps, m, shape (n, n)."""
    points = np.stack([_resampled(motion) for motion in motions])
    difference = points[:, None] - points[None]
    return np.asarray(np.sqrt((difference**2).sum(axis=3).mean(axis=2)))


def _resampled(motion: Array) -> Array:
    given, wanted = np.linspace(0, 1, len(motion)), np.linspace(0, 1, _POINTS)
    return np.stack([np.interp(wanted, given, column) for column in motion.T], axis=1)
