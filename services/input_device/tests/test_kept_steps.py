"""The last steps: as a list of all of them would give them."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hmcs.bus.messages import LastStepsQuestion, Origin, Step
from hmcs_input_device.kept_steps import KeptSteps

MOST = 7


def step_of(index: int) -> Step:
    numbers = np.arange(6.0) + 10.0 * index
    return Step(
        index=index,
        position=numbers[:3],
        displacement=-numbers[3:],
        orientation=np.array([0.0, 0.0, 0.6, 0.8]) if index % 2 else None,
        wrench=numbers / 3.0 if index % 3 else None,
        mark=index % 5 == 1,
    )


def origin_of(index: int) -> Origin:
    return Origin(boot="mine", seq=3 * index, captured_ns=10**15 + index)


@given(made=st.integers(0, 20), count=st.integers(1, 10), before=st.none() | st.integers(0, 25))
def test_a_question_is_answered_as_from_a_list(made: int, count: int, before: int | None) -> None:
    kept = KeptSteps(MOST)
    for index in range(made):
        kept.keep(step_of(index), origin_of(index))
    everything = range(max(made - MOST, 0), made)
    expected = [i for i in everything if before is None or i < before][-count:]

    answer = kept.asked(LastStepsQuestion(count=count, before=before), "mine")
    assert answer.clock == "mine"
    assert list(answer.origins) == [origin_of(index) for index in expected]
    assert [step.index for step in answer.steps] == expected
    for step in answer.steps:
        for field, value in step_of(step.index):
            np.testing.assert_array_equal(getattr(step, field), value)
