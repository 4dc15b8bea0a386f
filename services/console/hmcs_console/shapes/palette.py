"""Colors, red, green and blue from 0 to 255."""

from __future__ import annotations

from collections.abc import Sequence

from hmcs.palette import UNKNOWN_COLOR, rgb, state_color

Color = tuple[int, int, int]

UNKNOWN: Color = rgb(UNKNOWN_COLOR)
WORKSPACE: Color = (120, 140, 160)
OBSTACLE: Color = (176, 164, 148)
FORBIDDEN: Color = (224, 79, 79)
DIRECTION: Color = (35, 139, 69)
FORCE: Color = (230, 85, 13)
FASTER: Color = (31, 119, 180)
SLOWER: Color = (214, 39, 40)


def color_of(state: str, states: Sequence[str]) -> Color:
    """Return the color of a task state by its place among all; gray where it is none of them."""
    return rgb(state_color(states.index(state))) if state in states else UNKNOWN


def faint(color: Color) -> Color:
    """Return a color as it is where it shall not draw the eye."""
    red, green, blue = ((2 * value + 3 * 225) // 5 for value in color)
    return red, green, blue


def css(color: Color) -> str:
    """Return a color as a page writes it."""
    return "#{:02x}{:02x}{:02x}".format(*color)
