"""Joints that mimic those of an arm, as an engine that moves each joint by itself has them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hmcs.arms.chain import Chain
from hmcs.arrays import Array

CAUGHT_UP_PER_S = 20.0
"""Rate at which a joint that follows another is drawn to where it belongs."""


def followed_by(chain: Chain, names: Sequence[str]) -> tuple[Array, Array]:
    """Return how the joints `names`, m of them, follow the n of an arm, themselves among them.

    A matrix per joint, (m, n), and what is added, rad or m, (m,): the position of each joint is
    matrix @ positions + added. The names are those of the arm's joints and of its followers.
    """
    per_joint, offsets = np.zeros((len(names), len(chain.joint_names))), np.zeros(len(names))
    for row, name in enumerate(names):
        if name in chain.followers:
            leader, per_joint_of_it, offsets[row] = chain.followers[name]
            per_joint[row, leader] = per_joint_of_it
        else:
            per_joint[row, chain.joint_names.index(name)] = 1.0
    return per_joint, offsets
