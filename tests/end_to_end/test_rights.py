"""Every service, running in a closed cell, declares what the table of rights gives it."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from hmcs.bus.messages import Ask, Description
from hmcs.bus.rights import PEOPLE, Rights, is_within, rights_of, roles
from hmcs.bus.verbs import DESCRIBE
from support.closed_cells import new_closed_cell
from support.stack import CELL, Stack

ROS = importlib.util.find_spec("rclpy") is not None
SERVICES = tuple(role for role in roles() if role not in PEOPLE and (ROS or role != "ros2_bridge"))
MODEL = "human-shapes"


class Closed:
    """A closed cell in which every service runs."""

    def __init__(self, stack: Stack, folder: Path, model_file: Path, performance: Path) -> None:
        self.bus = stack.open_bus("operator", "looks")
        self.stack = stack
        stack.watch(self.bus)
        models = json.dumps([str(model_file)])
        started = [
            stack.start("robot", "robot", "--task", MODEL),
            stack.start("gesteme_classifier", "classifier", "--model", model_file),
            stack.start("task_hmm", "task", "--model", model_file),
            stack.start("recognizer", "recognizer", "--model", model_file),
            stack.start("fixture_controller", "fixture", "--models", models),
            stack.start("recorder", "recorder", "--folder", folder / "takes", "--models", models),
            stack.start("trainer", "trainer", "serve", "--folder", folder / "models"),
            stack.start("console", "console", "--port", 0, "--models", models),
            *([stack.start("ros2_bridge", "bridge")] if ROS else []),
            stack.start(
                "input_device", "device",
                *("--source", "recorded", "--demonstration", performance, "--repeat", 0),
                "--re-engage",
            ),
        ]  # fmt: skip
        stack.until_ready(*started)

    def describe(self) -> dict[str, Description]:
        """Ask every service what it says, hears and answers."""
        return {
            answer.envelope.source.service: answer.body
            for answer in DESCRIBE.ask(self.bus, Ask(), service="*", timeout_s=5.0)
        }


@pytest.fixture(scope="module")
def closed(
    tmp_path_factory: pytest.TempPathFactory, model_file: Path, performance_file: Path
) -> Iterator[Closed]:
    folder = tmp_path_factory.mktemp("closed")
    with Stack(folder, new_closed_cell(folder, CELL)) as stack:
        yield Closed(stack, folder, model_file, performance_file)


@pytest.fixture(scope="module")
def described(closed: Closed) -> dict[str, Description]:
    closed.stack.until(lambda: set(closed.describe()) == set(SERVICES))
    return closed.describe()


def declared(description: Description) -> dict[str, tuple[str, ...]]:
    return {
        "says": description.publishes,
        "hears": description.subscribes,
        "answers": description.answers,
    }


@pytest.mark.parametrize("service", SERVICES)
def test_a_service_declares_nothing_that_the_table_does_not_give_it(
    closed: Closed, described: dict[str, Description], service: str
) -> None:
    given = rights_of(service, closed.bus.keys)
    for right, keys in declared(described[service]).items():
        assert keys or (right == "says" and not given.says), right
        beyond = [key for key in keys if not is_within(key, getattr(given, right))]
        assert beyond == [], right


@pytest.mark.parametrize("service", SERVICES)
def test_the_table_gives_a_service_nothing_that_it_never_uses(
    closed: Closed, described: dict[str, Description], service: str
) -> None:
    keys = closed.bus.keys
    given: Rights = rights_of(service, keys)
    # Heard by a device that is the page's handle: here another drives.
    sometimes = {"input_device": {keys.handle}}.get(service, set())
    for right, used in declared(described[service]).items():
        unused = [
            expression
            for expression in set(getattr(given, right)) - sometimes
            if not any(is_within(key, [expression]) for key in used)
        ]
        assert unused == [], right


def test_every_service_of_a_closed_cell_is_well(closed: Closed) -> None:
    def troubles() -> dict[str, str]:
        healths = {process.service: closed.stack.health(process) for process in running}
        return {name: health.detail for name, health in healths.items() if not health.healthy}

    running = [process for process in closed.stack.processes if process.service in SERVICES]
    closed.stack.until(lambda: not troubles())
