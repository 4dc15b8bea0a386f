"""The tone of the deviation, for each viewer who wants to hear it."""

from __future__ import annotations

import contextlib
from typing import Any, NamedTuple

import viser

from hmcs_console.telling.tone import SILENT, html_of, level_of

HOLDS_S = 0.4
"""So long a tone is heard before another: a page takes its time to begin with one."""


class Ear(NamedTuple):
    """Where one viewer hears it."""

    wanted: viser.GuiCheckboxHandle
    place: viser.GuiHtmlHandle


class Sounds:
    """Gives every viewer a switch, off at first, and plays to those who have it on."""

    def __init__(self, server: viser.ViserServer, controls: viser.GuiTabHandle) -> None:
        """Begin; `controls` is where each viewer gets the switch."""
        self._ears: dict[int, Ear] = {}
        self._level = SILENT
        self._since_s = 0.0

        async def come(client: viser.ClientHandle) -> None:
            with controls:
                wanted = client.gui.add_checkbox(
                    "Tone", False, hint="Rises with the distance beside the guide"
                )
                self._ears[client.client_id] = Ear(wanted, client.gui.add_html(""))

            async def switch(_: viser.GuiEvent[Any]) -> None:
                self._play()

            wanted.on_update(switch)

        async def go(client: viser.ClientHandle) -> None:
            self._ears.pop(client.client_id, None)

        server.on_client_connect(come)
        server.on_client_disconnect(go)

    def draw(self, now_s: float, off_guide_m: float | None) -> None:
        """Play the tone of a deviation, m, by the monotonic clock; None is silent."""
        level = level_of(off_guide_m, self._level)
        held = now_s - self._since_s < HOLDS_S
        if level != self._level and (level == SILENT or not held):
            self._level, self._since_s = level, now_s
            self._play()

    def _play(self) -> None:
        for ear in list(self._ears.values()):
            # Who is gone cannot be played to.
            with contextlib.suppress(RuntimeError):
                ear.place.content = html_of(self._level if ear.wanted.value else SILENT)
