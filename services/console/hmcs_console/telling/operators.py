"""Who operates, as each viewer reads it, with what to do next, and a way to take over."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from typing import NamedTuple

import viser

from hmcs.bus.keys import Member
from hmcs.shown import Markdown
from hmcs_console.seeing.seen import Picture
from hmcs_console.serving.buttons import HAND, on_click
from hmcs_console.serving.writing import add_words, write

PAGE = "page"
"""The input device's source where it hears the handles of pages."""
_FIRST = 0.0
"""In what order it stands among all in its container."""


class Places(NamedTuple):
    """Where one viewer reads it."""

    words: viser.GuiMarkdownHandle
    take_over: viser.GuiButtonHandle


class Operators:
    """Gives every viewer a line of its own; made and drawn on one thread."""

    def __init__(
        self,
        server: viser.ViserServer,
        controls: viser.GuiTabHandle,
        take_over: Callable[[int], None],
    ) -> None:
        """Begin; call `take_over` with the number of a page that wants to operate instead."""
        self._places: dict[int, Places] = {}

        async def come(client: viser.ClientHandle) -> None:
            number = client.client_id
            with controls:
                words = add_words(client.gui, order=_FIRST)
                button = client.gui.add_button(
                    "Take over",
                    color="orange",
                    icon=HAND,
                    hint="The other page lets go and the robot stands; then take the handle here",
                    order=_FIRST,
                    visible=False,
                )
            on_click(button, lambda: take_over(number))
            self._places[number] = Places(words, button)

        async def go(client: viser.ClientHandle) -> None:
            self._places.pop(client.client_id, None)

        server.on_client_connect(come)
        server.on_client_disconnect(go)

    def draw(self, picture: Picture) -> None:
        """Write down a moment for every viewer."""
        for client, places in list(self._places.items()):
            # Who is gone cannot be written to.
            with contextlib.suppress(RuntimeError):
                write(places.words, operates(picture, client))
                another = picture.operating_client not in (None, client)
                if places.take_over.visible != another:
                    places.take_over.visible = another


def operates(picture: Picture, client: int) -> Markdown:
    """Return who operates, as one viewer reads it, and what to do next."""
    if picture.operating_client == client:
        return Markdown("**You operate.** Let go of the handle, and the robot stands.")
    if picture.operating_client is not None:
        return Markdown(
            "**Another page operates.** Wait until it lets go, or press *Take over*, then take "
            "the handle."
        )
    if picture.device not in ("", PAGE):
        return Markdown(
            "**The source *{}* drives**: the handle here moves nothing. To drive from here, start "
            "the input device with the source *page*."
        ).format(picture.device)
    if not _is_there("input_device", picture.health):
        return Markdown(
            "**Nobody can operate**: no input device is there. Start one with the source *page*."
        )
    if client in picture.lost:
        return Markdown("**You do not operate any more**: {}").format(picture.lost[client])
    if not picture.active or picture.unrun:
        return Markdown(
            "**Nobody operates.** The robot can be led by the handle, but no recognizer is active. "
            "Next: open *Teach* and record a few demonstrations, or *Activate* a recognizer."
        )
    return Markdown("**Nobody operates.** Next: take the handle at the tool and lead the robot.")


def _is_there(service: str, members: Mapping[Member, object]) -> bool:
    return any(member.service == service for member in members)
