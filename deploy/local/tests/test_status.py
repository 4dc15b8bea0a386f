from __future__ import annotations

import io
import logging
import threading
from collections.abc import Callable
from typing import Any

import pytest
from rich.console import Console

from hmcs.bus.keys import Member
from hmcs.bus.messages import Health
from hmcs.bus.router import open_router
from hmcs.bus.service import Service, serve
from hmcs.bus.session import Bus, BusSettings
from hmcs.bus.settings import ServiceSettings
from hmcs_local.observer import Sighting, look, open_observer
from hmcs_local.stack import with_free_port
from hmcs_local.status import active_model, row, show_status

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


class Fixture(Service):
    """A service that does nothing but say which model is active."""

    name = "fixture_controller"

    def facts(self) -> dict[str, str]:
        return {"active_model": "mine"}


def test_the_table_shows_who_is_there(eventually: Eventually) -> None:
    router = with_free_port("tcp/127.0.0.1:0")
    over = threading.Event()

    def live() -> None:
        settings = BusSettings(router=router, cell="demo")
        with Bus.open(settings, "fixture_controller", "f", stopping=over.is_set) as bus:
            serve(
                Fixture,
                ServiceSettings(router=router),
                bus,
                logging.getLogger("test"),
                over.is_set,
            )

    with open_router(router), open_observer(router, "demo") as bus:
        console = Console(file=io.StringIO(), width=160)
        assert not show_status(bus, console, once=True)
        thread = threading.Thread(target=live)
        thread.start()
        try:
            eventually(lambda: look(bus))
            assert show_status(bus, console, once=True)
        finally:
            over.set()
            thread.join()
        file = console.file
        assert isinstance(file, io.StringIO)
        nobody, _, table = file.getvalue().partition("hmcs up")
        assert "nobody is there" in nobody
        assert "active model mine" in table
        assert "fixture_controller/f" in table
