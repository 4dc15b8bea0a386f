"""How a handle leads: in a plane or free in space, at its own size or scaled. Pure geometry."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Axes = tuple[bool, bool, bool]

SPACE = "space"
KEPT_TO: Mapping[str, Axes] = {
    SPACE: (True, True, True),
    "plane x y": (True, True, False),
    "plane x z": (True, False, True),
    "plane y z": (False, True, True),
}
"""What a handle may be kept to, by what it is called on the page, and the axes it moves along."""
SMALLEST, LARGEST = 0.1, 2.0
"""Scales there are."""
FARTHEST_M = 100.0
"""A handle farther from the base than this is none a hand has moved there."""


class Rule(NamedTuple):
    """How a page has its handle lead."""

    axes: Axes = (True, True, True)
    """Of the base frame, that it moves along."""
    scale: float = 1.0
    """Motion of the robot for one of the handle."""


class Grip(NamedTuple):
    """A handle as it was taken hold of."""

    position: NDArray[np.float64]
    """Of the handle, m, base frame, shape (3,)."""
    rule: Rule = Rule()
    """As it was then: the arrows that are being dragged are those it shows."""


FREE = Rule()


def rule_of(kept_to: str, scale: float) -> Rule:
    """Return the rule a page has chosen; what no page offers is as near to it as there is."""
    finite_scale = scale if np.isfinite(scale) else 1.0
    return Rule(
        KEPT_TO.get(kept_to, KEPT_TO[SPACE]), float(min(max(finite_scale, SMALLEST), LARGEST))
    )


def led_to(grip: Grip, handle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where a handle at a position, m, base frame, shape (3,), leads to, the same shape."""
    moved = np.where(grip.rule.axes, handle - grip.position, 0.0)
    return np.asarray(grip.position + grip.rule.scale * moved)


def position_of(value: Any) -> NDArray[np.float64] | None:
    """Return the position a page sends, m, base frame, shape (3,); None where that is none."""
    try:
        position = np.array(value, dtype=float)
    except (TypeError, ValueError):
        return None
    if position.shape != (3,) or not np.all(np.abs(position) <= FARTHEST_M):
        return None
    return position
