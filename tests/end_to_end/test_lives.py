"""Every service ends cleanly, whatever it is doing: SIGTERM and SIGINT, code 0, within a second."""

from __future__ import annotations

import signal
import time
from pathlib import Path

import pytest

from hmcs_local.processes import StackProcess
from support.hand import Scene
from support.stack import DEADLINE_S, Stack, log_events

ENDS = [signal.SIGTERM, signal.SIGINT]


def start_one_of_each(stack: Stack, model_file: Path) -> list[StackProcess]:
    """Start one of each service, none of them waited for."""
    return [
        stack.start("input_device", "i"),
        stack.start("gesteme_classifier", "c", "--model", model_file),
        stack.start("task_hmm", "t", "--model", model_file),
        stack.start("fixture_controller", "f", "--models", f'["{model_file}"]'),
        stack.start("robot", "r"),
    ]


def until_told(stack: Stack, process: StackProcess, event: str) -> None:
    """Wait until a process has logged an event that begins so."""
    stack.until(lambda: any(each["event"].startswith(event) for each in log_events(process)))


def assert_ends(process: StackProcess, how: signal.Signals) -> None:
    asked_s = time.monotonic()
    process.send(how)
    code = process.wait(DEADLINE_S)
    took_s = time.monotonic() - asked_s
    reported = "\n".join(process.last_lines())
    assert code == 0, f"{process.service} ended with {code}:\n{reported}"
    assert took_s < 1.0, f"{process.service} took {took_s:.2f} s:\n{reported}"
    assert "Traceback" not in reported


@pytest.mark.parametrize("how", ENDS)
def test_every_service_ends_cleanly_at_work(
    scene: Scene, model_file: Path, how: signal.Signals
) -> None:
    services = start_one_of_each(scene.stack, model_file)
    scene.stack.until_ready(*services)
    scene.stack.until(lambda: scene.watcher.robot and scene.watcher.motions)
    for service in services:
        assert_ends(service, how)
        scene.stack.until_gone(service)
    assert_ends(scene.stack.router, how)


@pytest.mark.parametrize("how", ENDS)
def test_every_service_waits_for_a_router_saying_so_and_ends_cleanly_meanwhile(
    stack: Stack, model_file: Path, how: signal.Signals
) -> None:
    stack.router.kill()
    services = start_one_of_each(stack, model_file)
    for service in services:
        until_told(stack, service, "waiting for a router")
        assert_ends(service, how)


def test_services_that_wait_go_on_by_themselves_once_there_is_a_router(
    stack: Stack, model_file: Path
) -> None:
    stack.router.kill()
    services = start_one_of_each(stack, model_file)
    for service in services:
        until_told(stack, service, "waiting for a router")
        assert service.running
    stack.start_router()
    Scene(stack)
    stack.until_ready(*services)
