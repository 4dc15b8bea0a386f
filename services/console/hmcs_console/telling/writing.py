"""Words put down on the page."""

from __future__ import annotations

import viser


def write(place: viser.GuiMarkdownHandle, text: str) -> None:
    """Put a text down where another one stands; markdown is laid out anew whenever it is set."""
    if place.content != text:
        place.content = text
