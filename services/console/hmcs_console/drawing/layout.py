"""Where the guides of all states lie: laid end to end, as the task will most likely be performed.

Only the guide that leads now has a place that somebody knows. Each of the others begins where the
one it most likely follows ends, until its own state becomes active and tells.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs_console.order import Order

Point = NDArray[np.float64]


class Layout(NamedTuple):
    """Where guides lie now."""

    places: Mapping[str, Point]
    """Where each state's guide begins, m, base frame, shape (3,)."""
    visited: frozenset[str] = frozenset()
    """States that were active: where their guides lay then is known."""


def laid_out(order: Order, ways: Mapping[str, Point], start: Point) -> Layout:
    """Return the layout before anything was done: the first guide begins at `start`, m, (3,).

    `ways` leads from the beginning of each state's guide to its end, m, shape (3,). A state without
    one, or that is never reached, has no place.
    """
    return Layout(_laid_on(order, ways, {}, order.first, start, kept=frozenset()))


def anchored(
    layout: Layout, order: Order, ways: Mapping[str, Point], state: str, origin: Point
) -> Layout:
    """Return the layout once a state is active, its guide beginning at `origin`, m, (3,).

    Guides that follow it and whose place nobody knew are laid on from its end anew.
    """
    visited = layout.visited | {state}
    places = _laid_on(order, ways, layout.places, state, origin, kept=visited)
    return Layout(places, visited)


def _laid_on(
    order: Order,
    ways: Mapping[str, Point],
    places: Mapping[str, Point],
    state: str,
    origin: Point,
    kept: frozenset[str],
) -> dict[str, Point]:
    """Lay a state's guide at `origin`, and on from it, breadth first, all that are not kept."""
    if state not in ways:
        return dict(places)
    laid = {state: origin}
    coming = [state]
    while coming:
        after = _followers(order, coming, ways.keys() - laid.keys() - kept)
        laid |= {later: laid[before] + ways[before] for later, before in after.items()}
        coming = list(after)
    return {**places, **laid}


def _followers(order: Order, coming: list[str], wanted: set[str]) -> dict[str, str]:
    """For each wanted state that follows one of some, the one it most likely follows."""
    likely: dict[str, tuple[float, str]] = {}
    for before in coming:
        for later, probability in order.follow.get(before, {}).items():
            if later in wanted and probability > likely.get(later, (0.0, ""))[0]:
                likely[later] = probability, before
    return {later: before for later, (_, before) in likely.items()}
