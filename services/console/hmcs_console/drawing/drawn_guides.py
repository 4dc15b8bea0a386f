"""The guides of all states in the scene: each faintly where it lies, the one that leads in full."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray

from hmcs.fixtures.compliance.factor import FREE_FACTOR
from hmcs.recognition.model import Model
from hmcs_console.drawing.layout import Layout, anchored, laid_out
from hmcs_console.drawing.nodes import node
from hmcs_console.order import Order, order_of
from hmcs_console.seeing.models import gesteme_of, guide_of
from hmcs_console.seeing.seen import Picture
from hmcs_console.shapes.geometry import line
from hmcs_console.shapes.palette import color_of, faint

_FREE_M, _STIFF_M, _FAINT_M = 0.004, 0.016, 0.003
"""How thick a guide is where the fixture is free, where it is as stiff as can be, and where the
guide does not lead."""
_THICKER_M = 5e-4
"""A change of thickness that is drawn."""
_NEAR_M = 1e-4
"""A guide that lies no farther from where it lay has not moved."""


class Leading(NamedTuple):
    """The guide that leads now."""

    state: str
    gesteme: str
    origin: NDArray[np.float64]
    """Where it begins, m, base frame, shape (3,)."""


class DrawnGuides:
    """Draws the guides of the model that is followed; called on one thread."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._lead = scene.add_frame("/guide", show_axes=False, visible=False)
        self._path: viser.LineSegmentsHandle | None = None
        """Of the guide that leads, as thick as the fixture is stiff."""
        self._frame = scene.add_frame("/guides", show_axes=False)
        self._begin(None)

    def draw(self, picture: Picture, model: Model | None) -> None:
        """Draw them as they lie at a moment."""
        if model is not self._model:
            self._begin(model)
        leading = _leading_in(picture)
        if leading is not None and model is not None:
            self._anchor(model, leading)
        for state, handle in self._lines.items():
            leads = leading is not None and state == leading.state
            handle.visible = state in self._layout.places and not leads
        self._draw_leading(model, leading, picture)

    def _begin(self, model: Model | None) -> None:
        self._model = model
        self._led = ("", "")
        self._anchored: Leading | None = None
        self._ways: dict[str, NDArray[np.float64]] = {}
        self._order, self._layout = Order("", {}), Layout({})
        self._lines: dict[str, viser.LineSegmentsHandle] = {}
        self._drawn: dict[str, str] = {}
        # Taking the frame away takes what lies in it along.
        self._frame.remove()
        self._frame = self._scene.add_frame("/guides", show_axes=False)
        if model is None:
            return
        self._order = order_of(model.task)
        for state in model.state_names:
            self._add_line(model, state, gesteme_of(model, state))
        start = np.array(model.task.robot.tool_start_m)
        self._lay(laid_out(self._order, self._ways, start))

    def _add_line(self, model: Model, state: str, gesteme: str) -> None:
        guide = guide_of(model, state, gesteme)
        if guide is not None:
            self._drawn[state] = gesteme
            self._ways[state] = guide.points[-1]
            self._lines[state] = self._scene.add_line_segments(
                node("guides", state),
                line(guide.points),
                faint(color_of(state, model.state_names)),
                thickness=_FAINT_M,
                visible=False,
            )

    def _anchor(self, model: Model, leading: Leading) -> None:
        before = self._anchored
        if before is not None and before[:2] == leading[:2]:
            if float(np.abs(before.origin - leading.origin).max()) < _NEAR_M:
                return
        elif self._drawn.get(leading.state) != leading.gesteme:
            # A state may be performed with another of its gestemes than the first.
            self._add_line(model, leading.state, leading.gesteme)
        self._anchored = leading
        self._lay(anchored(self._layout, self._order, self._ways, leading.state, leading.origin))

    def _lay(self, layout: Layout) -> None:
        self._layout = layout
        for state, handle in self._lines.items():
            if state in layout.places:
                handle.position = layout.places[state]

    def _draw_leading(self, model: Model | None, leading: Leading | None, picture: Picture) -> None:
        self._lead.visible = leading is not None and model is not None
        if leading is None or model is None:
            return
        if leading[:2] != self._led:
            self._led = leading[:2]
            self._make_leading(model, leading, picture.states)
        self._lead.position = leading.origin
        if self._path is not None and picture.fixture is not None:
            thickness_m = thickness_of(picture.fixture.factor)
            if abs(self._path.thickness - thickness_m) >= _THICKER_M:
                self._path.thickness = thickness_m

    def _make_leading(self, model: Model, leading: Leading, states: tuple[str, ...]) -> None:
        self._path = None
        self._lead.remove()
        self._lead = self._scene.add_frame("/guide", show_axes=False)
        guide = guide_of(model, leading.state, leading.gesteme)
        if guide is None:
            return
        color = color_of(leading.state, states)
        self._path = self._scene.add_line_segments(
            "/guide/path", line(guide.points), color, thickness=_FREE_M
        )
        if guide.volume is not None:
            self._scene.add_mesh_simple(
                "/guide/volume", *guide.volume, color=color, opacity=0.2, side="double"
            )


def thickness_of(factor: float) -> float:
    """Return how thick the guide that leads is drawn, m, for a fixturing factor."""
    stiff = max(factor - FREE_FACTOR, 0.0) / (1.0 - FREE_FACTOR)
    return _FREE_M + (_STIFF_M - _FREE_M) * stiff


def _leading_in(picture: Picture) -> Leading | None:
    fixture = picture.fixture
    if fixture is None or fixture.guide_origin is None or not fixture.gesteme:
        return None
    return Leading(fixture.state, fixture.gesteme, fixture.guide_origin)
