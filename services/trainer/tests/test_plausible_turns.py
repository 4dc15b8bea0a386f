"""Turns of the hand that disagree are reported."""

from __future__ import annotations

import numpy as np

from hmcs.motion.demonstrations import Demonstration
from hmcs.recognition.learning import learn
from support.carried import TASK, shown, texts, turned


def half_turn(sign: float, seed: int) -> Demonstration:
    return turned(shown(seed), sign * np.pi * np.clip((np.arange(600) - 200) / 199, 0, 1))


def test_of_two_ways_round_one_is_learned_and_the_other_reported() -> None:
    every = [half_turn(1, 0), half_turn(-1, 1), half_turn(-1, 2)]
    (text,) = texts(*every)
    assert text.startswith(
        "take-0.csv: in 'bring' the hand turns up to 360° otherwise than in take-1"
    )
    ends = learn(TASK, every).turns["over"].quaternions[-1]
    np.testing.assert_allclose(np.abs(ends), [0, 0, 1, 0], atol=1e-6)


def test_turns_that_differ_a_little_are_all_learned() -> None:
    every = [turned(shown(seed), np.linspace(0, 1 + 0.1 * seed, 600)) for seed in range(3)]
    assert not texts(*every)


def test_orientations_in_some_files_only_are_reported() -> None:
    (text, *_) = texts(half_turn(1, 0), shown(1))
    assert "take-1.csv: it has no orientations" in text
