"""`hmcs status`: who is there, how each is and what it counts, as a table."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import NamedTuple

from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

from hmcs import process_words
from hmcs.bus.keys import Member
from hmcs.bus.messages import Health
from hmcs.bus.session import Bus
from hmcs.process_words import ILL, LATE, LOST, NOBODY, OK, REFUSED, process_name
from hmcs.shown import plain
from hmcs_local.asking import left_out
from hmcs_local.observer import Observation, Sighting, observe
from hmcs_local.tables import Cell, table_of

_LOOK_EVERY_S = 1.0
_WIDTH_FOR_DETAILS = 110
"""Columns of a terminal; on a narrower one only those who are ill get a line of their own."""
_NUMBERS = ("in/s", "out/s", LOST, REFUSED, LATE, "cpu %", "up s")
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
    process, health = process_name(now.member), now.health
    if health is None:
        return Row(process, False, process_words.NO_ANSWER, 0, 0, 0, 0, 0, 0, 0)
    same_life = before is not None and before.boot == now.boot
    then = (before.health if before and same_life else None) or _NOTHING
    seconds = max(health.uptime_s - then.uptime_s, 1e-3)
    return Row(
        process=process,
        healthy=health.healthy,
        detail=plain(health.detail),
        received_hz=(_total(health.received) - _total(then.received)) / seconds,
        sent_hz=(_total(health.sent) - _total(then.sent)) / seconds,
        lost=_total(health.lost),
        refused=_total(health.refused),
        late=_total(health.late),
        cpu_percent=100 * (health.cpu_s - then.cpu_s) / seconds,
        uptime_s=health.uptime_s,
    )


def active_model(sightings: Iterable[Sighting]) -> str:
    """Return the models whose beliefs fixtures follow, one as a rule; empty while none is known."""
    return ", ".join(sorted({model for _, model in _followed(sightings)}))


def remarks(now: Observation, before: Observation | None) -> list[str]:
    """Return what is wrong though every process may be well: one line each.

    `before` is an earlier look: who spoke for a model then is named where nobody does now.
    """
    found = []
    for fixture, model in _followed(now.sightings):
        if not now.speakers.get(model):
            went = before.speakers.get(model, ()) if before else ()
            gone = (
                f": {', '.join(map(process_name, went))} went while it was active" if went else ""
            )
            running = ", ".join(now.speakers) or "none"
            found.append(
                f"{process_name(fixture)} {process_words.unrun(plain(model))}{gone} "
                f"(models that are run: {running})"
            )
    return found


def show_status(bus: Bus, console: Console, *, once: bool) -> bool:
    """Show the table, anew every second until Ctrl-C; once, after two looks, if `once`.

    A console that is no terminal shows it once as well.

    Returns whether somebody is there, everybody is healthy and every model that is followed is run.
    """
    before, now = None, observe(bus)
    if once or not console.is_terminal:
        before, now = now, _look_again(bus, _LOOK_EVERY_S / 2)
        console.print(_picture(bus, now, before, console.width), soft_wrap=False)
        well = all(s.health and s.health.healthy for s in now.sightings)
        return bool(now.sightings) and well and not remarks(now, before)
    with Live(_picture(bus, now, None, console.width), console=console, auto_refresh=False) as live:
        while True:  # until Ctrl-C
            before, now = now, _look_again(bus, _LOOK_EVERY_S)
            live.update(_picture(bus, now, before, console.width), refresh=True)
            now = remembering(now, before)


def _look_again(bus: Bus, after_s: float) -> Observation:
    until_s = time.monotonic() + after_s
    while (left_s := until_s - time.monotonic()) > 0:
        bus.pump(left_s)
    return observe(bus)


def remembering(now: Observation, before: Observation) -> Observation:
    """Return a look that still knows who spoke last for each model that is followed.

    So that `remarks` can name them as long as nobody else runs that model.
    """
    kept = {
        model: before.speakers.get(model, ())
        for _, model in _followed(now.sightings)
        if not now.speakers.get(model)
    }
    return now._replace(speakers={**now.speakers, **kept})


def _followed(sightings: Iterable[Sighting]) -> list[tuple[Member, str]]:
    """Return each fixture that follows a model, and which."""
    return [
        (s.member, s.facts["active_model"])
        for s in sightings
        if s.member.service == "fixture_controller" and s.facts.get("active_model")
    ]


def _picture(bus: Bus, now: Observation, before: Observation | None, width: int) -> Group:
    sightings = now.sightings
    where = Text(f"cell {bus.settings.cell} on {bus.settings.router}")
    where.append(f", active model {plain(active_model(sightings)) or 'none'}")
    strangers = [Text(line, "yellow") for line in [left_out(now.strangers)] if line]
    if not sightings:
        return Group(where, Text(NOBODY, style="yellow"), *strangers)
    details = width >= _WIDTH_FOR_DETAILS
    columns = ("process", "", *_NUMBERS, *(("detail",) if details else ()))
    earlier = {(s.member, s.boot): s for s in before.sightings} if before else {}
    lines = [row(s, earlier.get((s.member, s.boot))) for s in sightings]
    rows: list[tuple[Cell, ...]] = [
        (
            line.process,
            Text(OK, style="green") if line.healthy else Text(ILL, style="red"),
            f"{line.received_hz:.0f}",
            f"{line.sent_hz:.0f}",
            *(_count(count) for count in (line.lost, line.refused, line.late)),
            f"{line.cpu_percent:.0f}",
            f"{line.uptime_s:.0f}",
            *([line.detail] if details else []),
        )
        for line in lines
    ]
    table = table_of("", columns, rows, _NUMBERS, width=width, drawn=False)
    ill = [f"{line.process}: {line.detail}" for line in lines if not line.healthy]
    wrong = [*([] if details else ill), *remarks(now, before)]
    return Group(where, table, *(Text(line, "red") for line in wrong), *strangers)


def _count(count: int) -> Text:
    return Text(str(count), style="red" if count else "dim")


def _total(counts: dict[str, int]) -> int:
    return sum(counts.values())
