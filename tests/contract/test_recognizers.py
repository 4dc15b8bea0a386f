"""What every registered recognizer promises, whatever it is made of."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from hmcs.motion.steps import Step
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model, save_model
from hmcs.recognition.recognizer import BadStepError, Recognition
from hmcs.recognition.registry import kinds, recognizer_of, segmentation_of
from support.lessons import ROUND, lesson_task, performed, steps_performed

NAMES = [kind.name for kind in kinds()]


@cache
def taught(name: str) -> Model:
    return learn(lesson_task(), [performed(seed) for seed in range(4)], recognizer=name)


@cache
def motion() -> tuple[Step, ...]:
    return tuple(steps_performed(100, ROUND * 2))


def recognized(model: Model, steps: tuple[Step, ...]) -> list[Recognition]:
    recognizer = recognizer_of(model)
    return [recognizer.step(step) for step in steps]


def assert_equal(some: list[Recognition], others: list[Recognition]) -> None:
    for one, other in zip(some, others, strict=True):
        np.testing.assert_array_equal(one.belief.states, other.belief.states)
        assert one.belief._replace(states=None) == other.belief._replace(states=None)
        assert one._replace(belief=None, evidence=None) == other._replace(
            belief=None, evidence=None
        )
        for reported, expected in zip(one.evidence or (), other.evidence or (), strict=True):
            np.testing.assert_array_equal(reported, expected)


@pytest.mark.parametrize("name", [kind.name for kind in kinds() if kind.segment is not None])
def test_segments_cover_a_motion_without_gaps(name: str) -> None:
    model = taught(name)
    steps = [step._replace(index=step.index + 7) for step in motion()]
    for anywhere in (False, True):
        found = segmentation_of(model, steps, anywhere=anywhere)
        assert found[0].start == 7
        assert found[-1].stop == 7 + len(steps)
        for one, other in pairwise(found):
            assert one.stop == other.start
        for segment in found:
            assert segment.start < segment.stop
            assert 0 <= segment.probability <= 1 + 1e-9
            if segment.state is not None and segment.gesteme is not None:
                gesteme = model.task.gestemes[segment.gesteme].name
                assert gesteme in model.task.states[segment.state].gestemes


@pytest.mark.parametrize("name", NAMES)
def test_beliefs_are_finite_and_sum_to_one(name: str) -> None:
    model = taught(name)
    for step, recognition in zip(motion(), recognized(model, motion()), strict=True):
        belief = recognition.belief
        assert belief.step == step.index
        assert belief.states.shape == (len(ROUND),)
        assert belief.states.min() >= 0
        assert 0 <= belief.unknown <= 1
        np.testing.assert_allclose(belief.states.sum() + belief.unknown, 1.0, atol=1e-9)
        assert np.isfinite([belief.log_likelihood, recognition.mean_log_likelihood]).all()
        assert 0 <= belief.segment_start <= step.index
        likely = model.task.states[int(belief.states.argmax())]
        assert model.gesteme_names[belief.gesteme] in likely.gestemes


@pytest.mark.parametrize("name", NAMES)
def test_recognition_is_better_than_guessing(name: str) -> None:
    model = taught(name)
    true = [ROUND[k % 4] for k in range(8)]
    switch = [k for k, step in enumerate(motion()) if step.mark] + [len(motion())]
    right = 0
    for state, begin, end in zip(true, switch[:-1], switch[1:], strict=True):
        believed = [r.belief.states.argmax() for r in recognized(model, motion())[begin:end]]
        right += believed.count(model.state_names.index(state))
    assert right / len(motion()) > 0.5


@pytest.mark.parametrize("name", NAMES)
def test_a_belief_depends_on_no_later_step(name: str) -> None:
    half = motion()[: len(motion()) // 2]
    assert_equal(recognized(taught(name), motion())[: len(half)], recognized(taught(name), half))


@pytest.mark.parametrize("name", NAMES)
def test_learning_and_recognizing_twice_is_the_same_and_so_is_the_saved_model(
    name: str, tmp_path: Path
) -> None:
    again = learn(lesson_task(), [performed(seed) for seed in range(4)], recognizer=name)
    one = save_model(taught(name), tmp_path / "one.hmcs")
    assert save_model(again, tmp_path / "other.hmcs").hash == one.hash
    expected = recognized(taught(name), motion())
    assert_equal(recognized(again, motion()), expected)
    assert_equal(recognized(load_model(tmp_path / "one.hmcs"), motion()), expected)


@pytest.mark.parametrize("name", NAMES)
def test_a_gesteme_of_one_step_is_survived(name: str) -> None:
    steps = list(motion()[:20])
    last = steps[-1]
    aside = np.array([0.0, -0.03, 0.02])
    steps.append(Step(20, last.position + last.displacement, aside, last.orientation, last.wrench))
    for k, step in enumerate(motion()[40:60], start=21):
        steps.append(step._replace(index=k, position=steps[-1].position + steps[-1].displacement))
    for recognition in recognized(taught(name), tuple(steps)):
        assert np.isfinite(recognition.belief.states).all()
        np.testing.assert_allclose(
            recognition.belief.states.sum() + recognition.belief.unknown, 1.0, atol=1e-9
        )


@pytest.mark.parametrize("name", NAMES)
def test_it_may_begin_in_the_middle(name: str) -> None:
    recognizer = recognizer_of(taught(name), anywhere=True)
    begin = len(motion()) // 3
    for step in motion()[begin:]:
        belief = recognizer.step(step).belief
        np.testing.assert_allclose(belief.states.sum() + belief.unknown, 1.0, atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("field", ["position", "displacement", "wrench"])
def test_what_is_no_number_is_refused_and_changes_nothing(name: str, field: str) -> None:
    recognizer = recognizer_of(taught(name))
    for step in motion()[:10]:
        recognizer.step(step)
    spoiled = np.array(getattr(motion()[10], field))
    spoiled[0] = np.nan
    with pytest.raises(BadStepError, match=f"step 10: {field}"):
        recognizer.step(motion()[10]._replace(**{field: spoiled}))
    after = [recognizer.step(step) for step in motion()[10:20]]
    assert_equal(after, recognized(taught(name), motion()[:20])[10:])


@pytest.mark.parametrize("name", NAMES)
def test_a_step_out_of_order_is_refused(name: str) -> None:
    recognizer = recognizer_of(taught(name))
    recognizer.step(motion()[0])
    with pytest.raises(BadStepError, match="step 2 came, expected 1"):
        recognizer.step(motion()[2])


@pytest.mark.parametrize("name", NAMES)
def test_one_demonstration_is_enough_to_begin(name: str) -> None:
    model = learn(lesson_task(), [performed(0)], recognizer=name)
    for recognition in recognized(model, motion()[:40]):
        np.testing.assert_allclose(
            recognition.belief.states.sum() + recognition.belief.unknown, 1.0, atol=1e-9
        )
