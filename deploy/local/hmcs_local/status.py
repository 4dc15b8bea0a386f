"""`hmcs status`: who is there, how each is and what it counts, as a table."""

from __future__ import annotations

import time
from typing import NamedTuple

from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from hmcs.bus.messages import Health
from hmcs.bus.session import Bus
from hmcs_local.observer import Sighting, look

NOBODY = "nobody is there: bring the stack up with `hmcs up`"

_LOOK_EVERY_S = 1.0
_WIDTH_FOR_DETAILS = 110
"""Columns of a terminal; on a narrower one only those who are ill get a line of their own."""
_NOTHING = Health(
    healthy=True,
    detail="",
    uptime_s=0.0,
    loop_rate_hz=0.0,
    cpu_s=0.0,
    received={},
    sent={},
    lost={},
    refused={},
    late={},
)


class Row(NamedTuple):
    """A line of the table; rates are over the time since the process was last seen."""

    process: str
    healthy: bool
    detail: str
    received_hz: float
    sent_hz: float
    lost: int
    refused: int
    late: int
    cpu_percent: float
    uptime_s: float


def row(now: Sighting, before: Sighting | None) -> Row:
    """Return a process' line; over its whole life where `before` is None or of another boot."""
    service, process = now.member
    if not process.startswith(service.replace("_", "-")):
        process = f"{service}/{process}"
    health = now.health
    if health is None:
        return Row(process, False, "present, but does not answer", 0, 0, 0, 0, 0, 0, 0)
    same_life = before is not None and before.boot == now.boot
    then = (before.health if before and same_life else None) or _NOTHING
    seconds = max(health.uptime_s - then.uptime_s, 1e-3)
    return Row(
        process=process,
        healthy=health.healthy,
        detail=health.detail,
        received_hz=(_total(health.received) - _total(then.received)) / seconds,
        sent_hz=(_total(health.sent) - _total(then.sent)) / seconds,
        lost=_total(health.lost),
        refused=_total(health.refused),
        late=_total(health.late),
        cpu_percent=100 * (health.cpu_s - then.cpu_s) / seconds,
        uptime_s=health.uptime_s,
    )


def active_model(sightings: list[Sighting]) -> str:
    """Return the model whose belief the fixture follows; empty while none is known."""
    return next((s.facts["active_model"] for s in sightings if s.facts.get("active_model")), "")


def show_status(bus: Bus, console: Console, *, once: bool) -> bool:
    """Show the table, anew every second until Ctrl-C; with `once`, after two looks.

    Returns whether somebody is there and everybody is healthy.
    """
    sightings = look(bus)
    if once:
        before, sightings = sightings, _look_again(bus, _LOOK_EVERY_S / 2)
        console.print(_picture(bus, sightings, before, console.width))
        return bool(sightings) and all(s.health and s.health.healthy for s in sightings)
    first = _picture(bus, sightings, [], console.width)
    with Live(first, console=console, auto_refresh=False) as live:
        while True:  # until Ctrl-C
            before, sightings = sightings, _look_again(bus, _LOOK_EVERY_S)
            live.update(_picture(bus, sightings, before, console.width), refresh=True)


def _look_again(bus: Bus, after_s: float) -> list[Sighting]:
    until_s = time.monotonic() + after_s
    while (left_s := until_s - time.monotonic()) > 0:
        bus.pump(left_s)
    return look(bus)


def _picture(bus: Bus, sightings: list[Sighting], before: list[Sighting], width: int) -> Group:
    where = Text(f"cell {bus.settings.cell} on {bus.settings.router}")
    where.append(f", active model {active_model(sightings) or 'none'}")
    if not sightings:
        return Group(where, Text(NOBODY, style="yellow"))
    table = Table(box=None, header_style="bold", pad_edge=False)
    table.add_column("process", no_wrap=True)
    table.add_column("")
    for name in ("in/s", "out/s", "lost", "refused", "late", "cpu %", "up s"):
        table.add_column(name, justify="right", no_wrap=True)
    if width >= _WIDTH_FOR_DETAILS:
        table.add_column("detail")
    earlier = {s.member: s for s in before}
    lines = [row(sighting, earlier.get(sighting.member)) for sighting in sightings]
    for line in lines:
        table.add_row(
            line.process,
            Text("ok", style="green") if line.healthy else Text("ill", style="red"),
            f"{line.received_hz:.0f}",
            f"{line.sent_hz:.0f}",
            *(_count(count) for count in (line.lost, line.refused, line.late)),
            f"{line.cpu_percent:.0f}",
            f"{line.uptime_s:.0f}",
            *([line.detail] if width >= _WIDTH_FOR_DETAILS else []),
        )
    if width >= _WIDTH_FOR_DETAILS:
        return Group(where, table)
    ill = [Text(f"{line.process}: {line.detail}") for line in lines if not line.healthy]
    return Group(where, table, *ill)


def _count(count: int) -> Text:
    return Text(str(count), style="red" if count else "dim")


def _total(counts: dict[str, int]) -> int:
    return sum(counts.values())
