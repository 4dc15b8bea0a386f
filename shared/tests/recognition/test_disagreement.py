"""Demonstrations that disagree wholly are told; sizes, noise and second ways are not."""

from __future__ import annotations

import numpy as np
import pytest

from hmcs.motion.lasa import drawings, shapes
from hmcs.recognition.disagreement import check_agreement
from hmcs.recognition.segments import LearningError, Segment
from hmcs.task import load_task

TASK = load_task("lines-through-obstacles")
ALONG = np.linspace([0.0, 0, 0], [0.2, 0, 0], 40)


def shown(*motions: np.ndarray) -> list[Segment]:
    return [Segment(f"take-{k}", 0, 0, motion, ()) for k, motion in enumerate(motions, start=1)]


def test_one_that_goes_the_other_way_is_named_with_its_state_and_a_remedy():
    with pytest.raises(LearningError, match=r"'take-3', state 'lift'.*'up'.*Leave out"):
        check_agreement(TASK, shown(ALONG, 1.3 * ALONG, -ALONG))


@pytest.mark.parametrize("size", [0.3, 1.0, 4.0])
def test_sizes_and_places_do_not_disagree(size):
    check_agreement(TASK, shown(ALONG, size * ALONG + [0.5, -0.2, 0.1]))


def test_a_second_way_that_was_shown_twice_is_one():
    check_agreement(TASK, shown(ALONG, -ALONG, ALONG, -ALONG))


def test_one_demonstration_cannot_disagree():
    check_agreement(TASK, shown(ALONG))


def test_people_who_draw_one_shape_agree():
    for shape in shapes():
        motions = [np.c_[drawn, np.zeros(len(drawn))] for _, drawn in drawings(shape)]
        check_agreement(TASK, shown(*motions))
