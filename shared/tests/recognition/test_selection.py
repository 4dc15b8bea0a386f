"""Choosing settings: what is worse on demonstrations left out is not chosen."""

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs.recognition.segments import LearningError
from hmcs.recognition.selection import choose

ORDER = ["along", "round", "up"]


def test_settings_that_cannot_work_are_not_chosen(task, performances):
    demonstrations = [performances(ORDER, seed) for seed in range(3)]
    reported = []
    selection = choose(
        task,
        demonstrations,
        {"temperature": ["1000", "4"], "phases_per_step": ["0.5"]},
        recognizer="segment-filter",
        progress=lambda done, total: reported.append((done, total)),
    )
    assert selection.settings.temperature == 4.0
    assert reported == [(k, 6) for k in range(1, 7)]
    best, worst = selection.judged
    assert best.chosen["temperature"] == "4"
    assert best.log_probability > worst.log_probability + 0.1
    assert all(np.isfinite([each.log_probability, each.spread]).all() for each in selection.judged)


def test_of_equally_good_settings_the_first_is_taken(task, performances):
    demonstrations = [performances(ORDER, seed) for seed in range(3)]
    selection = choose(
        task,
        demonstrations,
        {"window_limit_steps": ["299", "300"]},
        recognizer="segment-filter",
        given={"temperature": "3"},
    )
    assert selection.settings.window_limit_steps == 299
    assert selection.settings.temperature == 3.0


def test_nothing_to_leave_out_is_reported(task, performances):
    with pytest.raises(LearningError, match="give every gesteme two demonstrations"):
        choose(task, [performances(ORDER, 0)], {"temperature": ["3"]}, recognizer="segment-filter")


def test_an_unknown_setting_is_reported(task, performances):
    demonstrations = [performances(ORDER, seed) for seed in range(2)]
    with pytest.raises(UserError, match="unknown setting 'heat'"):
        choose(task, demonstrations, {"heat": ["3"]}, recognizer="segment-filter")
