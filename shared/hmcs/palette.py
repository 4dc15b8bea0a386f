"""The colors of states and of what else is drawn: one set for the page, reports and figures."""

from __future__ import annotations

STATE_COLORS = (
    "#0072B2",
    "#E69F00",
    "#009E73",
    "#CC3311",
    "#AA4499",
    "#56B4E9",
    "#7A6A00",
    "#663399",
)
"""By a state's place in its task; distinct for every kind of color vision, after Okabe and Ito
(2008)."""
UNKNOWN_COLOR = "#8C8C8C"
"""Of motion that is no part of the task, and of none that is recognized."""
INK = "#222222"
FAINT = "#888888"
GRID_COLOR = "#E6E6E6"


def state_color(index: int) -> str:
    """Return the color of a state by its number from 0; beyond the last one they begin again."""
    return STATE_COLORS[index % len(STATE_COLORS)]


def rgb(color: str) -> tuple[int, int, int]:
    """Return red, green and blue, 0 to 255, of a color written `#rrggbb`."""
    red, green, blue = bytes.fromhex(color.removeprefix("#"))
    return red, green, blue
