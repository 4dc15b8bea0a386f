"""Input devices as a person looks for them: which are there, and what is missing."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from hmcs_input_device.devices.detect import found
from hmcs_local.tables import show_table

_STYLES = {"ready": "green", "no device": "yellow", "not installed": "dim"}


def show_devices(console: Console) -> bool:
    """Print a row for each device; return whether one is ready."""
    sightings = found()
    rows = [
        (Text(name, "bold"), Text(state, _STYLES[state]), detail, remedy)
        for name, state, detail, remedy in sightings
    ]
    show_table(console, "", ("device", "state", "what is there", "what to do"), rows)
    return any(sighting.state == "ready" for sighting in sightings)
