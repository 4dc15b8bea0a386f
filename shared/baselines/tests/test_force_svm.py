from __future__ import annotations

import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from sklearn.svm import SVC

from hmcs.recognition.hmm import inference
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model, save_model
from hmcs.recognition.registry import kind_named, recognizer_of, segmentation_of
from hmcs.recognition.segments import LearningError, labeled_steps, segments_of
from hmcs.task import Task
from hmcs_baselines.estimators import SupportVectors
from hmcs_baselines.force_svm import (
    Components,
    ForceSettings,
    category_likelihoods,
)
from support.lessons import ROUND, lesson_task, performed, steps_performed

TEXT = ForceSettings()


@cache
def taught(chosen: ForceSettings = TEXT) -> Model:
    demonstrations = [performed(seed) for seed in range(4)]
    return learn(lesson_task(), demonstrations, chosen, recognizer="force-svm")


def learned_wrenches() -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    segments = segments_of(lesson_task(), [performed(seed) for seed in range(4)])
    rows = np.array([step.wrench for each in segments for step in each.steps], dtype=float)
    categories = np.repeat([s.gesteme for s in segments], [len(s.steps) for s in segments])
    return rows, categories


def test_categories_are_distinguished_by_scikit_learns_machines() -> None:
    sharp = TEXT._replace(estimator=TEXT.estimator._replace(least_ratio=0.0))
    model, steps = taught(sharp), steps_performed(30)
    rows, categories = learned_wrenches()
    center = rows.mean(axis=0)
    scale = np.where(rows.std(axis=0) > 0, rows.std(axis=0), 1.0)
    seen = (np.array([step.wrench for step in steps], dtype=float) - center) / scale
    g = np.empty((len(steps), 3))
    for category in range(3):
        machine = SVC(C=10.0, gamma=0.5).fit((rows - center) / scale, categories == category)
        g[:, category] = 1.0 / (1.0 + np.exp(-2.0 * machine.decision_function(seen)))
    others = np.stack([np.delete(1.0 - g, k, axis=1).prod(axis=1) for k in range(3)], axis=1)
    likelihood = g * others / (np.bincount(categories) / len(categories))
    expected = likelihood / likelihood.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(category_likelihoods(model.knowledge, steps), expected, atol=1e-7)


def test_the_filter_is_the_forward_algorithm_with_categories_shared() -> None:
    model, steps = taught(), steps_performed(31)
    chain = model.knowledge.chain
    categories = category_likelihoods(model.knowledge, steps)
    seen = np.log(categories)[:, [0, 1, 2, 1]]
    alpha = inference.forward(chain.initial, chain.transition, seen)
    expected = np.exp(alpha - np.logaddexp.reduce(alpha, axis=1)[:, None])
    recognizer = recognizer_of(model)
    found = np.array([recognizer.step(step).belief.states for step in steps])
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_viterbi_segments_a_performance_into_sub_tasks_that_share_a_category() -> None:
    model = taught()
    labeled = labeled_steps(model.task, performed(32))
    found = segmentation_of(model, labeled.steps)
    assert [each.state for each in found] == [0, 1, 2, 3]
    states = np.repeat([each.state for each in found], [each.stop - each.start for each in found])
    assert (states == labeled.states).mean() > 0.95
    assert min(each.probability for each in found) > 0.8


def test_the_force_decides_however_the_hand_moves() -> None:
    still = [step._replace(displacement=np.ones(3)) for step in steps_performed(33)]
    assert segmentation_of(taught(), still) == segmentation_of(taught(), steps_performed(33))


def test_components_that_are_not_looked_at_do_not_matter() -> None:
    one = TEXT._replace(components=Components(False, False, True, False, False, False))
    model = taught(one)
    assert model.knowledge.components == (2,)
    changed = []
    for step in steps_performed(34):
        assert step.wrench is not None
        changed.append(step._replace(wrench=np.where(np.arange(6) == 2, step.wrench, 99.0)))
    assert segmentation_of(model, changed) == segmentation_of(model, steps_performed(34))
    with pytest.raises(LearningError, match="switch one on"):
        taught(TEXT._replace(components=Components(*(False,) * 6)))


def test_without_force_the_direction_of_motion_takes_its_place() -> None:
    shown = [performed(seed) for seed in range(3)]
    shown[1] = shown[1]._replace(wrenches=None)
    reported: list[str] = []
    model = learn(lesson_task(), shown, recognizer="force-svm", progress=reported.append)
    assert model.knowledge.observed == "direction"
    assert any("directions of motion" in line for line in reported)
    recognizer = recognizer_of(model)
    labeled = labeled_steps(model.task, performed(35))
    believed = [int(recognizer.step(step).belief.states.argmax()) for step in labeled.steps]
    assert (np.array(believed) == labeled.states).mean() > 0.6


def test_steps_without_the_force_that_was_learned_from_tell_nothing() -> None:
    model = taught()
    silent = [step._replace(wrench=None) for step in steps_performed(36)[:5]]
    np.testing.assert_allclose(category_likelihoods(model.knowledge, silent), 1 / 3)
    recognizer = recognizer_of(model)
    chain, expected = model.knowledge.chain, model.knowledge.chain.initial
    for step in silent:
        np.testing.assert_allclose(recognizer.step(step).belief.states, expected)
        expected = expected @ chain.transition


def test_a_task_of_one_category_has_nothing_to_tell_apart() -> None:
    fields = lesson_task().model_dump()
    fields["gestemes"] = [{"name": "turn"}]
    fields["states"] = [{"name": "turn", "gestemes": ["turn"], "next": {}}]
    fields["start"] = ["turn"]
    task = Task.model_validate(fields)
    model = learn(task, [performed(0, ("turn",))], recognizer="force-svm")
    recognizer = recognizer_of(model)
    for step in steps_performed(1, ("turn",)):
        np.testing.assert_allclose(recognizer.step(step).belief.states, [1.0])


def test_a_saved_model_runs_without_scikit_learn(tmp_path: Path) -> None:
    save_model(taught(), tmp_path / "force.hmcs")
    loaded = load_model(tmp_path / "force.hmcs")
    assert isinstance(loaded.knowledge.estimator, SupportVectors)
    code = (
        "import sys; sys.modules['sklearn'] = None; import numpy as np\n"
        "from hmcs.motion.steps import Step\n"
        "from hmcs.recognition.model_file import load_model\n"
        "from hmcs.recognition.registry import recognizer_of, segmentation_of\n"
        "recognizer = recognizer_of(load_model(sys.argv[1]))\n"
        "step = Step(0, np.zeros(3), np.ones(3), None, np.array([4.0, 0, 0, 0, 0, 0]))\n"
        "print(recognizer.step(step).belief.states.argmax())\n"
    )
    run = [sys.executable, "-c", code, str(tmp_path / "force.hmcs")]
    assert subprocess.run(run, capture_output=True, text=True, check=True).stdout == "0\n"


def test_knowledge_that_does_not_fit_is_refused() -> None:
    check, known = kind_named("force-svm").check, taught().knowledge
    check(known, lesson_task())
    for spoiled in (
        known._replace(components=(0, 1, 2, 3, 4, 6)),
        known._replace(center=known.center[:5]),
        known._replace(scale=0.0 * known.scale),
        known._replace(chain=known.chain._replace(initial=known.chain.initial[:3])),
        known._replace(chain=known.chain._replace(transition=2 * known.chain.transition)),
        known._replace(estimator=known.estimator._replace(least_ratio=-1.0)),
    ):
        with pytest.raises(ValueError, match=r"expected|sum to one|above zero|estimator"):
            check(spoiled, lesson_task())


def test_sub_tasks_are_recognized_in_the_round() -> None:
    recognizer, steps = recognizer_of(taught()), steps_performed(37, ROUND * 2)
    starts = [k for k, step in enumerate(steps) if step.mark]
    true = np.repeat(np.arange(8) % 4, np.diff([*starts, len(steps)]))
    believed = [int(recognizer.step(step).belief.states.argmax()) for step in steps]
    assert (np.array(believed) == true).mean() > 0.9
