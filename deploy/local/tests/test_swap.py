from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from hmcs.bus.router import open_router
from hmcs.bus.session import Bus, BusSettings
from hmcs_local import swap
from hmcs_local.connecting import open_operator
from hmcs_local.control import Control, ControlError
from hmcs_local.observer import speakers
from hmcs_local.stack import LocalStack, with_free_port
from hmcs_local.swap import PartlySwappedError, SwapError, activate, replace_classifier

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
    with open_operator(stack.router, CELL) as bus:
        member = bus.keys.member("*", "gesteme_classifier")
        eventually(lambda: len(bus.alive(member)) == len(stack.instances("gesteme-classifier")))
        yield bus


def running(stack: LocalStack) -> list[str]:
    return [process.instance for process in stack.instances("gesteme-classifier")]


def test_a_classifier_goes_once_its_successor_is_ready(
    stack: LocalStack, bus: Bus, served: Served
) -> None:
    reported: list[str] = []
    control = Control(stack.folder)
    newcomer = served(stack, lambda: replace_classifier(bus, control, OLD, tell=reported.append))
    assert newcomer == "gesteme-classifier-2"
    assert running(stack) == [newcomer]
    assert stack.processes[OLD].exit_code == 0
    assert reported == [
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
    stack: LocalStack, bus: Bus, served: Served, eventually: Eventually
) -> None:
    control = Control(stack.folder)
    with pytest.raises(SwapError, match=f"no classifier 'robot-1' .* choose from {OLD}"):
        served(stack, lambda: replace_classifier(bus, control, "robot-1"))
    with Bus.open(BusSettings(router=stack.router, cell=CELL), "stranger", "s") as other:
        member = other.keys.member("fake", "gesteme_classifier", "elsewhere")
        other.announce(member)
        eventually(lambda: bus.alive(member))
        with pytest.raises(SwapError, match="elsewhere was not started by"):
            served(stack, lambda: replace_classifier(bus, control, "elsewhere"))


@pytest.fixture
def empty_bus() -> Iterator[Bus]:
    router = with_free_port("tcp/127.0.0.1:0")
    with open_router(router), open_operator(router, CELL) as bus:
        # It shows the tokens of others as well.
        bus.rights = None
        yield bus


def run(bus: Bus, model: str, service: str = "recognizer", instance: str = "r") -> None:
    """Show that a process works for a model."""
    bus.announce(bus.keys.member(model, service, instance))


def test_a_recognizer_is_activated_by_every_fixture_controller(
    empty_bus: Bus, fixture_controller: Callable[..., Any], eventually: Eventually
) -> None:
    bus = empty_bus
    run(bus, "other")
    eventually(lambda: "other" in speakers(bus))
    with pytest.raises(SwapError, match="no fixture controller"):
        activate(bus, "other")
    fixture = fixture_controller(bus)
    assert activate(bus, "other") == "follows other"
    second = fixture_controller(bus, instance="g")
    assert activate(bus, "other") == "f: follows other; g: follows other"
    assert fixture.active == second.active == "other"
    fixture.refuses = True
    with pytest.raises(SwapError, match="f: refused: not now; g: follows other"):
        activate(bus, "other")
    with pytest.raises(SwapError, match="cannot be part of a key"):
        activate(bus, "a/b")


def test_a_recognizer_that_nobody_runs_is_refused_and_those_that_are_run_are_named(
    empty_bus: Bus, fixture_controller: Callable[..., Any], eventually: Eventually
) -> None:
    bus, fixture = empty_bus, fixture_controller(empty_bus)
    with pytest.raises(SwapError, match=r"nobody runs .*'other'.*Those that are run: none"):
        activate(bus, "other")
    run(bus, "mine")
    run(bus, "human-shapes", "task_hmm")
    run(bus, "no-belief", "gesteme_classifier")
    bus.announce(bus.keys.member("other", "recognizer", "x").removesuffix("x") + "evil name")
    eventually(lambda: len(bus.alive(bus.keys.member("*"))) == 3)
    for name in ("other", "no-belief"):
        with pytest.raises(SwapError, match=r"Those that are run: human-shapes, mine$"):
            activate(bus, name)
    assert fixture.asked == []


def test_a_fixture_that_does_not_answer_keeps_no_other_from_following(
    empty_bus: Bus, fixture_controller: Callable[..., Any], eventually: Eventually
) -> None:
    bus, fixture = empty_bus, fixture_controller(empty_bus)
    run(bus, "other")
    bus.announce(bus.keys.presence("fixture_controller", "a-ghost"))
    eventually(lambda: len(bus.alive(bus.keys.presence())) == 2)
    eventually(lambda: "other" in speakers(bus))
    with pytest.raises(PartlySwappedError, match=r"a-ghost: did not answer.*f: follows other"):
        activate(bus, "other")
    assert fixture.active == "other"


@pytest.mark.parametrize("how", [KeyboardInterrupt, SwapError, SystemExit, RuntimeError])
def test_a_newcomer_goes_again_whatever_keeps_it_from_taking_over(
    stack: LocalStack,
    bus: Bus,
    served: Served,
    monkeypatch: pytest.MonkeyPatch,
    how: type[BaseException],
) -> None:
    def fail(*_: Any) -> None:
        raise how("at this very moment")

    monkeypatch.setattr(swap, "until_ready", fail)
    reported: list[str] = []

    def replace() -> str:
        try:
            return replace_classifier(bus, Control(stack.folder), OLD, tell=reported.append)
        except BaseException as error:  # of a thread, none gets through
            return type(error).__name__

    assert served(stack, replace) == how.__name__
    assert running(stack) == [OLD]
    assert reported[-1] == "gesteme-classifier-2 is stopped again"


def test_an_interrupt_while_a_process_is_being_started_stops_it_again(
    stack: LocalStack,
) -> None:
    stopped = []

    class Interrupted(Control):
        def start(self, service: str, command: object = None) -> str:
            signal.raise_signal(signal.SIGINT)
            return f"{service}-7"

        def stop(self, instance: str) -> int:
            stopped.append(instance)
            return 0

    with pytest.raises(KeyboardInterrupt), swap.started(Interrupted(stack.folder), "a"):
        pytest.fail("it goes on")
    assert stopped == ["a-7"]


def test_what_cannot_be_stopped_again_is_reported(stack: LocalStack) -> None:
    class Deaf(Control):
        def start(self, service: str, command: object = None) -> str:
            return f"{service}-7"

        def stop(self, instance: str) -> int:
            raise ControlError("no answer")

    with (
        pytest.raises(SwapError, match=r"no motion; a-7 could not be stopped: no answer"),
        swap.started(Deaf(stack.folder), "a"),
    ):
        raise SwapError("no motion")
