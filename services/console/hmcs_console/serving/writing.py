"""Texts put down on the page, each by the function of its kind of place.

No other module hands a text to the page, so none comes onto it that was not made fit to be shown.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import viser

from hmcs.shown import Markdown, as_markdown, plain
from hmcs_console.serving.buttons import on_change

NOTHING = "(none)"
"""What a list says while nothing is in it, or nothing of it is chosen."""
MOST_CHOICES = 200
_LONGEST_NAME = 80
_LONGEST_NOTICE = 200


def write(place: viser.GuiMarkdownHandle, text: str) -> None:
    """Put a text down where another one stands: Markdown as it is, any other text as it reads.

    Markdown is laid out anew whenever it is set.
    """
    shown = text if isinstance(text, Markdown) else as_markdown(text)
    if place.content != shown:
        place.content = shown


def add_words(
    gui: viser.GuiApi, text: str = "", order: float | None = None
) -> viser.GuiMarkdownHandle:
    """Return a place for texts on the page, in the container that is open now."""
    place = gui.add_markdown("", order=order)
    write(place, text)
    return place


def add_drawing(gui: viser.GuiApi, order: float | None = None) -> viser.GuiHtmlHandle:
    """Return a place for a drawing, in the container that is open now; nothing is in it."""
    return gui.add_html("", order=order, visible=False)


def draw(place: viser.GuiHtmlHandle, drawing: str) -> None:
    """Put a drawing down where another one stands: HTML whose texts came through `as_html`."""
    if place.content != drawing:
        place.content = drawing
        place.visible = bool(drawing)


def name_of_curve(name: str) -> str:
    """Return a name as the legend of a plot shows it."""
    return plain(name, _LONGEST_NAME)


def name_button(button: viser.GuiButtonHandle, text: str) -> None:
    """Call a button something else."""
    shown = plain(text, _LONGEST_NAME)
    if button.label != shown:
        button.label = shown


def fill(field: viser.GuiInputHandle[str], text: str) -> None:
    """Write into a field that viewers may change."""
    field.value = plain(text)  # type: ignore[misc]


def notify(viewer: viser.ClientHandle, text: str, seconds: float) -> None:
    """Tell one viewer something, for a while."""
    viewer.add_notification(
        "Operating", plain(text, _LONGEST_NOTICE), auto_close_seconds=seconds, color="orange"
    )


class Choice:
    """A list to choose one name of, or none."""

    def __init__(
        self,
        gui: viser.GuiApi,
        label: str,
        names: Sequence[str] = (),
        order: float | None = None,
    ) -> None:
        """Offer names, in the container that is open now, with none of them chosen."""
        self._named = shown_names(names)
        self._list = gui.add_dropdown(label, (NOTHING, *self._named), order=order)

    @property
    def chosen(self) -> str:
        """The name that is chosen; empty where none is."""
        return self._named.get(self._list.value, "")

    @property
    def offered(self) -> tuple[str, ...]:
        """What stands in the list."""
        return tuple(self._list.options)

    def offer(self, names: Sequence[str], *, none_too: bool) -> None:
        """Offer names; none where that may be chosen too, or there are no names."""
        named = shown_names(names)
        options = (NOTHING, *named) if none_too or not named else tuple(named)
        if options != self._list.options:
            self._named = named
            self._list.options = options

    def choose(self, name: str) -> None:
        """Choose a name that is offered, or none where it is empty."""
        shown = (shown for shown, its in self._named.items() if its == name)
        self._list.value = next(shown, NOTHING)  # type: ignore[misc]

    def on_choice(self, act: Callable[[str], None]) -> None:
        """Have `act` done with a name whenever a page chooses it."""

        def choose(shown: str) -> None:
            if shown in self._named:
                act(self._named[shown])

        on_change(self._list, choose)


def shown_names(names: Sequence[str]) -> Mapping[str, str]:
    """Return names by how a list shows them, no two of them alike; of too many the first ones."""
    named: dict[str, str] = {}
    for name in dict.fromkeys(names[:MOST_CHOICES]):
        shown, number = plain(name, _LONGEST_NAME), 1
        while shown in named or shown in ("", NOTHING):
            number += 1
            shown = f"{plain(name, _LONGEST_NAME)} ({number})"
        named[shown] = name
    return named
