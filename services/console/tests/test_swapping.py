"""A newcomer is compared before it is activated, and the one before comes back: over the bus."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from hmcs.bus.messages import (
    ActivateRecognizer,
    Ask,
    Belief,
    Done,
    FixtureState,
    LoadModel,
    TrainingProgress,
)
from hmcs.bus.session import RequestRefusedError
from hmcs.recognizer_takeover import activate
from hmcs_console.teaching import requests

MakeCell = Callable[..., Any]
MakeProcess = Callable[..., Any]


class Others:
    """A fixture controller and a recognizer, and two recognizers' beliefs."""

    def __init__(self, cell: Any, make_process: MakeProcess) -> None:
        self.cell, self.step, self.active = cell, 0, "old"
        self.asked: list[str] = []
        self.refuses = ""
        make_process(
            cell,
            "fixture_controller",
            "f",
            {
                "load_model": (LoadModel, lambda asked: self._do("lend", asked.path)),
                "activate": (ActivateRecognizer, self._activate),
            },
        )
        self._load = {"load_model": (LoadModel, lambda asked: self._do("load", asked.path))}
        make_process(cell, "recognizer", "r", self._load)
        bus = cell.other
        self._fixture = bus.publisher(FixtureState, bus.keys.fixture_state)
        self._training = bus.publisher(TrainingProgress, bus.keys.training)
        self._beliefs = {
            name: bus.publisher(Belief, bus.keys.belief(name)) for name in ("old", "mine")
        }
        self.tokens = {
            name: bus.announce(bus.keys.member(name, "recognizer", "r")) for name in self._beliefs
        }
        publishers = [self._fixture, self._training, *self._beliefs.values()]
        cell.until(lambda: all(publisher.matching for publisher in publishers), "the console")

    def go_on(self, condition: Callable[[], object], what: str) -> None:
        """Let the hand move until a condition holds."""

        def moved() -> object:
            self._move()
            self.cell.wait(0.01)
            return condition()

        self.cell.until(moved, what)

    def train(self) -> None:
        """Tell that a model was trained."""
        self._training.put(
            TrainingProgress(
                model="mine", stage="done", detail="learned", share=1.0, path="/m/mine.hmcs"
            )
        )
        seen = self.cell.service._seen
        self.go_on(lambda: len(seen.members) == 2 and seen.active(0.0) == "old", "everybody")
        self.cell.until(lambda: seen.training, "what was trained")

    @property
    def reported(self) -> str:
        return str(self.cell.service._seen.takeover)

    def _move(self) -> None:
        self.step += 1
        for name, belief in self._beliefs.items():
            probabilities = np.array(
                [0.25, 0.75] if name == "mine" or self.step % 2 else [0.75, 0.25]
            )
            belief.put(
                Belief(
                    model_hash="h",
                    clock="c",
                    step=self.step,
                    states=("free", "in"),
                    probabilities=probabilities,
                    likely_gesteme="line",
                    segment_start=0,
                )
            )
        self._fixture.put(
            FixtureState(
                law="general",
                model=self.active,
                state="",
                factor=0.0,
                compliance=1.0,
                preferred_direction=np.zeros(3),
                progress=0.0,
                operator_twist=np.zeros(6),
                command_twist=np.zeros(6),
                wrench=np.zeros(6),
                engaged=True,
                reason="unsure",
            )
        )

    def _do(self, verb: str, what: str) -> Done:
        self.asked.append(verb)
        if verb == self.refuses:
            raise RequestRefusedError("no such file")
        return Done(detail=f"{what} {verb}")

    def _activate(self, asked: ActivateRecognizer) -> Done:
        done = self._do("activate", asked.model)
        self.active = asked.model
        return done


def test_what_was_trained_runs_beside_the_active_one_before_it_is_activated(
    make_cell: MakeCell, make_process: MakeProcess
) -> None:
    cell = make_cell(compare_s=0.6)
    others = Others(cell, make_process)
    others.train()
    cell.service.take_over()
    others.go_on(lambda: "runs beside old" in others.reported, "the comparison")
    assert others.asked == ["lend", "load"]
    others.go_on(lambda: "steps, active in 1 s" in others.reported, "what they agree in")
    others.go_on(lambda: "took over" in others.reported, "the end")
    assert others.asked == ["lend", "load", "activate"]
    assert "beside old: the same likely state in" in others.reported
    others.go_on(lambda: cell.service._seen.active(0.0) == "mine", "the newcomer")
    others.cell.wait(0.2)
    cell.service.back()
    others.go_on(lambda: others.active == "old", "the one before")


def test_who_is_in_a_hurry_waits_for_no_comparison(
    make_cell: MakeCell, make_process: MakeProcess
) -> None:
    cell = make_cell(compare_s=600)
    others = Others(cell, make_process)
    others.train()
    cell.service.take_over()
    others.go_on(lambda: "active in" in others.reported, "the comparison")
    cell.service.activate_now()
    others.go_on(lambda: others.active == "mine", "the newcomer")


@pytest.mark.parametrize("refuses", ["lend", "load", "activate"])
def test_a_refusal_leaves_active_what_was_active(
    make_cell: MakeCell, make_process: MakeProcess, refuses: str
) -> None:
    cell = make_cell(compare_s=0)
    others = Others(cell, make_process)
    others.refuses = refuses
    others.train()
    cell.service.take_over()
    others.go_on(lambda: "old is active still" in others.reported, "the end")
    assert "no such file" in others.reported
    assert others.asked[-1] == refuses
    assert others.active == "old"


@pytest.mark.long
def test_a_recognizer_that_no_process_runs_is_not_activated(
    make_cell: MakeCell, make_process: MakeProcess
) -> None:
    cell = make_cell()
    others = Others(cell, make_process)
    others.train()
    others.tokens["mine"].withdraw()
    cell.until(lambda: not cell.service._seen.runners.run("mine", set()), "the withdrawal")
    cell.service.ask(activate("mine"))
    others.go_on(lambda: "no process that is there runs it" in cell.service.answer, "the reason")
    assert cell.service.answer.startswith("mine is not activated")
    cell.service.ask(activate("made-up"))
    others.go_on(lambda: "made-up is not activated" in cell.service.answer, "the reason")
    assert others.asked == []
    assert others.active == "old"


def test_a_recognizer_is_activated_as_soon_as_a_process_runs_it(
    make_cell: MakeCell, make_process: MakeProcess
) -> None:
    cell = make_cell()
    others = Others(cell, make_process)
    others.train()
    others.tokens["mine"].withdraw()
    cell.until(lambda: not cell.service._seen.runners.run("mine", set()), "the withdrawal")
    cell.service.ask(activate("mine"))
    cell.wait(0.2)
    assert others.asked == []
    cell.other.announce(cell.other.keys.member("mine", "task_hmm", "t"))
    others.go_on(lambda: others.active == "mine", "the newcomer")


def test_a_recognizer_that_is_followed_and_run_by_nobody_is_reported(
    make_cell: MakeCell, make_process: MakeProcess
) -> None:
    cell = make_cell()
    others = Others(cell, make_process)
    others.train()
    seen = cell.service._seen

    def unrun() -> str:
        return str(seen.picture(time.monotonic(), "", None).unrun)

    others.go_on(lambda: seen.active(time.monotonic()) == "old", "the one that is followed")
    assert unrun() == ""
    others.tokens["old"].withdraw()
    others.go_on(lambda: unrun() == "old", "that nobody runs it")
    cell.other.announce(cell.other.keys.member("old", "gesteme_classifier", "c"))
    cell.wait(0.3)
    assert unrun() == "old"
    cell.other.announce(cell.other.keys.member("old", "task_hmm", "t"))
    others.go_on(lambda: unrun() == "", "who runs it")


def test_there_is_no_way_back_before_another_was_active(make_cell: MakeCell) -> None:
    cell = make_cell()
    cell.service.back()
    cell.until(lambda: "no other recognizer" in cell.service.answer, "an answer")


def test_a_training_is_canceled_by_its_trainer(
    make_cell: MakeCell, make_process: MakeProcess
) -> None:
    cell = make_cell()
    make_process(cell, "trainer", "t", {"cancel": (Ask, lambda _: Done(detail="canceled mine"))})

    def canceled() -> bool:
        cell.service.ask(requests.cancel())
        cell.wait(0.1)
        return bool(cell.service.answer == "canceled mine")

    cell.until(canceled, "the trainer")
