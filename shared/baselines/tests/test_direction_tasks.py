from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from hmcs.motion.steps import Step
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.registry import kind_named, recognizer_of, settings_of
from hmcs.recognition.segments import LabeledSteps, labeled_steps
from hmcs.recognition.task_chain import chain_of
from hmcs_baselines.direction_states import DirectionFilter
from hmcs_baselines.direction_tasks import DirectionTaskSettings, direction_shares
from support.lessons import ROUND, lesson_task, performed, steps_performed


@cache
def taught(discovery: str = "recurring-chords", estimator: str = "gaussian") -> Model:
    given = {"directions.discovery": discovery, "directions.estimator.kind": estimator}
    chosen = settings_of(kind_named("directions"), given)
    demonstrations = [performed(seed) for seed in range(4)]
    return learn(lesson_task(), demonstrations, chosen, recognizer="directions")


@pytest.mark.parametrize("discovery", ["chords", "recurring-chords", "kmeans-cusum", "labels"])
@pytest.mark.parametrize("estimator", ["gaussian", "svm"])
def test_task_states_are_recognized_by_directions(discovery: str, estimator: str) -> None:
    model, right, count = taught(discovery, estimator), 0, 0
    for seed in range(60, 63):
        recognizer, labeled = recognizer_of(model), labeled_steps(model.task, performed(seed))
        believed = [int(recognizer.step(step).belief.states.argmax()) for step in labeled.steps]
        right += int((np.array(believed) == labeled.states).sum())
        count += len(believed)
    assert right / count > 0.7


def test_the_task_level_weighs_what_the_direction_level_says() -> None:
    model, steps = taught(), steps_performed(61)
    known = model.knowledge
    recognizer, follow = recognizer_of(model), DirectionFilter(known.directions)
    predicted, state_of = known.chain.initial, chain_of(model.task).slot_state
    for step in steps:
        joint = predicted * (known.shares @ follow.step(step.displacement))
        expected = np.bincount(state_of, weights=joint / joint.sum())
        belief = recognizer.step(step).belief
        np.testing.assert_allclose(belief.states, expected, atol=1e-9)
        np.testing.assert_allclose(belief.log_likelihood, np.log(joint.sum()))
        predicted = joint / joint.sum() @ known.chain.transition


def test_directions_are_counted_where_labels_say_and_floored() -> None:
    step = Step(0, np.zeros(3), np.ones(3))
    labeled = LabeledSteps((step,) * 5, np.array([0, 0, -1, 1, 1]), np.array([0, 0, -1, 1, 1]))
    believed = np.array([[1, 0], [0.5, 0.5], [0, 1], [0, 1], [0, 1]], dtype=float)
    shares = direction_shares(chain_of(lesson_task()), [labeled], [believed], 0.1)
    # The lift was never labeled; turning back has the gesteme of turning.
    np.testing.assert_allclose(shares, [[0.75, 0.25], [0.1, 0.9], [0.5, 0.5], [0.1, 0.9]])


def test_directions_lie_on_the_axes_of_the_task() -> None:
    fields = lesson_task().model_dump()
    fields["recognition"] = {"axes": ["x", "y"]}
    task = type(lesson_task()).model_validate(fields)
    model = learn(task, [performed(seed) for seed in range(3)], recognizer="directions")
    assert model.knowledge.directions.directions.shape[1] == 2
    recognizer = recognizer_of(model)
    for step in steps_performed(62):
        assert np.isfinite(recognizer.step(step).belief.states).all()


def test_the_segment_begins_where_its_state_became_likely() -> None:
    recognizer, state, since = recognizer_of(taught()), None, 0
    for step in steps_performed(63, ROUND * 2):
        belief = recognizer.step(step).belief
        if int(belief.states.argmax()) != state:
            state, since = int(belief.states.argmax()), step.index
        assert belief.segment_start == since


def test_knowledge_that_does_not_fit_is_refused() -> None:
    check, known = kind_named("directions").check, taught().knowledge
    check(known, lesson_task())
    directions = known.directions
    for spoiled in (
        known._replace(shares=known.shares[:, 1:]),
        known._replace(shares=0.0 * known.shares),
        known._replace(directions=directions._replace(directions=directions.directions[:, :2])),
        known._replace(directions=directions._replace(transition=0.5 * directions.transition)),
        known._replace(
            directions=directions._replace(estimator=directions.estimator._replace(variance=0.0))
        ),
    ):
        with pytest.raises(ValueError, match=r"shape|above zero|sum to one|estimator"):
            check(spoiled, lesson_task())


def test_the_defaults_need_no_order_common_to_all_demonstrations() -> None:
    assert DirectionTaskSettings().directions.discovery == "recurring-chords"
    backward = ("lift", "turn", "reach")
    shown = [performed(0), performed(1), performed(2, backward), performed(3, backward)]
    model = learn(lesson_task(), shown, recognizer="directions")
    assert len(model.knowledge.directions.initial) >= 3
