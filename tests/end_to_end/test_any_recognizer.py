"""Every registered recognizer runs as a service, and says there what it says in process."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hmcs.bus.keys import recognizer_in
from hmcs.bus.messages import Belief
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import save_model
from hmcs.recognition.registry import kinds, recognizer_of
from hmcs.translation import belief_message
from hmcs_local.swap import activate, load
from support.hand import Scene
from support.lessons import lesson_task, performed, steps_performed


@pytest.fixture(scope="module")
def taught(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Model, Path]]:
    """A model and its file for every kind of recognizer, named as the kind is."""
    folder = tmp_path_factory.mktemp("taught")
    demonstrations = [performed(seed) for seed in range(3)]
    models = {}
    for kind in kinds():
        model = learn(lesson_task(), demonstrations, recognizer=kind.name)
        path = folder / f"{kind.name}.hmcs"
        models[kind.name] = (save_model(model._replace(name=kind.name), path), path)
    return models


def said(scene: Scene, name: str) -> list[Belief]:
    return [
        received.body
        for received in scene.watcher.beliefs
        if recognizer_in(received.key).model == name
    ]


def test_every_recognizer_says_over_the_bus_what_it_says_in_process(
    scene: Scene, taught: dict[str, tuple[Model, Path]]
) -> None:
    stack, steps = scene.stack, steps_performed(50)
    processes = [
        stack.start("recognizer", name, "--model", path) for name, (_, path) in taught.items()
    ]
    stack.until(lambda: {p.instance for p in processes} <= {m.instance for m in stack.present}, 60)
    scene.hand.play(steps, 200.0)
    stack.until(lambda: all(len(said(scene, name)) == len(steps) for name in taught), 30)
    for name, (model, _) in taught.items():
        recognizer = recognizer_of(model)
        for over, step in zip(said(scene, name), steps, strict=True):
            within = belief_message(model, recognizer.step(step), scene.hand.clock)
            np.testing.assert_array_equal(over.probabilities, within.probabilities, name)
            assert over.model_dump(exclude={"probabilities"}) == within.model_dump(
                exclude={"probabilities"}
            )
    assert [process.stop() for process in processes] == [0] * len(processes)


def test_a_late_joiner_replays_the_last_steps_and_then_says_the_same(
    scene: Scene, taught: dict[str, tuple[Model, Path]]
) -> None:
    stack, steps = scene.stack, steps_performed(51)
    model, path = taught["segment-filter"]
    for step in steps[:60]:
        scene.hand.keep(step)
    stack.bring_up("recognizer", "late", "--model", path)
    scene.in_step(steps[60:90])
    recognizer = recognizer_of(model)
    expected = [recognizer.step(step).belief.states for step in steps[:90]]
    for belief, states in zip(said(scene, "segment-filter"), expected[60:], strict=True):
        np.testing.assert_array_equal(belief.probabilities, states)


def test_a_running_recognizer_of_another_kind_is_swapped_in(
    scene: Scene, taught: dict[str, tuple[Model, Path]]
) -> None:
    stack, steps = scene.stack, steps_performed(52)
    names = ("segment-filter", min(set(taught) - {"segment-filter"}))
    files = [taught[name][1] for name in names]
    fixture = stack.start(
        "fixture_controller", "f", "--models", f'["{files[0]}"]', "--active-model", names[0]
    )
    services = [
        stack.start("recognizer", n, "--model", f) for n, f in zip(names, files, strict=True)
    ]
    stack.until_ready(fixture, *services)
    model = taught[names[1]][0]
    assert load(scene.bus, str(files[1])) == f"model {names[1]} {model.hash} is loaded"
    scene.hand.play(steps[:30], 100.0)
    stack.until(lambda: stack.health(fixture).received.get("belief", 0) >= 60)
    assert activate(scene.bus, names[1]) == f"follows {names[1]} {model.hash}"


def test_a_model_for_one_process_is_refused_by_classifiers_with_what_to_do(
    scene: Scene, taught: dict[str, tuple[Model, Path]]
) -> None:
    name = min(set(taught) - {"segment-filter"})
    process = scene.stack.start("gesteme_classifier", "c", "--model", taught[name][1])
    assert process.wait(15.0) == 2
    assert "start hmcs_recognizer with it instead" in "\n".join(process.last_lines())
