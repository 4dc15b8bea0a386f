from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from rich.console import Console

from hmcs.bus.keys import Member
from hmcs.bus.messages import Health
from hmcs.bus.router import open_router
from hmcs.bus.session import Bus, Token
from hmcs_local.connecting import open_observer
from hmcs_local.observer import Sighting, observe
from hmcs_local.stack import with_free_port
from hmcs_local.status import active_model, remarks, remembering, row, show_status

Eventually = Callable[[Callable[[], Any]], Any]


def health(**more: Any) -> Health:
    values = {
        "healthy": True,
        "detail": "running",
        "uptime_s": 10.0,
        "loop_rate_hz": 100.0,
        "cpu_s": 1.0,
        "received": {"motion": 1000, "belief": 200},
        "sent": {"command": 1000},
        "lost": {"motion": 1, "belief": 2},
        "refused": {"motion": 4},
        "late": {"evidence": 5},
    }
    return Health.model_validate({**values, **more})


def sighting(boot: str = "b", **more: Any) -> Sighting:
    return Sighting(Member("task_hmm", "task-hmm-1"), boot, health(**more), {})


def test_rates_are_those_since_the_last_look() -> None:
    now = sighting(uptime_s=12.0, received={"motion": 1200}, sent={"command": 1100}, cpu_s=1.2)
    line = row(now, sighting(received={"motion": 1000}))
    assert (line.received_hz, line.sent_hz) == (100.0, 50.0)
    assert line.cpu_percent == pytest.approx(10.0)
    assert (line.lost, line.refused, line.late) == (3, 4, 5)


@pytest.mark.parametrize("before", [None, sighting(boot="another", received={"motion": 9000})])
def test_rates_of_one_not_seen_before_are_those_of_its_life(before: Sighting | None) -> None:
    line = row(sighting(), before)
    assert (line.received_hz, line.sent_hz) == (120.0, 100.0)


def test_one_that_does_not_answer_is_ill() -> None:
    line = row(Sighting(Member("robot", "r"), "", None, {}), sighting())
    assert not line.healthy
    assert line.process == "robot/r"
    assert "does not answer" in line.detail


def test_the_active_model_is_what_the_fixture_says() -> None:
    fixture = Sighting(Member("fixture_controller", "f"), "b", health(), {"active_model": "mine"})
    assert active_model([sighting(), fixture]) == "mine"
    assert active_model([sighting()]) == ""


@pytest.fixture
def bus() -> Iterator[Bus]:
    router = with_free_port("tcp/127.0.0.1:0")
    with open_router(router), open_observer(router, "demo") as bus:
        # It shows the tokens of others as well.
        bus.rights = None
        yield bus


def shown(bus: Bus, width: int = 160) -> tuple[bool, str]:
    """Return whether all is well, and the table."""
    file = io.StringIO()
    well = show_status(bus, Console(file=file, width=width), once=True)
    return well, file.getvalue()


def run(bus: Bus, model: str) -> Token:
    """Show that somebody speaks for a model."""
    return bus.announce(bus.keys.member(model, "my_recognizer", "r"))


def test_where_there_is_no_terminal_it_is_shown_once(bus: Bus) -> None:
    file = io.StringIO()
    assert not show_status(bus, Console(file=file, width=160), once=False)
    assert file.getvalue().count("nobody is there") == 1


def test_the_table_shows_who_is_there(
    bus: Bus, fixture_controller: Callable[..., Any], eventually: Eventually
) -> None:
    well, table = shown(bus)
    assert not well
    assert "nobody is there: bring the stack up with `hmcs up`" in table
    fixture_controller(bus, active="mine")
    run(bus, "mine")
    eventually(lambda: observe(bus).speakers)
    well, table = shown(bus)
    assert well
    assert "active model mine" in table
    assert "fixture_controller/f" in table
    assert "nobody runs" not in table


@pytest.mark.parametrize("width", [40, 80, 200])
def test_a_process_is_shown_whole_at_any_width(
    bus: Bus, fixture_controller: Callable[..., Any], eventually: Eventually, width: int
) -> None:
    fixture_controller(bus, active="mine", instance="fixture-controller-of-the-left-arm-1")
    run(bus, "mine")
    eventually(lambda: observe(bus).speakers)
    _, table = shown(bus, width)
    together = "".join(table.split())
    for word in ("fixture-controller-of-the-left-arm-1", "ok", "cpu%", "late"):
        assert word in together
    assert table.replace("\n", "").isprintable()
    assert all(len(line.rstrip()) <= width for line in table.splitlines())
    assert "…" not in table


@pytest.mark.parametrize("width", [80, 160])
def test_that_nobody_runs_the_active_model_is_said_and_is_not_well(
    bus: Bus, fixture_controller: Callable[..., Any], eventually: Eventually, width: int
) -> None:
    fixture_controller(bus, active="mine")
    run(bus, "other")
    bus.announce(bus.keys.member("mine", "gesteme_classifier", "c"))
    eventually(lambda: observe(bus).speakers)
    well, table = shown(bus, width)
    reported = " ".join(table.split())
    assert "follows mine, but nobody runs it (models that are run: other)" in reported
    assert not well


def test_who_went_while_its_model_was_active_is_named_as_long_as_nobody_else_runs_it(
    bus: Bus, fixture_controller: Callable[..., Any], eventually: Eventually
) -> None:
    fixture_controller(bus, active="mine")
    token = run(bus, "mine")
    eventually(lambda: observe(bus).speakers)
    before = observe(bus)
    assert remarks(before, None) == []
    token.withdraw()
    eventually(lambda: not observe(bus).speakers)
    for _ in range(3):
        now = observe(bus)
        (remark,) = remarks(now, before)
        assert "nobody runs it: my_recognizer/r went while it was active" in remark
        before = remembering(now, before)
    run(bus, "mine")
    eventually(lambda: observe(bus).speakers)
    assert remarks(observe(bus), before) == []


def test_every_model_that_a_fixture_follows_is_named(
    bus: Bus, fixture_controller: Callable[..., Any]
) -> None:
    fixture_controller(bus, active="mine", instance="f")
    fixture_controller(bus, active="yours", instance="g")
    well, table = shown(bus)
    assert "active model mine, yours" in table
    assert "fixture_controller/f follows mine, but nobody runs it" in table
    assert "fixture_controller/g follows yours, but nobody runs it" in table
    assert not well


def test_two_processes_of_one_name_are_two_lines(
    bus: Bus, fixture_controller: Callable[..., Any]
) -> None:
    fixture_controller(bus)
    fixture_controller(bus)
    assert shown(bus)[1].count("fixture_controller/f") == 2


@pytest.mark.parametrize("name", ["evil name", "\x1b[2J\x1b]0;x\x07", "n" * 300, "[red]"])
def test_tokens_nobody_can_bear_are_counted_shown_harmlessly_and_make_nobody_ill(
    bus: Bus, fixture_controller: Callable[..., Any], eventually: Eventually, name: str
) -> None:
    fixture_controller(bus)
    presence = bus.keys.presence("robot", "x").removesuffix("x")
    bus.announce(f"{presence}{name}")
    bus.announce(bus.keys.member("mine", "recognizer", "x").removesuffix("x") + name)
    eventually(lambda: len(observe(bus).strangers) == 2)
    well, table = shown(bus)
    assert well
    assert "no process can bear such a name (2): 'presence/robot/" in " ".join(table.split())
    assert table.replace("\n", "").isprintable()


def test_what_a_process_says_of_itself_is_text() -> None:
    said = "[red]\x1b[2Jgone\u202e[/nonsense]"
    line = row(sighting(detail=said), None)
    assert line.detail == "[red]\\x1b[2Jgone\\u202e[/nonsense]"
