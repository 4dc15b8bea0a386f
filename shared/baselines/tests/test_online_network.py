from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.registry import recognizer_of, segmentation_of
from hmcs.recognition.segments import labeled_steps
from hmcs.recognition.serialization import Content, ContentError, from_arrays
from hmcs.recognition.task_chain import TaskChain, chain_of
from hmcs_baselines.gesteme_hmms import GestemeScores
from hmcs_baselines.layered_hmm import ONLINE_NETWORK
from hmcs_baselines.observing import Observer
from hmcs_baselines.restarting import NetworkLevel
from hmcs_baselines.task_level import state_given_gesteme
from hmcs_baselines.two_levels import LayeredHmmSettings, TwoLevels
from support.lessons import ROUND, lesson_task, performed, steps_performed


@cache
def taught() -> Model:
    demonstrations = [performed(seed) for seed in range(4)]
    return learn(lesson_task(), demonstrations, recognizer="online-network")


def test_states_are_as_probable_as_the_gestemes_they_are_performed_with() -> None:
    model = taught()
    gestemes = model.knowledge.gestemes
    observer, scores = Observer(gestemes.observing, model.axes), GestemeScores(gestemes.hmms)
    level, recognizer = NetworkLevel(gestemes.hmms.chains), recognizer_of(model)
    for step in steps_performed(50):
        observation = observer.step(step)
        assert observation is not None
        reach, turn, lift = level.step(step.index, scores.log_emission(observation), mark=False)[0]
        states = recognizer.step(step).belief.states
        np.testing.assert_allclose(states, [reach, turn / 2, lift, turn / 2], atol=1e-12)


def test_gestemes_are_recognized_whatever_their_order() -> None:
    recognizer, right = recognizer_of(taught()), 0
    order = tuple(reversed(ROUND))
    steps = steps_performed(60, order)
    true = labeled_steps(lesson_task(), performed(60, order)).gestemes
    for step, gesteme in zip(steps, true, strict=True):
        right += recognizer.step(step).belief.gesteme == gesteme
    assert right / len(steps) > 0.8


def test_it_is_the_layered_hmm_on_directions_without_a_task_hmm() -> None:
    settings = LayeredHmmSettings(observations="direction", evidence="none")
    layered = learn(
        lesson_task(), [performed(seed) for seed in range(4)], settings, recognizer="lhmm"
    )
    one, other = recognizer_of(layered), recognizer_of(taught())
    for step in steps_performed(50):
        np.testing.assert_array_equal(one.step(step).belief.states, other.step(step).belief.states)


@pytest.mark.parametrize("plain", [None, [], "x", {"observing": {}}, {"observing": {}, "hmms": 1}])
def test_knowledge_of_an_older_form_that_is_broken_is_refused(plain: Any) -> None:
    with pytest.raises(ContentError):
        from_arrays(TwoLevels, Content(ONLINE_NETWORK.from_older(plain), {}))


def sequence(gestemes: list[int], initial: int = 0, *, around: bool = False) -> TaskChain:
    count = len(gestemes)
    transition = np.diag(np.ones(count - 1), 1)
    transition[-1, 0] = float(around)
    return TaskChain(
        np.eye(count)[initial],
        transition,
        np.arange(count, dtype=np.int32),
        np.array(gestemes, dtype=np.int32),
        np.ones(count),
    )


def test_a_gesteme_of_two_states_is_shared_by_how_often_the_task_visits_them() -> None:
    once = state_given_gesteme(sequence([0, 1, 2, 1, 3]), 4)
    np.testing.assert_allclose(once[:, 1], [0, 0.5, 0, 0.5, 0])
    np.testing.assert_allclose(once[:, 3], [0, 0, 0, 0, 1])
    # Begun after its first arc, the task never comes to it.
    late = state_given_gesteme(sequence([0, 1, 2, 1, 3], initial=2), 4)
    np.testing.assert_allclose(late[:, 1], [0, 0, 0, 1, 0])
    around = state_given_gesteme(sequence([0, 1, 2, 1], initial=2, around=True), 3)
    np.testing.assert_allclose(around[:, 1], [0, 0.5, 0, 0.5])


def test_states_of_several_gestemes_gather_what_is_theirs() -> None:
    task = lesson_task()
    chain = chain_of(task)._replace(
        slot_state=np.array([0, 1, 1, 2, 3], dtype=np.int32),
        slot_gesteme=np.array([0, 0, 1, 2, 1], dtype=np.int32),
        slot_share=np.array([1, 0.5, 0.5, 1, 1]),
    )
    shared = state_given_gesteme(chain, 3)
    np.testing.assert_allclose(shared[:, 0], [2 / 3, 1 / 3, 0, 0])
    np.testing.assert_allclose(shared[:, 1], [0, 1 / 3, 0, 2 / 3])
    np.testing.assert_allclose(shared.sum(axis=0), 1.0)


def test_a_kind_without_offline_segmentation_names_those_that_have_it() -> None:
    with pytest.raises(UserError, match=r"'online-network'.*train one of segment-filter,.*lhmm"):
        segmentation_of(taught(), steps_performed(5))
