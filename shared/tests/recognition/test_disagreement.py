"""Demonstrations that disagree wholly are reported; sizes, noise and second ways are not."""

from __future__ import annotations

import numpy as np
import pytest

from hmcs.motion.lasa import drawings, shapes
from hmcs.recognition.disagreement import check_agreement, turn_agreement
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


@pytest.mark.parametrize("degrees", [95, 120, 150])
def test_lines_at_more_than_a_right_angle_disagree(degrees):
    angle = np.radians(degrees)
    other = ALONG @ np.array([[np.cos(angle), np.sin(angle), 0], [-1, 0, 0], [0, 0, 1]])
    with pytest.raises(LearningError, match="goes another way"):
        check_agreement(TASK, shown(ALONG, other))


def test_lines_at_half_a_right_angle_agree():
    other = ALONG @ np.array([[0.7, 0.7, 0], [-1, 0, 0], [0, 0, 1]])
    check_agreement(TASK, shown(ALONG, other))


def turning(*ends_rad: float) -> list[Segment]:
    half = [np.linspace(0, end / 2, len(ALONG)) for end in ends_rad]
    quaternions = [np.stack([0 * h, 0 * h, np.sin(h), np.cos(h)], axis=1) for h in half]
    return [
        segment._replace(orientations=turned)
        for segment, turned in zip(shown(*[ALONG] * len(half)), quaternions, strict=True)
    ]


def test_hands_that_turn_alike_are_distinguished_from_those_that_turn_the_other_way():
    every = turn_agreement(turning(1.0, 1.3, 0.8))
    assert every.alike == (0, 1, 2)
    assert turn_agreement(turning(np.pi, -np.pi, -3.0, -3.3)).alike == (1, 2, 3)
    assert turn_agreement(turning(np.pi, -np.pi)).alike == (0,)
    np.testing.assert_allclose(turn_agreement(turning(1.0, -2.0)).apart_rad, [0, 3], atol=1e-6)
