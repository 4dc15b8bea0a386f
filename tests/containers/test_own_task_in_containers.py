"""A task of one's own in containers: its folder mounted, its name in HMCS_TASK, nothing else."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import pytest

from hmcs.bus.messages import Ask, Description, Health, Train, TrainingProgress
from hmcs.bus.session import Bus
from hmcs.bus.verbs import TRAIN
from hmcs.recognizer_takeover import activate, load_into_fixture, load_into_recognizer

pytestmark = pytest.mark.containers

TASK = "/tasks/reach-and-lift.yaml"
STAY = {"input_device", "fixture_controller", "robot", "recognizer", "recorder", "trainer"}
END = ("gesteme-classifier", "task-hmm", "teach")

Pump = Callable[..., None]


@pytest.fixture(scope="module")
def variables() -> Mapping[str, str]:
    return {"HMCS_TASK": TASK, "HMCS_TASK_FOLDER": "./examples/data"}


def test_what_is_of_the_demo_alone_ends_and_the_rest_is_healthy(
    bus: Bus, containers: Any, pump_until: Pump
) -> None:
    keys = bus.keys

    def there() -> set[str]:
        return {keys.member_of(key).service for key in bus.alive(keys.presence())}

    pump_until(lambda: there() >= STAY | {"console"})
    answers = bus.ask(keys.rpc("*", "*", "health"), Ask(), Health, timeout_s=3.0)
    assert [each.body.detail for each in answers if not each.body.healthy] == []

    def ended() -> list[tuple[str, int]]:
        states = [
            state for name, state in containers.states().items() if any(end in name for end in END)
        ]
        return [(state["Status"], state["ExitCode"]) for state in states]

    pump_until(lambda: ended() == [("exited", 0)] * 4)


def test_the_page_moves_the_hand_of_the_task(bus: Bus) -> None:
    answers = bus.ask(bus.keys.rpc("input_device", "*", "describe"), Ask(), Description)
    facts = answers[0].body.facts
    assert (facts["source"], facts["task"]) == ("page", "reach-and-lift")


def test_what_is_trained_there_is_followed(bus: Bus, pump_until: Pump) -> None:
    told: list[TrainingProgress] = []
    bus.subscribe(TrainingProgress, bus.keys.training, lambda got: told.append(got.body))
    hands = tuple(f"/tasks/hand-{k}.csv" for k in (1, 2, 3))
    TRAIN.ask(bus, Train(model="mine", task=TASK, demonstrations=hands), timeout_s=20.0)
    pump_until(lambda: told and told[-1].stage in ("done", "failed", "canceled"))
    assert told[-1].stage == "done", told[-1].detail
    for question in (
        load_into_fixture(told[-1].path),
        load_into_recognizer(told[-1].path),
        activate("mine"),
    ):
        (said,) = question.verb.ask(bus, question.body, service=question.service, timeout_s=20.0)
        assert said.body.detail
    answers = bus.ask(bus.keys.rpc("fixture_controller", "*", "describe"), Ask(), Description)
    assert answers[0].body.facts["active_model"] == "mine"
