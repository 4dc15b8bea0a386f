"""Live plots of the last half minute."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import viser
from viser import uplot

from hmcs_console.seeing.history import SPAN_S, Rows, columns, limits, with_room
from hmcs_console.seeing.hops import FAST, SLOW, hop_names
from hmcs_console.serving.writing import name_of_curve
from hmcs_console.shapes.palette import (
    DIRECTION,
    FASTER,
    FORCE,
    SLOWER,
    UNKNOWN,
    Color,
    color_of,
    css,
)

_HEIGHT_PX = 170
_SHARE = (0.0, 1.0)


class Curve(NamedTuple):
    """One number over time."""

    column: str
    """Of the history."""
    label: str
    color: Color


class Plots:
    """The plots of the page, in the container that is open now."""

    def __init__(self, gui: viser.GuiApi, states: Sequence[str]) -> None:
        self._plots = [
            _Plot(gui, "probability of each state, last 30 s", _probabilities(states), _SHARE),
            _Plot(
                gui,
                "stiffness k, 0.5 free to 1, last 30 s",
                (Curve("factor", "k", DIRECTION),),
                _SHARE,
            ),
            _Plot(
                gui,
                "speed, m/s, last 30 s",
                (Curve("operator", "operator", FASTER), Curve("robot", "robot", SLOWER)),
            ),
            _Plot(
                gui,
                "distance, m, last 30 s",
                (Curve("guide", "to the guide", FASTER), Curve("obstacle", "obstacle", SLOWER)),
            ),
            _Plot(gui, "latency, ms, last 30 s", _latencies()),
        ]

    def draw(self, rows: Rows) -> None:
        """Draw what was written down."""
        for plot in self._plots:
            plot.draw(rows)

    def remove(self) -> None:
        """Take them off the page."""
        for plot in self._plots:
            plot.remove()


class _Plot:
    def __init__(
        self,
        gui: viser.GuiApi,
        title: str,
        curves: Sequence[Curve],
        fixed: tuple[float, float] | None = None,
    ) -> None:
        self._columns = tuple(curve.column for curve in curves)
        series: tuple[uplot.Series, ...] = (
            uplot.Series(label="s"),
            *(
                uplot.Series(label=name_of_curve(curve.label), stroke=css(curve.color), width=2)
                for curve in curves
            ),
        )
        self._fixed = fixed
        self._limits = fixed or (0.0, 1.0)
        self._handle = gui.add_uplot(
            columns((), self._columns),
            series,
            title=title,
            scales=_scales(self._limits),
            height=_HEIGHT_PX,
        )

    def draw(self, rows: Rows) -> None:
        data = columns(rows, self._columns)
        wanted = self._fixed or limits(data[1:])
        if wanted != self._limits:
            self._limits = wanted
            self._handle.scales = _scales(wanted)
        self._handle.data = data

    def remove(self) -> None:
        self._handle.remove()


def _scales(limits: tuple[float, float]) -> dict[str, uplot.Scale]:
    return {
        "x": uplot.Scale(time=False, auto=False, range=(-SPAN_S, 0.0)),
        "y": uplot.Scale(auto=False, range=with_room(limits)),
    }


def _probabilities(states: Sequence[str]) -> tuple[Curve, ...]:
    of_states = (Curve(f"P {state}", state, color_of(state, states)) for state in states)
    return (*of_states, Curve("P unknown", "unknown", UNKNOWN))


def _latencies() -> tuple[Curve, ...]:
    hops = (*hop_names(FAST), *hop_names(SLOW))
    return tuple(
        Curve(hop, hop, color) for hop, color in zip(hops, (FASTER, SLOWER, FORCE), strict=True)
    )
