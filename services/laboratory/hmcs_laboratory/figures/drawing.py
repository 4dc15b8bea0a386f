"""The look that all figures share: a color a method, a color and a mark a state."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Picture
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from hmcs.palette import FAINT as FAINT
from hmcs.palette import GRID_COLOR, STATE_COLORS, state_color
from hmcs.palette import INK as INK
from hmcs.palette import UNKNOWN_COLOR as UNKNOWN_COLOR

COLORS = STATE_COLORS
MARKS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "p", "h")
METHOD_COLORS = {
    "od-hmm": COLORS[0],
    "md-hmm": COLORS[1],
    "fft-hmm": COLORS[2],
    "hmcs-gestemes": COLORS[3],
}
METHOD_MARKS = {"od-hmm": "o", "md-hmm": "s", "fft-hmm": "^", "hmcs-gestemes": "D"}
CHANGE_COLOR = WRONG_COLOR = COLORS[3]
WIDTH_IN = 10.0
"""Of every figure."""

_STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 10.0,
    "axes.titlesize": 11.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelcolor": INK,
    "axes.edgecolor": FAINT,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID_COLOR,
    "grid.linewidth": 0.6,
    "xtick.color": INK,
    "ytick.color": INK,
    "legend.frameon": False,
    "savefig.dpi": 130,
    "savefig.facecolor": "white",
    # The same figure is the same file, byte for byte.
    "svg.hashsalt": "hmcs",
    "svg.fonttype": "path",
}

Number = float | int | str | bool | None | Sequence[float | int | str | None]


class Drawn(NamedTuple):
    """A figure as it came out."""

    picture: Picture
    numbers: Mapping[str, Number]
    """What was measured of the very data drawn; plain JSON."""
    found: str
    """The same in a sentence or two."""
    differs: str
    """Where it differs from what the thesis shows, and why."""


class Files(NamedTuple):
    """A picture as the bytes of its files."""

    png: bytes
    svg: bytes


@contextmanager
def house_style() -> Iterator[None]:
    """Have figures made within look like all others."""
    with mpl.rc_context(_STYLE):
        yield


def new_picture(height_in: float, width_in: float = WIDTH_IN) -> Picture:
    """Return an empty picture."""
    picture = Picture(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(picture)
    return picture


def files_of(picture: Picture) -> Files:
    """Return the picture as PNG and SVG; the same picture gives the same bytes."""
    png, svg = io.BytesIO(), io.BytesIO()
    with house_style():
        picture.savefig(png, format="png", metadata={"Software": None})
        picture.savefig(svg, format="svg", metadata={"Date": None, "Creator": None})
    return Files(png.getvalue(), svg.getvalue())


def color_of(index: int) -> str:
    """Return the color of a state or gesteme, by its number from 0."""
    return state_color(index)


def mark_of(index: int) -> str:
    """Return the mark of a state, by its number from 0."""
    return MARKS[index % len(MARKS)]


def draw_changes(ax: Axes, steps: Sequence[int]) -> None:
    """Draw a dashed vertical line before each of the steps at which something truly changed."""
    for step in steps:
        ax.axvline(step - 0.5, color=INK, linewidth=0.9, linestyle=(0, (4, 3)), zorder=1)


def change_handle(label: str = "true change") -> Line2D:
    """Return what stands in a legend for the lines of `draw_changes`."""
    return Line2D([], [], color=INK, linewidth=0.9, linestyle=(0, (4, 3)), label=label)


def draw_path(ax: Axes, positions: ArrayLike, **style: Any) -> None:
    """Draw positions of shape (T, 2) or (T, 3), m, on axes of as many dimensions."""
    ax.plot(*np.asarray(positions).T, **style)


def label_space(ax: Axes, dimensions: int, unit: str = "m") -> None:
    """Name the axes of space, and give them one scale."""
    pad = 4.0 if dimensions == 2 else 12.0
    ax.set_xlabel(f"x, {unit}", labelpad=pad)
    ax.set_ylabel(f"y, {unit}", labelpad=pad)
    if dimensions == 2:
        ax.set_aspect("equal", adjustable="datalim")
    else:
        # Only axes in space have a third one.
        space: Any = ax
        space.set_zlabel(f"z, {unit}", labelpad=pad)
        sides = np.ptp([space.get_xlim(), space.get_ylim(), space.get_zlim()], axis=1)
        # The layout leaves no room for the labels of axes in space: smaller, and off the margin.
        space.set_box_aspect(sides, zoom=0.8)
        space.get_figure(root=True).get_layout_engine().set(rect=(0.0, 0.0, 0.96, 1.0))
        for axis in (space.xaxis, space.yaxis, space.zaxis):
            axis.pane.set_facecolor("white")
            axis.pane.set_edgecolor(GRID_COLOR)
            axis.set_major_locator(MaxNLocator(4))


def listed(names: Sequence[str]) -> str:
    """Return names as text: a, b and c."""
    *front, last = names
    return f"{', '.join(front)} and {last}" if front else last


def counted(count: int, what: str) -> str:
    """Return a number of things, in the plural unless it is one."""
    return f"{count} {what}" if count == 1 else f"{count} {what}s"
