"""Demonstrations cut at their labels: what belongs to which, and what followed."""

from __future__ import annotations

import numpy as np
import pytest

from hmcs.motion.demonstrations import Demonstration
from hmcs.recognition.segments import LearningError, labeled_steps, segments_of
from hmcs.task import Task


def demonstration(states: list[str | None], name: str = "take") -> Demonstration:
    """A centimeter a sample, first along x and then, from the third sample on, along y."""
    count = len(states)
    x, y = np.minimum(np.arange(count), 2), np.maximum(np.arange(count) - 2, 0)
    positions = 0.01 * np.stack([x, y, 0 * x], axis=1)
    return Demonstration(name, np.arange(count) / 10, positions, tuple(states))


def test_what_follows_a_segment_is_the_first_step_of_the_next(task: Task) -> None:
    go, turn = segments_of(task, [demonstration(["go", "go", *["turn"] * 4])])
    assert go.after is not None
    np.testing.assert_allclose(go.after, turn.steps[0].displacement)
    np.testing.assert_allclose(go.after, [0, 0.01, 0], atol=1e-12)
    assert turn.after is None


def test_what_follows_after_a_stretch_without_a_label_is_not_known(task: Task) -> None:
    go, turn = segments_of(task, [demonstration(["go"] * 3 + [None] * 3 + ["turn"] * 4)])
    assert go.after is None
    assert turn.after is None


def test_demonstrations_of_one_name_are_distinguished(task: Task) -> None:
    same = [demonstration(["go"] * 4), demonstration(["go"] * 5)]
    assert [segment.demonstration_index for segment in segments_of(task, same)] == [0, 1]


def test_a_step_has_the_label_of_the_sample_midway_in_it(task: Task) -> None:
    # Three millimeters a sample: a step of the dead zone takes four of them.
    positions = np.arange(13)[:, None] * [0.003, 0.0, 0.0]
    for switch, expected in ((6, [0, 1, 1]), (7, [0, 0, 1]), (2, [1, 1, 1]), (3, [0, 1, 1])):
        states = ("go",) * switch + ("turn",) * (13 - switch)
        found = labeled_steps(task, Demonstration("take", np.arange(13.0), positions, states))
        assert found.states.tolist() == expected, switch


def test_a_label_that_is_no_state_is_quoted_and_can_be_reported_without(task: Task) -> None:
    with pytest.raises(
        LearningError, match=r"label 'goo' at 0.00 s .* did you mean 'go'"
    ) as caught:
        segments_of(task, [demonstration(["goo"] * 4)])
    assert "goo'" not in caught.value.unquoted.replace("'go'", "")
    assert "its label at 0.00 s is no state" in caught.value.unquoted
    with pytest.raises(LearningError) as caught:
        segments_of(task, [demonstration(["x" * 10_000] * 4)])
    assert len(str(caught.value)) < 500
