"""Colors, red, green and blue from 0 to 255."""

from __future__ import annotations

from collections.abc import Sequence

Color = tuple[int, int, int]

UNKNOWN: Color = (150, 150, 150)
"""Of motion that is no part of the task, and of none that is recognized."""
WORKSPACE: Color = (120, 140, 160)
OBSTACLE: Color = (176, 164, 148)
FORBIDDEN: Color = (224, 79, 79)
DIRECTION: Color = (35, 139, 69)
FORCE: Color = (230, 85, 13)
FASTER: Color = (31, 119, 180)
SLOWER: Color = (214, 39, 40)
# Okabe and Ito (2008): distinct for every kind of color vision.
_STATES: tuple[Color, ...] = (
    (0, 114, 178),
    (230, 159, 0),
    (0, 158, 115),
    (204, 121, 167),
    (86, 180, 233),
    (213, 94, 0),
    (160, 150, 20),
    (102, 51, 153),
)


def color_of(state: str, states: Sequence[str]) -> Color:
    """Return the color of a task state by its place among all; gray where it is none of them."""
    return _STATES[states.index(state) % len(_STATES)] if state in states else UNKNOWN


def faint(color: Color) -> Color:
    """Return a color as it is where it shall not draw the eye."""
    red, green, blue = ((2 * value + 3 * 225) // 5 for value in color)
    return red, green, blue


def css(color: Color) -> str:
    """Return a color as a page writes it."""
    return "#{:02x}{:02x}{:02x}".format(*color)
