from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from hmcs.bus.messages import ActivateRecognizer, Done
from hmcs.bus.router import open_router
from hmcs.bus.session import Bus, RequestRefusedError
from hmcs_local.control import Control
from hmcs_local.observer import open_observer
from hmcs_local.stack import LocalStack, with_free_port
from hmcs_local.swap import SwapError, activate, replace_classifier

Eventually = Callable[[Callable[[], Any]], Any]
Served = Callable[[LocalStack, Callable[[], Any]], Any]
OLD = "gesteme-classifier-1"
NEVER_READY = ["python", "-c", "import time; time.sleep(600)"]
ENDS_AT_ONCE = ["python", "-c", ""]
CELL = "fake"


@pytest.fixture
def stack(
    write_compose: Callable[..., Path],
    classifier: dict[str, Any],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> Iterator[LocalStack]:
    """One fake classifier."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    path = write_compose(gesteme_classifier=classifier)
    with LocalStack(path, router="tcp/127.0.0.1:0", folder=tmp_path) as stack:
        yield stack


@pytest.fixture
def bus(stack: LocalStack, eventually: Eventually) -> Iterator[Bus]:
    with open_observer(stack.router, CELL) as bus:
        member = bus.keys.member("*", "gesteme_classifier")
        eventually(lambda: len(bus.alive(member)) == len(stack.instances("gesteme-classifier")))
        yield bus


def running(stack: LocalStack) -> list[str]:
    return [process.instance for process in stack.instances("gesteme-classifier")]


def test_a_classifier_goes_once_its_successor_is_ready(
    stack: LocalStack, bus: Bus, served: Served
) -> None:
    told: list[str] = []
    control = Control(stack.folder)
    newcomer = served(stack, lambda: replace_classifier(bus, control, OLD, tell=told.append))
    assert newcomer == "gesteme-classifier-2"
    assert running(stack) == [newcomer]
    assert stack.processes[OLD].exit_code == 0
    assert told == [
        f"{newcomer} started; {OLD} goes on until it is ready",
        f"{newcomer} has replayed and is ready",
        f"{OLD} stopped with exit code 0",
    ]


@pytest.mark.parametrize("command", [NEVER_READY, ENDS_AT_ONCE])
def test_the_old_one_goes_on_when_the_newcomer_is_not_ready(
    stack: LocalStack, bus: Bus, served: Served, command: list[str]
) -> None:
    def swap() -> None:
        control = Control(stack.folder)
        replace_classifier(bus, control, OLD, command=command, ready_within_s=0.5)

    with pytest.raises(SwapError, match=f"{OLD} goes on"):
        served(stack, swap)
    assert running(stack) == [OLD]


def test_only_a_classifier_at_work_that_up_has_started_is_replaced(
    stack: LocalStack, bus: Bus, served: Served
) -> None:
    control = Control(stack.folder)
    with pytest.raises(SwapError, match=f"no classifier 'robot-1' .* choose from {OLD}"):
        served(stack, lambda: replace_classifier(bus, control, "robot-1"))
    with open_observer(stack.router, CELL) as other:
        other.announce(other.keys.member("fake", "gesteme_classifier", "elsewhere"))
        with pytest.raises(SwapError, match="elsewhere was not started by"):
            served(stack, lambda: replace_classifier(bus, control, "elsewhere"))


@pytest.fixture
def empty_bus() -> Iterator[Bus]:
    router = with_free_port("tcp/127.0.0.1:0")
    with open_router(router), open_observer(router, CELL) as bus:
        yield bus


def test_a_recognizer_is_activated_by_the_fixture_controller(
    empty_bus: Bus, eventually: Eventually
) -> None:
    bus = empty_bus
    with pytest.raises(SwapError, match="no fixture controller"):
        activate(bus, "other")
    over = threading.Event()

    def answer(asked: ActivateRecognizer) -> Done:
        if asked.model == "other":
            return Done(detail="following other")
        raise RequestRefusedError(f"no recognizer {asked.model!r}")

    def fixture_controller() -> None:
        with Bus.open(bus.settings, "fixture_controller", "f") as mine:
            mine.answer("activate", ActivateRecognizer, answer)
            mine.announce(mine.keys.presence("fixture_controller", "f"))
            while not over.is_set():
                mine.pump(0.02)

    thread = threading.Thread(target=fixture_controller)
    thread.start()
    try:
        eventually(lambda: bus.alive(bus.keys.presence("fixture_controller")))
        assert activate(bus, "other") == "following other"
        with pytest.raises(SwapError, match="f: no recognizer 'nonesuch'"):
            activate(bus, "nonesuch")
        with pytest.raises(SwapError, match="cannot be part of a key"):
            activate(bus, "a/b")
    finally:
        over.set()
        thread.join()
