"""Peers come, go and bear impossible names: what a classifier holds follows from who is there."""

from __future__ import annotations

import logging
import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from hmcs.bus.router import open_router
from hmcs.bus.session import Bus, BusSettings
from hmcs.recognition.model_file import save_model
from hmcs.task import Task
from hmcs_gesteme_classifier.service import GestemeClassifier
from hmcs_gesteme_classifier.settings import GestemeClassifierSettings
from support.made_up import line_model

LOG = logging.getLogger("hmcs.test")
GESTEMES = [f"g{k}" for k in range(8)]
MODEL = "eight"


@pytest.fixture(scope="module")
def eight_gestemes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model file of eight gestemes, all the same line."""
    task = Task.model_validate(
        {
            "format": "hmcs-task/1",
            "name": MODEL,
            "dead_zone_m": 0.005,
            "gestemes": [{"name": name} for name in GESTEMES],
            "states": [{"name": "only", "gestemes": GESTEMES, "next": {}}],
            "start": {"only": 1.0},
            "workspace": {"lower_m": [-1, -1, 0], "upper_m": [1, 1, 1]},
            "robot": {
                "model": "puma560",
                "tool_start_m": [0.6, 0, 0.5],
                "tool_orientation_xyzw": [0, 0, 0, 1],
            },
        }
    )
    one = line_model(MODEL, task, np.array([[0.0, 0, 0], [0.5, 0, 0]]))
    knowledge = one.knowledge
    parameters = knowledge.parameters
    repeated = {
        name: np.repeat(value, len(GESTEMES), axis=0)
        for name, value in parameters._asdict().items()
        if isinstance(value, np.ndarray) and value.shape[:1] == (1,)
    }
    senses = parameters.senses._replace(
        means=np.repeat(parameters.senses.means, len(GESTEMES), axis=0),
        variances=np.repeat(parameters.senses.variances, len(GESTEMES), axis=0),
    )
    model = one._replace(
        knowledge=knowledge._replace(parameters=parameters._replace(**repeated, senses=senses)),
        path_points=one.path_points * len(GESTEMES),
        path_spreads=one.path_spreads * len(GESTEMES),
    )
    path = tmp_path_factory.mktemp("eight") / "eight.hmcs"
    save_model(model, path)
    return path


@pytest.fixture
def join() -> Iterator[Callable[[str], Bus]]:
    """Open buses of classifiers on a router of their own."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        endpoint = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    opened = []
    with open_router(endpoint):

        def open_bus(instance: str) -> Bus:
            settings = BusSettings(router=endpoint, connect_timeout_s=30)
            opened.append(Bus.open(settings, "gesteme_classifier", instance, log=LOG))
            return opened[-1]

        yield open_bus
        for bus in opened:
            bus.close()


def classifier(bus: Bus, model: Path) -> GestemeClassifier:
    settings = GestemeClassifierSettings(model=model, redundancy=1, instance="fresh")
    return GestemeClassifier(settings, bus, LOG)


def announce(bus: Bus, instance: str) -> None:
    bus.announce(bus.keys.member(MODEL, "gesteme_classifier", instance))


def held(service: GestemeClassifier) -> set[str]:
    return {name for name in service.facts()["gestemes"].split(", ") if name}


def pump_until(bus: Bus, condition: Callable[[], object]) -> None:
    deadline_s = time.monotonic() + 20
    while not condition():
        assert time.monotonic() < deadline_s, "did not come about in time"
        bus.pump(0.05)


def seen_by(bus: Bus, *instances: str) -> bool:
    keys = bus.keys
    wanted = [keys.member(MODEL, "gesteme_classifier", instance) for instance in instances]
    return bus.alive(keys.member(MODEL, "gesteme_classifier")) == sorted(wanted)


def test_what_a_peer_holds_is_taken_over_when_it_goes(
    join: Callable[[str], Bus], eight_gestemes: Path
) -> None:
    old, bus = join("old"), join("fresh")
    announce(old, "old")
    pump_until(bus, lambda: seen_by(bus, "old"))
    service = classifier(bus, eight_gestemes)
    service.start()
    assert 0 < len(held(service)) < len(GESTEMES)
    old.close()
    pump_until(bus, lambda: held(service) == set(GESTEMES))


def test_a_peer_that_goes_while_the_newcomer_gets_ready_is_no_peer(
    join: Callable[[str], Bus], eight_gestemes: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old, watcher, bus = join("old"), join("watcher"), join("fresh")
    announce(old, "old")
    pump_until(bus, lambda: seen_by(bus, "old"))
    service = classifier(bus, eight_gestemes)
    begin = service._feed.begin

    def while_it_goes() -> None:
        begin()
        old.close()
        pump_until(watcher, lambda: seen_by(watcher))

    monkeypatch.setattr(service._feed, "begin", while_it_goes)
    service.start()
    assert len(held(service)) < len(GESTEMES)
    pump_until(bus, lambda: held(service) == set(GESTEMES))


def test_a_peer_that_comes_while_the_newcomer_gets_ready_is_given_its_share(
    join: Callable[[str], Bus], eight_gestemes: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other, bus = join("old"), join("fresh")
    service = classifier(bus, eight_gestemes)
    begin = service._feed.begin

    def while_it_comes() -> None:
        begin()
        announce(other, "old")

    monkeypatch.setattr(service._feed, "begin", while_it_comes)
    service.start()
    pump_until(bus, lambda: 0 < len(held(service)) < len(GESTEMES))


@pytest.mark.parametrize("when", ["before", "after"])
@pytest.mark.parametrize("name", ["evil name", "\x1b[2Jx", "n" * 300])
def test_a_token_of_an_impossible_name_is_counted_and_is_no_peer(
    join: Callable[[str], Bus], eight_gestemes: Path, when: str, name: str
) -> None:
    stranger, bus = join("stranger"), join("fresh")
    service = classifier(bus, eight_gestemes)
    token = stranger.keys.member(MODEL, "gesteme_classifier", "x").removesuffix("x") + name
    if when == "before":
        stranger.announce(token)
        pump_until(bus, lambda: bus.present(bus.keys.member(MODEL)).strangers)
    service.start()
    if when == "after":
        stranger.announce(token)
    pump_until(bus, lambda: bus.counters.refused["presence"])
    assert held(service) == set(GESTEMES)


def test_what_goes_wrong_when_a_peer_goes_is_made_good_later(
    join: Callable[[str], Bus], eight_gestemes: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old, bus = join("old"), join("fresh")
    announce(old, "old")
    pump_until(bus, lambda: seen_by(bus, "old"))
    service = classifier(bus, eight_gestemes)
    service.start()
    hold = service._hold

    def once(_: frozenset[int]) -> None:
        monkeypatch.setattr(service, "_hold", hold)
        raise RuntimeError("one failure")

    monkeypatch.setattr(service, "_hold", once)
    old.close()
    with pytest.raises(RuntimeError, match="one failure"):
        pump_until(bus, lambda: False)
    pump_until(bus, lambda: held(service) == set(GESTEMES))
