"""The timeline of a recording: which part of the task each moment was, set after the fact."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil
from typing import Protocol

import numpy as np
import viser
from numpy.typing import NDArray
from viser import uplot

from hmcs.shown import Markdown
from hmcs_console.seeing.history import limits, with_room
from hmcs_console.seeing.shelf import Shelved
from hmcs_console.seeing.takes import CHOSEN, Take, band_color, bands, lines, played_at, states_of
from hmcs_console.serving.buttons import (
    ADD,
    DELETE,
    EDIT,
    GO,
    HIDE,
    PLAIN,
    REFRESH,
    REMOVE,
    SAVE,
    TAG,
    on_change,
    on_click,
)
from hmcs_console.serving.writing import Choice, add_words, fill, name_button, name_of_curve, write
from hmcs_console.shapes.palette import FASTER, css
from hmcs_console.shapes.pieces import add_pieces, draw_pieces
from hmcs_console.teaching.parts import Parts

_HEIGHT_PX = 210
_SLIDER_STEPS = 1000
_TRANSPARENT = "66"
_PATH_M, _CHOSEN_M, _HAND_M = 0.004, 0.012, 0.015


class Editing(Protocol):
    """Who shows recordings and sets their labels; called on the page's threads."""

    def open(self, name: str) -> None:
        """Show a recording, the newest where `name` is empty."""

    def refresh(self) -> None:
        """Tell anew what recordings there are."""

    def hide(self) -> None:
        """Show none."""

    def choose(self, begin_s: float, end_s: float) -> None:
        """Choose a stretch to be labeled."""

    def label(self, state: str) -> None:
        """Label the chosen stretch."""

    def remove(self) -> None:
        """Take labels away from the chosen stretch."""

    def save(self) -> None:
        """Have the labels written down."""

    def play(self) -> None:
        """Show in the scene how the hand moved."""

    def rename(self, name: str) -> None:
        """Call the recording something else."""

    def delete(self) -> None:
        """Delete the recording, with what is beside it."""

    def note(self, text: str) -> None:
        """Write down a note about the recording."""

    def segment(self, model: str, model_hash: str) -> None:
        """Find the parts of the recording by a model."""


class Timeline:
    """The controls, in the container that is open now; drawn on one thread."""

    def __init__(
        self, gui: viser.GuiApi, editing: Editing, use_for_training: Callable[[str], None]
    ) -> None:
        self._gui = gui
        self._editing = editing
        self._drawn: tuple[Take, tuple[str, ...], tuple[Shelved, ...]] = (Take(), (), ())
        self._series: tuple[str, ...] = ()
        self._plot: viser.GuiUplotHandle | None = None
        self._slider: viser.GuiMultiSliderHandle[float] | None = None
        self._choice = Choice(gui, "Recording")
        self._choice.on_choice(editing.open)
        on_click(
            gui.add_button("Refresh", color=PLAIN, icon=REFRESH, hint="Look what there is now"),
            editing.refresh,
        )
        self._shown = gui.add_folder("Labels", visible=False)
        with self._shown:
            self._parts = Parts(gui, editing)
            self._chosen = add_words(gui, order=6.0)
            self._state = Choice(gui, "State", order=10.0)
            label = gui.add_button(
                "Label", order=11.0, icon=TAG, hint="The chosen stretch is this state"
            )
            on_click(label, self._label)
            remove = gui.add_button(
                "Remove",
                order=12.0,
                color=PLAIN,
                icon=REMOVE,
                hint="The chosen stretch is no state",
            )
            on_click(remove, editing.remove)
            save = gui.add_button(
                "Save", order=13.0, icon=SAVE, hint="Beside the recording, as .labels.csv"
            )
            on_click(save, editing.save)
            use = gui.add_button("Use for training", order=14.0, color=PLAIN, icon=ADD)
            on_click(use, lambda: use_for_training(self._drawn[0].path))
            play = gui.add_button("Play", order=14.5, color=PLAIN, icon=GO)
            on_click(play, editing.play)
            on_click(gui.add_button("Hide", order=15.0, color=PLAIN, icon=HIDE), editing.hide)
        self._files = gui.add_folder("File", visible=False, expand_by_default=False)
        with self._files:
            self._note = gui.add_text("Note", "", order=20.0)
            keep = gui.add_button("Save note", order=21.0, color=PLAIN, icon=SAVE)
            on_click(keep, lambda: editing.note(self._note.value))
            name = gui.add_text("New name", "", order=22.0)
            rename = gui.add_button("Rename", order=23.0, color=PLAIN, icon=EDIT)
            on_click(rename, lambda: editing.rename(name.value))
            self._delete = gui.add_button("Delete", order=24.0, color="red", icon=DELETE)
            on_click(self._delete, self._ask_to_delete)
        self._to_delete = ""
        self._said = add_words(gui)

    def _ask_to_delete(self) -> None:
        """Delete at the second press, after the button has named what would be gone."""
        name = self._drawn[0].name
        if name and self._to_delete == name:
            self._to_delete = ""
            self._editing.delete()
        else:
            self._to_delete = name
        self._name_delete()

    def _name_delete(self) -> None:
        asked = f"Delete {self._to_delete} for ever" if self._to_delete else "Delete"
        name_button(self._delete, asked)

    def draw(self, take: Take, states: tuple[str, ...], models: tuple[Shelved, ...] = ()) -> None:
        """Draw what is shown of a recording, with the states of the task and the models known."""
        before, states_before, models_before = self._drawn
        if take is before and (states, models) == (states_before, models_before):
            return
        self._drawn = take, states, models
        write(self._said, take.said)
        self._choice.offer(take.recordings, none_too=not take.name)
        self._choice.choose(take.name)
        self._shown.visible = self._files.visible = bool(take.name)
        if take.name != before.name:
            self._to_delete = ""
            self._name_delete()
        if (take.name, take.note) != (before.name, before.note):
            fill(self._note, take.note)
        if not take.name:
            return
        self._parts.draw(take, states, models)
        named = states_of(take, states)
        self._state.offer(named, none_too=False)
        if self._slider is None or (take.name, take.duration_s) != (before.name, before.duration_s):
            self._make_slider(take)
        if take.chosen_s != before.chosen_s:
            write(self._chosen, Markdown("Chosen: {:.2f} s to {:.2f} s").format(*take.chosen_s))
        self._draw_bands(take, named)

    def _label(self) -> None:
        if self._state.chosen:
            self._editing.label(self._state.chosen)

    def _choose(self, chosen: Sequence[float]) -> None:
        # A page may say anything.
        if len(chosen) == 2 and np.all(np.isfinite(chosen)):
            lasts_s = self._drawn[0].duration_s
            self._editing.choose(*(min(edge, lasts_s) for edge in sorted(chosen)))

    def _make_slider(self, take: Take) -> None:
        """Its ends cannot be moved while it is there, where pages hold it."""
        if self._slider is not None:
            self._slider.remove()
        with self._shown:
            self._slider = self._gui.add_multi_slider(
                "From, to (s)",
                min=0.0,
                max=_end_s(take),
                step=_end_s(take) / _SLIDER_STEPS,
                initial_value=take.chosen_s,
                order=5.0,
            )
        on_change(self._slider, self._choose)

    def _draw_bands(self, take: Take, named: tuple[str, ...]) -> None:
        data = bands(take, named)
        scales: dict[str, uplot.Scale] = {
            "x": uplot.Scale(time=False, auto=False, range=(0.0, max(take.duration_s, 1e-3))),
            "y": uplot.Scale(auto=False, range=with_room(limits(data[1:]))),
        }
        if self._plot is not None and named == self._series:
            self._plot.scales = scales
            self._plot.data = data
            return
        self._series = named
        if self._plot is not None:
            self._plot.remove()
        series: tuple[uplot.Series, ...] = (
            uplot.Series(label="s"),
            uplot.Series(label="speed", stroke=css(FASTER), width=1.5),
            uplot.Series(label="chosen", width=0, fill=css(CHOSEN) + _TRANSPARENT),
            *(
                uplot.Series(
                    label=name_of_curve(state),
                    width=0,
                    fill=css(band_color(state, named)) + _TRANSPARENT,
                )
                for state in named
            ),
        )
        with self._shown:
            self._plot = self._gui.add_uplot(
                data,
                series,
                scales=scales,
                title="speed, m/s, over time, s",
                height=_HEIGHT_PX,
                order=1.0,
            )


def _end_s(take: Take) -> float:
    """The end of the slider, in round hundredths of a second: a few digits that can be read."""
    return max(ceil(take.duration_s * 100), 1) / 100


class TakePath:
    """The way of the hand in a recording, in the scene; drawn on one thread."""

    def __init__(self, scene: viser.SceneApi, origin: NDArray[np.float64]) -> None:
        """It is laid to begin at `origin`, m, base frame, shape (3,)."""
        self._origin = origin
        self._path = add_pieces(scene, "/recording/path", _PATH_M)
        self._chosen = add_pieces(scene, "/recording/chosen", _CHOSEN_M)
        self._hand = scene.add_icosphere(
            "/recording/hand", radius=_HAND_M, color=CHOSEN, visible=False
        )
        self._drawn: tuple[Take, tuple[str, ...]] = (Take(), ())

    def draw(self, take: Take, states: tuple[str, ...], now_s: float) -> None:
        """Draw what is shown of a recording, colored by its labels; what is chosen is thicker.

        While it is played a ball moves as the hand did, by the monotonic clock.
        """
        place = played_at(take, self._origin, now_s)
        if self._hand.visible != (place is not None):
            self._hand.visible = place is not None
        if place is not None:
            self._hand.position = place
        before, states_before = self._drawn
        if take is before and states == states_before:
            return
        self._drawn = take, states
        whole, chosen = lines(take, states_of(take, states), self._origin)
        draw_pieces(self._path, whole)
        draw_pieces(self._chosen, chosen)
