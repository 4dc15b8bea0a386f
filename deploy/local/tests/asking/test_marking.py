"""`hmcs mark` says which part of the task the hand is in."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import numpy as np
import pytest

from hmcs.bus.config import BusSettings
from hmcs.bus.messages import Label, LastSteps, LastStepsQuestion, Origin, Step
from hmcs.bus.session import Bus
from support.asked import CELL, process


@contextmanager
def device(router: str, instance: str, steps: int) -> Iterator[str]:
    """An input device that has made so many steps; yields its clock."""
    over = threading.Event()
    with Bus.open(BusSettings(router=router, cell=CELL), "input_device", instance) as bus:
        last = Step(index=max(steps - 1, 0), position=np.zeros(3), displacement=np.ones(3))
        said = LastSteps(
            clock=bus.source.boot,
            steps=(last,) if steps else (),
            origins=(Origin(boot="b", seq=0, captured_ns=0),) if steps else (),
        )
        bus.answer("last_steps", LastStepsQuestion, lambda _: said)

        def live() -> None:
            while not over.is_set():
                bus.pump(0.01)

        thread = threading.Thread(target=live)
        thread.start()
        try:
            yield bus.source.boot
        finally:
            over.set()
            thread.join()


def test_what_is_marked_is_heard(hmcs: Any, router: str) -> None:
    with process(router, "recorder", {}) as asked:
        ended = hmcs("mark", "approach", "--router", router, "--cell", CELL)
    assert (ended.returncode, asked) == (0, [("label", Label(state="approach"))])


@pytest.mark.parametrize("idle_too", [False, True])
def test_what_is_marked_is_said_of_the_next_step_of_the_device_that_makes_steps(
    hmcs: Any, router: str, idle_too: bool
) -> None:
    with ExitStack() as up:
        asked = up.enter_context(process(router, "recorder", {}))
        if idle_too:
            up.enter_context(device(router, "a-idle", 0))
        clock = up.enter_context(device(router, "b-hand", 7))
        ended = hmcs("mark", "approach", "--router", router, "--cell", CELL)
    assert ended.stdout == "approach from step 7 on\n"
    assert asked == [("label", Label(state="approach", clock=clock, step=7))]


def test_with_two_hands_in_motion_what_is_marked_is_said_of_this_moment(
    hmcs: Any, router: str
) -> None:
    with (
        process(router, "recorder", {}) as asked,
        device(router, "a", 3),
        device(router, "b", 9),
    ):
        ended = hmcs("mark", "approach", "--router", router, "--cell", CELL)
    assert "approach from now on, since 2 input devices make steps" in ended.stdout
    assert asked == [("label", Label(state="approach"))]


def test_where_nobody_writes_down_what_is_marked_that_is_reported(hmcs: Any, router: str) -> None:
    ended = hmcs("mark", "approach", "--router", router, "--cell", CELL)
    assert ended.returncode == 2
    assert "start a recorder" in ended.stderr
