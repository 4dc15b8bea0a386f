from __future__ import annotations

import json
import logging
import signal
import threading
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
import yaml

from hmcs.bus import health
from hmcs.bus.messages import Ask, Description, Health, SettingsReport, Step
from hmcs.bus.service import Service, ServiceSettings, Stop, run, serve
from hmcs.bus.session import Bus, BusSettings
from hmcs.bus.verbs import DESCRIBE, HEALTH

PROBE = """
import sys, time
from hmcs.bus.service import Service, run
from hmcs.bus.messages import Step
from hmcs.errors import UserError

class Probe(Service):
    name = "probe"

    def __init__(self, settings, bus, log):
        super().__init__(settings, bus, log)
        bus.subscribe(Step, bus.keys.step, self.on_step)

    def on_step(self, received):
        if received.body.index == 13:
            raise UserError("step 13: count without it")
        if received.body.index == 7:
            raise RuntimeError("boom")
        self.log.info("step", extra={"index": received.body.index})

    def close(self):
        self.log.info("closing")

raise SystemExit(run(Probe))
"""


def events(process) -> list[str]:
    """The events a process logged so far."""
    lines = process.log.read_text().splitlines()
    return [json.loads(line)["event"] for line in lines if line.startswith("{")]


@pytest.fixture
def probe(spawn, router, until):
    """A probe process that is ready."""
    process = spawn(PROBE, "--router", router, "--cell", "test", "--instance", "p")
    until(lambda: "ready" in events(process))
    return process


# --- as a process ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [signal.SIGTERM, signal.SIGINT])
def test_a_service_ends_cleanly_within_a_second_with_code_0(probe, name) -> None:
    probe.send_signal(name)
    assert probe.wait(1.0) == 0
    assert events(probe)[-2:] == ["closing", "stopped"]


def test_a_service_without_a_router_says_so_and_still_ends_cleanly(
    spawn, free_endpoint, until
) -> None:
    process = spawn(PROBE, "--router", free_endpoint)
    until(lambda: any("waiting for a router" in event for event in events(process)))
    process.send_signal(signal.SIGTERM)
    assert process.wait(1.0) == 0


def test_a_service_goes_on_by_itself_when_the_router_comes_and_comes_again(
    spawn, restartable_router, until
) -> None:
    process = spawn(PROBE, "--router", restartable_router.endpoint, "--cell", "test")
    check = ["--service", "probe", "--router", restartable_router.endpoint, "--cell", "test"]
    until(lambda: any("waiting for a router" in event for event in events(process)))
    restartable_router.start()
    until(lambda: health.main(check) == 0)
    restartable_router.stop()
    until(lambda: "connection lost: going on by itself" in events(process))
    restartable_router.start()
    until(lambda: health.main(check) == 0)
    until(lambda: "connected again" in events(process))
    process.send_signal(signal.SIGTERM)
    assert process.wait(1.0) == 0


def test_a_handler_that_fails_is_logged_and_the_loop_goes_on_unhealthy(
    probe, join, until, capsys
) -> None:
    bus = join()
    steps = bus.publisher(Step, bus.keys.step)
    until(lambda: steps.matching)
    for index in (7, 8):
        steps.put(step(index))
    until(lambda: "step" in events(probe))
    assert "a handler failed: going on" in events(probe)
    assert "RuntimeError: boom" in probe.log.read_text()
    router = bus.settings.router
    assert health.main(["--service", "probe", "--router", router, "--cell", "test"]) == 1
    assert "RuntimeError: boom" in capsys.readouterr().out


def test_a_mistake_of_the_user_met_while_it_runs_is_a_failed_handler_reported_in_one_line(
    probe, join, until
) -> None:
    bus = join()
    steps = bus.publisher(Step, bus.keys.step)
    until(lambda: steps.matching)
    for index in (13, 14):
        steps.put(step(index))
    until(lambda: "step" in events(probe))
    assert "step 13: count without it" in probe.log.read_text()
    assert "Traceback" not in probe.log.read_text()
    assert probe.poll() is None


def test_a_mistake_of_the_user_met_while_it_starts_ends_it_with_code_2_and_one_line(
    spawn, router
) -> None:
    subscribes = "bus.subscribe(Step, bus.keys.step, self.on_step)"
    broken = PROBE.replace(subscribes, 'raise UserError("no model: name one")')
    process = spawn(broken, "--router", router)
    assert process.wait(30) == 2
    assert "probe: no model: name one" in process.log.read_text().splitlines()


def test_a_timer_slower_than_its_period_leaves_a_service_answering_and_ending(
    spawn, router, join, until
) -> None:
    slow = PROBE.replace(
        "bus.subscribe(Step, bus.keys.step, self.on_step)",
        "bus.every(0.004, lambda: time.sleep(0.006))",
    )
    process = spawn(slow, "--router", router, "--cell", "test", "--instance", "p")
    until(lambda: "ready" in events(process))
    bus = join()
    until(lambda: DESCRIBE.ask(bus, Ask(), service="probe", timeout_s=10.0))
    process.send_signal(signal.SIGTERM)
    assert process.wait(30) == 0


@pytest.mark.long
def test_a_service_whose_loop_hangs_still_says_so_itself(spawn, router, join, until) -> None:
    hung = PROBE.replace('raise RuntimeError("boom")', "time.sleep(600)")
    process = spawn(hung, "--router", router, "--cell", "test", "--instance", "p")
    until(lambda: "ready" in events(process))
    bus = join()
    steps = bus.publisher(Step, bus.keys.step)
    until(lambda: steps.matching)
    steps.put(step(7))
    (answer,) = until(lambda: HEALTH.ask(bus, Ask(), service="probe", timeout_s=20.0))
    assert not answer.body.healthy
    assert "has not come round" in answer.body.detail
    process.kill()


@pytest.mark.long
def test_a_service_of_the_table_declares_nothing_that_the_table_does_not_give_it(
    spawn, router
) -> None:
    trespassing = PROBE.replace('name = "probe"', 'name = "task_hmm"')
    process = spawn(
        trespassing.replace("bus.subscribe(Step, bus.keys.step, self.on_step)",
            "from hmcs.bus.messages import Command; bus.publisher(Command, bus.keys.command)"),
        "--router", router,
    )  # fmt: skip
    assert process.wait(30) == 1
    assert "the table of rights" in process.log.read_text()


def step(index: int) -> Step:
    return Step(index=index, position=np.zeros(3), displacement=np.ones(3))


# --- in this process ------------------------------------------------------------------------------


class Quiet(Service):
    """A service in a thread of the test's."""

    name = "quiet"

    def health(self) -> tuple[bool, str]:
        return False, "waiting for a model"

    def facts(self) -> dict[str, str]:
        return {"model": "demo"}


@pytest.fixture
def quiet(router) -> Iterator[str]:
    """A service of its own thread; its router."""
    settings = ServiceSettings(router=router, cell="test", instance="q")
    stop = Stop()
    with Bus.open(settings.bus, "quiet", "q", stopping=stop) as bus:
        stop.wakes(bus)
        log = logging.getLogger("hmcs.test")
        thread = threading.Thread(target=serve, args=(Quiet, settings, bus, log, stop))
        thread.start()
        yield router
        stop.set()
        thread.join()


@pytest.fixture
def ask_quiet(quiet, until) -> Iterator[Callable]:
    """Ask the quiet service, once it is present."""
    with Bus.open(BusSettings(router=quiet, cell="test"), "asker", "a") as bus:
        until(lambda: bus.alive(bus.keys.presence("quiet")))

        def ask(verb: str, answer_type):
            (answer,) = bus.ask(bus.keys.rpc("quiet", "q", verb), Ask(), answer_type)
            return answer.body

        yield ask


def test_every_service_says_how_it_is(ask_quiet) -> None:
    answer = ask_quiet("health", Health)
    assert (answer.healthy, answer.detail) == (False, "waiting for a model")
    assert answer.uptime_s > 0
    assert answer.cpu_s > 0


def test_every_service_says_what_it_is(ask_quiet) -> None:
    answer = ask_quiet("describe", Description)
    assert answer.version
    assert answer.facts == {"model": "demo"}
    assert [key.rsplit("/", 1)[1] for key in answer.answers] == ["health", "describe", "settings"]


def test_every_service_tells_its_settings(ask_quiet, quiet) -> None:
    answer = ask_quiet("settings", SettingsReport)
    assert answer.settings["cell"] == "test"
    assert answer.settings["router"] == quiet


def test_presence_is_announced_after_start_and_withdrawn_before_close(router, until) -> None:
    settings = ServiceSettings(router=router, cell="test", instance="o")
    stop, seen = Stop(), []

    with Bus.open(BusSettings(router=router, cell="test"), "observer", "a") as observer:

        class Ordered(Service):
            name = "ordered"

            def start(self) -> None:
                seen.append(observer.alive(observer.keys.presence("ordered")))

            def close(self) -> None:
                until(lambda: not observer.alive(observer.keys.presence("ordered")))

        with Bus.open(settings.bus, "ordered", "o", stopping=stop) as bus:
            stop.wakes(bus)
            thread = threading.Thread(target=serve, args=(Ordered, settings, bus, bus._log, stop))
            thread.start()
            until(lambda: observer.alive(observer.keys.presence("ordered")))
            stop.set()
            thread.join()
    assert seen == [[]]


# --- the command line -----------------------------------------------------------------------------


def test_the_settings_in_force_are_printed_as_yaml(capsys) -> None:
    assert run(Quiet, ["--print-settings", "--cell", "one"]) == 0
    assert yaml.safe_load(capsys.readouterr().out)["cell"] == "one"


def test_help_ends_with_code_0(capsys) -> None:
    assert run(Quiet, ["--help"]) == 0
    assert "--print-settings" in capsys.readouterr().out


@pytest.mark.parametrize(
    "argv", [["--cell", "a*"], ["--instance", "a$b"], ["--cell", "a/b"], ["--speed", "1"]]
)
def test_a_mistake_of_the_user_is_one_line_and_code_2(argv, capsys) -> None:
    assert run(Quiet, argv) == 2
    error = capsys.readouterr().err
    assert error.startswith("quiet: command line: ")
    assert len(error.splitlines()) == 1


def test_no_router_within_the_time_set_is_code_2(free_endpoint, capsys) -> None:
    assert run(Quiet, ["--router", free_endpoint, "--connect-timeout-s", "0.1"]) == 2
    assert f"no router at {free_endpoint}" in capsys.readouterr().err


def test_a_service_that_cannot_start_unexpectedly_is_code_1_with_a_traceback(
    router, capsys
) -> None:
    class Broken(Service):
        name = "broken"

        def start(self) -> None:
            raise RuntimeError("boom")

    assert run(Broken, ["--router", router]) == 1
    assert "RuntimeError: boom" in capsys.readouterr().err


def test_nobody_healthy_is_reported_in_one_line(router, capsys) -> None:
    began_s = time.monotonic()
    assert health.main(["--service", "nobody", "--router", router]) == 1
    assert time.monotonic() - began_s < 5
    out = capsys.readouterr().out
    assert out.startswith("nobody: nobody answered")
    assert len(out.splitlines()) == 1


def test_an_unhealthy_service_is_reported_with_its_reason(quiet, ask_quiet, capsys) -> None:
    assert not ask_quiet("health", Health).healthy
    assert health.main(["--service", "quiet", "--router", quiet, "--cell", "test"]) == 1
    assert capsys.readouterr().out == "quiet: q: waiting for a model\n"


@pytest.mark.parametrize("argv", [["--cell", "a*"], ["--router", "x"]])
def test_a_mistake_in_asking_for_health_is_code_2(argv, capsys) -> None:
    assert health.main(["--service", "quiet", *argv]) == 2
    assert capsys.readouterr().err.startswith("health: ")
