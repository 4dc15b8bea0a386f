"""Input devices as a person looks for them: which are there, and what is missing."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table
from rich.text import Text

from hmcs.shown import plain
from hmcs_input_device.devices.detect import found

_STYLES = {"ready": "green", "no device": "yellow", "not installed": "dim"}


def show_devices(console: Console) -> bool:
    """Print a row for each device; where nobody looks, a line of tab-separated fields.

    Returns whether one is ready.
    """
    # Devices name themselves.
    sightings = [sighting._replace(detail=plain(sighting.detail)) for sighting in found()]
    if console.is_terminal:
        # Names of extras stand in brackets, which rich would take for styles.
        table = Table("device", "state", "what is there", "what to do", box=None, pad_edge=False)
        for name, state, detail, remedy in sightings:
            table.add_row(
                Text(name, "bold"), Text(state, _STYLES[state]), Text(detail), Text(remedy)
            )
        console.print(table)
    else:
        for sighting in sightings:
            console.print("\t".join(sighting), soft_wrap=True, markup=False, highlight=False)
    return any(sighting.state == "ready" for sighting in sightings)
