"""Buttons of the page: what is done when one is pressed is done for the page that pressed it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import viser

from hmcs_console.serving.inbox import pressed_by

PLAIN: Literal["gray"] = "gray"
"""Color of a button that is neither the next thing to do nor ends anything."""
STOP, GO, BACK, CANCEL = (
    viser.Icon.HAND_STOP,
    viser.Icon.PLAYER_PLAY,
    viser.Icon.ARROW_BACK_UP,
    viser.Icon.X,
)
TAG, TRAIN, REFRESH, SAVE, ADD, HIDE, REMOVE = (
    viser.Icon.TAG,
    viser.Icon.SCHOOL,
    viser.Icon.REFRESH,
    viser.Icon.DEVICE_FLOPPY,
    viser.Icon.PLUS,
    viser.Icon.EYE_OFF,
    viser.Icon.ERASER,
)
EDIT, DELETE = viser.Icon.PENCIL, viser.Icon.TRASH
FIND = viser.Icon.TIMELINE
HAND = viser.Icon.HAND_GRAB


def on_click(button: viser.GuiButtonHandle, act: Callable[[], None]) -> None:
    """Have `act` done whenever a button is clicked."""

    async def click(event: viser.GuiEvent[Any]) -> None:
        with pressed_by(event.client_id):
            act()

    button.on_click(click)


def on_change(place: viser.GuiInputHandle[Any], act: Callable[[Any], None]) -> None:
    """Have `act` done with the value of an input whenever a page changes it, and not when we do."""

    async def change(event: viser.GuiEvent[Any]) -> None:
        if event.client_id is not None:
            with pressed_by(event.client_id):
                act(event.target.value)

    place.on_update(change)
