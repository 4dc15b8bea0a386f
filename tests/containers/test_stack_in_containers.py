"""The stack of compose.yaml in a real Docker engine. The tests follow each other on one stack."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import pytest

from hmcs.bus.messages import Ask, Belief, Description, Health
from hmcs.bus.session import Bus

pytestmark = pytest.mark.containers

SERVICES = {
    *("input_device", "gesteme_classifier", "task_hmm", "fixture_controller", "robot"),
    *("recognizer", "recorder", "trainer", "console"),
}
CLASSIFIER = "gesteme_classifier"
STEPS_AFTER = 20
"""Steps watched after a swap: two seconds and more of motion."""

Pump = Callable[..., None]


def members(bus: Bus) -> set[str]:
    """The containers of classifiers that are replayed and ready."""
    keys = bus.keys
    return {keys.member_of(key).instance for key in bus.alive(keys.member("*", CLASSIFIER))}


def test_belief_reaches_the_robot_while_the_hand_moves(assisted: Any) -> None:
    assert assisted.moving.stop == "none"
    assert assisted.guiding.factor > 0
    assert assisted.guiding.state in assisted.belief.states


def test_every_service_is_there_and_says_it_is_healthy(bus: Bus, pump_until: Pump) -> None:
    keys = bus.keys
    pump_until(
        lambda: {keys.member_of(key).service for key in bus.alive(keys.presence())} >= SERVICES
    )
    answers = bus.ask(bus.keys.rpc("*", "*", "health"), Ask(), Health, timeout_s=3.0)
    assert {answer.envelope.source.service for answer in answers} == SERVICES
    assert [answer.body.detail for answer in answers if not answer.body.healthy] == []


def test_docker_finds_every_container_healthy(containers: Any, pump_until: Pump) -> None:
    def health() -> dict[str, str]:
        states = containers.states().items()
        return {name: state["Health"]["Status"] for name, state in states if "Health" in state}

    pump_until(lambda: set(health().values()) == {"healthy"})
    assert len(health()) == len(SERVICES) + 2  # the second classifier and the router


def test_an_instance_is_named_as_its_container(bus: Bus, containers: Any) -> None:
    assert members(bus) == set(containers.ids("gesteme-classifier"))


def test_services_run_as_nobody_in_particular_and_without_tools_to_build(
    containers: Any,
) -> None:
    for name in containers.ids("robot") + containers.ids("router"):
        assert containers.docker("exec", name, "id", "-u").strip() != "0"
        found = containers.docker(
            "exec", name, "sh", "-c", "command -v gcc cc make uv; python -m uv 2>/dev/null; true"
        )
        assert found == ""


def test_classifiers_can_be_scaled_while_it_runs(
    bus: Bus, containers: Any, pump_until: Pump
) -> None:
    containers.compose(
        *("up", "--detach", "--no-build", "--no-recreate", "--no-deps"),
        *("--scale", "gesteme-classifier=3", "gesteme-classifier"),
    )
    pump_until(lambda: len(members(bus)) == 3)


def test_a_classifier_killed_and_replaced_costs_no_step(
    bus: Bus, containers: Any, pump_until: Pump
) -> None:
    beliefs: list[Belief] = []
    bus.subscribe(Belief, bus.keys.belief(), lambda got: beliefs.append(got.body))
    pump_until(lambda: beliefs)
    killed = containers.ids("gesteme-classifier")[0]
    containers.docker("rm", "--force", killed)
    containers.compose(
        *("up", "--detach", "--no-build", "--no-recreate", "--no-deps"),
        *("--scale", "gesteme-classifier=3", "gesteme-classifier"),
    )
    pump_until(lambda: killed not in members(bus) and len(members(bus)) == 3)
    last = len(beliefs) + STEPS_AFTER
    pump_until(lambda: len(beliefs) >= last)
    steps = [belief.step for belief in beliefs]
    assert steps == list(range(steps[0], steps[0] + len(steps)))
    assert len({belief.clock for belief in beliefs}) == 1
    assert [belief.missing_gestemes for belief in beliefs if belief.missing_gestemes] == []


def test_services_say_what_they_are(bus: Bus) -> None:
    answers = bus.ask(bus.keys.rpc("fixture_controller", "*", "describe"), Ask(), Description, 3.0)
    assert [answer.body.facts["active_model"] for answer in answers] == ["human-shapes"]


def test_everything_stops_within_ten_seconds_with_exit_code_0(containers: Any) -> None:
    began_s = time.monotonic()
    containers.compose("stop")
    took_s = time.monotonic() - began_s
    codes = {name: state["ExitCode"] for name, state in containers.states().items()}
    assert [name for name, code in codes.items() if code != 0] == []
    assert took_s < 10
