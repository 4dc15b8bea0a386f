from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from hmcs.motion.quaternions import between
from hmcs.motion.steps import Step, steps_of_demonstration
from hmcs.recognition.hmm import inference
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.registry import recognizer_of, segmentation_of
from hmcs.recognition.segments import LearningError, Segment, labeled_steps
from hmcs.recognition.step_features import Sensors, StepFeatureReader, step_features
from hmcs.recognition.task_chain import chain_of
from hmcs.task import Task
from hmcs_baselines.gaussian_task_hmm import (
    GaussianTaskHmmSettings,
    slot_log_emission,
)
from hmcs_baselines.slots import learn_slot_chain
from support.lessons import ROUND, lesson_task, performed, steps_performed

STRICT = GaussianTaskHmmSettings(any_state=0.0)


@cache
def taught(settings: GaussianTaskHmmSettings = STRICT) -> Model:
    demonstrations = [performed(seed) for seed in range(4)]
    return learn(lesson_task(), demonstrations, settings, recognizer="task-hmm")


def branching() -> Task:
    """Like the lesson, but after `reach` either a turn or, three times as often, the lift."""
    fields = lesson_task().model_dump()
    fields["states"][0]["next"] = {"turn": 0.25, "lift": 0.75}
    fields["states"][3]["next"] = {}
    return Task.model_validate(fields)


def lasting(state: int, gesteme: int, steps: int) -> Segment:
    step = Step(0, np.zeros(3), np.ones(3))
    return Segment("any", state, gesteme, np.zeros((2, 3)), (step,) * steps)


def test_the_filter_is_the_forward_algorithm() -> None:
    model, steps = taught(), steps_performed(50)
    hmm = model.knowledge
    seen = slot_log_emission(hmm, step_features(steps, hmm.sensors, model.axes))
    alpha = inference.forward(hmm.chain.initial, hmm.chain.transition, seen)
    filtered = np.exp(alpha - np.logaddexp.reduce(alpha, axis=1)[:, None])
    recognizer, total = recognizer_of(model), 0.0
    for step, expected, joint in zip(steps, filtered, alpha, strict=True):
        belief = recognizer.step(step).belief
        total += belief.log_likelihood
        np.testing.assert_allclose(belief.states, expected, atol=1e-9)
        np.testing.assert_allclose(total, np.logaddexp.reduce(joint), rtol=1e-9)


def test_dwell_times_and_branches_are_those_of_2_33() -> None:
    # Means of 4, 6, 3 and 2 steps: 3, 5, 2 and 1 sample periods from first to last sample.
    stays = {0: (3, 5), 1: (6,), 2: (2, 3, 4), 3: (2,)}
    gestemes = {0: 0, 1: 1, 2: 2, 3: 1}
    segments = [lasting(q, gestemes[q], n) for q, own in stays.items() for n in own]
    chain = learn_slot_chain(chain_of(branching()), segments, 0.0)
    by_hand = np.array(
        [
            [3 / 4, 1 / 4 * 0.25, 1 / 4 * 0.75, 0],
            [0, 5 / 6, 1 / 6, 0],
            [0, 0, 2 / 3, 1 / 3],
            [0, 0, 0, 1],
        ]
    )
    np.testing.assert_allclose(chain.transition, by_hand)
    np.testing.assert_array_equal(chain.initial, [1, 0, 0, 0])


def test_a_share_of_every_step_may_go_to_any_state() -> None:
    segments = [lasting(q, (0, 1, 2, 1)[q], 4) for q in range(4)]
    strict = learn_slot_chain(chain_of(lesson_task()), segments, 0.0)
    free = learn_slot_chain(chain_of(lesson_task()), segments, 0.08)
    np.testing.assert_allclose(free.transition, 0.92 * strict.transition + 0.02)
    np.testing.assert_allclose(free.initial, 0.92 * strict.initial + 0.02)


def test_means_and_variances_are_those_of_the_labeled_sensors() -> None:
    demonstration = performed(3)
    model = learn(lesson_task(), [demonstration], STRICT, recognizer="task-hmm")
    hmm = model.knowledge
    begin, end = (demonstration.states.index(s) for s in ("turn", "lift"))
    steps = segment_steps(model, begin, end)
    rows = step_features(steps, ("direction", "turn", "force", "torque"), (0, 1, 2))
    np.testing.assert_allclose(hmm.means[1], np.nanmean(rows, axis=0))
    spread = STRICT.least_spread
    floor = np.repeat([spread.direction, spread.turn, spread.force, spread.torque], 3) ** 2
    np.testing.assert_allclose(hmm.variances[1], np.maximum(np.nanvar(rows, axis=0), floor))


def segment_steps(model: Model, begin: int, end: int) -> tuple[Step, ...]:
    return tuple(steps_of_demonstration(performed(3).cut(begin, end + 1), model.task.dead_zone_m))


def test_a_state_never_left_by_the_task_is_not_left_without_backtracking() -> None:
    model = learn(branching(), [performed(s) for s in range(3)], STRICT, recognizer="task-hmm")
    recognizer = recognizer_of(model)
    believed = [
        int(recognizer.step(step).belief.states.argmax()) for step in steps_performed(9, ROUND * 2)
    ]
    assert believed == sorted(believed)
    assert believed[-1] == 3


def test_viterbi_finds_the_segments_of_a_performance() -> None:
    model, demonstration = taught(), performed(77)
    labeled = labeled_steps(model.task, demonstration)
    found = segmentation_of(model, labeled.steps)
    assert [each.state for each in found] == [0, 1, 2, 3]
    states = np.repeat([each.state for each in found], [each.stop - each.start for each in found])
    assert (states == labeled.states).mean() > 0.95
    assert min(each.probability for each in found) > 0.8


def test_a_sensor_that_falls_silent_is_left_out() -> None:
    hmm = taught().knowledge
    rows = step_features(steps_performed(8), hmm.sensors, (0, 1, 2))
    silent = rows.copy()
    silent[:, 6:] = np.nan
    without = hmm._replace(means=hmm.means[:, :6], variances=hmm.variances[:, :6])
    np.testing.assert_allclose(
        slot_log_emission(hmm, silent)[1:], slot_log_emission(without, rows[:, :6])[1:]
    )


def test_demonstrations_of_motion_alone_are_enough() -> None:
    bare = [performed(s)._replace(orientations=None, wrenches=None) for s in range(2)]
    model = learn(lesson_task(), bare, recognizer="task-hmm")
    assert model.knowledge.sensors == ("direction",)
    off = GaussianTaskHmmSettings(sensors=Sensors(direction=False))
    with pytest.raises(LearningError, match="switch one of direction, length"):
        learn(lesson_task(), bare, off, recognizer="task-hmm")


def test_a_state_never_demonstrated_looks_like_its_gesteme() -> None:
    model = learn(lesson_task(), [performed(0, ROUND[:3])], STRICT, recognizer="task-hmm")
    np.testing.assert_array_equal(model.knowledge.means[3], model.knowledge.means[1])


def test_the_gesteme_performed_is_reported_where_a_state_has_several() -> None:
    fields = lesson_task().model_dump()
    fields["states"] = [
        {"name": "move", "gestemes": ["reach", "lift"], "next": ["turn"]},
        {"name": "turn", "gestemes": ["turn"], "next": ["move"]},
    ]
    fields["start"] = ["move"]
    names = {"reach": "move/reach", "lift": "move/lift", "turn": "turn", "turn-back": "turn"}
    shown = [performed(seed) for seed in range(3)]
    shown = [each._replace(states=tuple(names[str(s)] for s in each.states)) for each in shown]
    model = learn(Task.model_validate(fields), shown, recognizer="task-hmm")
    for doing, gesteme in (("reach", 0), ("lift", 2)):
        recognizer = recognizer_of(model)
        for step in steps_performed(40, (doing,)):
            belief = recognizer.step(step).belief
        assert belief.states[0] > 0.9
        assert belief.gesteme == gesteme


@pytest.mark.parametrize("angle_rad", [0.3, -0.3, 3.0])
def test_a_turn_is_the_rotation_between_two_orientations(angle_rad: float) -> None:
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    before = np.array([0.5, 0.5, 0.5, 0.5])
    s, c = math.sin(angle_rad / 2), math.cos(angle_rad / 2)
    x, y, z = s * axis
    # after = turn · before, as the matrix of a multiplication from the left.
    left = np.array([[c, -z, y, x], [z, c, -x, y], [-y, x, c, z], [-x, -y, -z, c]])
    after = left @ before
    for sign in (1.0, -1.0):
        np.testing.assert_allclose(between(before, sign * after), angle_rad * axis, atol=1e-12)
    np.testing.assert_array_equal(between(before, before), np.zeros(3))


def test_the_first_step_has_no_turn_and_one_without_motion_on_the_axes_no_direction() -> None:
    reader = StepFeatureReader(("direction", "turn", "length"), (0, 1))
    up = Step(0, np.zeros(3), np.array([0.0, 0.0, 0.1]), np.array([0.0, 0.0, 0.0, 1.0]))
    row = reader.step(up)
    np.testing.assert_array_equal(row, [0, 0, np.nan, np.nan, np.nan, 0.1])
