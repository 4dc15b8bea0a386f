"""The task HMM above gesteme HMMs: learned also from stretches of a single step."""

from __future__ import annotations

import numpy as np
import pytest

from hmcs.recognition.task_chain import chain_of
from hmcs_baselines.task_level import (
    GestemeLevelOutput,
    TaskLevelSettings,
    check_task_hmm,
    learn_task_level,
)
from support.lessons import lesson_task

CHAIN = chain_of(lesson_task())


def output_of(states: list[int]) -> GestemeLevelOutput:
    """What sure gesteme HMMs say: states 0 to 3 are performed with gestemes 0, 1, 2 and 1."""
    gestemes = np.array([0, 1, 2, 1])[np.maximum(states, 0)]
    return GestemeLevelOutput(np.eye(3)[gestemes], np.array(states, dtype=np.int64))


def test_a_labeled_stretch_of_a_single_step_is_learned_from() -> None:
    whole = output_of([0] * 9 + [1] * 9 + [2] * 9 + [3] * 9)
    lonely = output_of([-1, 2, -1, -1, 0, -1])
    learned = learn_task_level(CHAIN, [whole, lonely], TaskLevelSettings())
    check_task_hmm(learned, 4, 3)
    assert learned.gestemes[2].argmax() == 2
    only = learn_task_level(CHAIN, [output_of([k]) for k in range(4)], TaskLevelSettings())
    check_task_hmm(only, 4, 3)


def test_states_last_as_long_as_they_were_shown() -> None:
    learned = learn_task_level(
        CHAIN, [output_of([0] * 20 + [1] * 5 + [2] * 10 + [3] * 8)] * 3, TaskLevelSettings()
    )
    stays = 1.0 / (1.0 - np.diagonal(learned.transition))
    np.testing.assert_allclose(stays[:3], [20, 5, 10], rtol=0.05)


def test_what_a_state_is_recognized_by_never_falls_below_the_floor() -> None:
    learned = learn_task_level(
        CHAIN,
        [output_of([0] * 9 + [1] * 9 + [2] * 9 + [3] * 9)],
        TaskLevelSettings(emission_floor=0.02),
    )
    assert learned.gestemes.min() == pytest.approx(0.02)
