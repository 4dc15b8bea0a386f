"""The two layers in one object, and what a model has them do."""

import numpy as np
import pytest

from hmcs.motion.steps import steps_of
from hmcs.recognition.recognizer import StepEvidence
from hmcs.recognition.segment_filter.recognizer import (
    SegmentFilterRecognizer,
    TaskFilter,
    bank_of,
    filter_of,
)


@pytest.fixture(scope="module")
def steps(performances, task):
    return steps_of(performances(["up", "along"], 99).positions, task.dead_zone_m)


def test_a_bank_of_no_gestemes_holds_none(model):
    assert bank_of(model, []).held == ()
    assert bank_of(model, [2, 0]).held == (0, 2)
    assert bank_of(model).held == (0, 1, 2)


def test_it_begins_with_the_first_state_of_the_task_or_anywhere(model, steps):
    first = SegmentFilterRecognizer(model).step(steps[0]).belief.states
    anywhere = SegmentFilterRecognizer(model, anywhere=True).step(steps[0]).belief.states
    np.testing.assert_array_equal(first[1:], 0.0)
    assert anywhere.argmax() == 2


def test_only_evidence_that_is_passed_reaches_the_task_and_is_reported(model, steps):
    def lost(made):
        kept = made.pair_gesteme != 1
        return StepEvidence(
            made.step,
            (0, 2),
            made.pair_gesteme[kept],
            made.pair_start[kept],
            made.exit[kept],
            made.log_ratio[kept],
        )

    recognizer, bank = SegmentFilterRecognizer(model, passed=lost), bank_of(model)
    layers = TaskFilter(model)
    for step in steps[:12]:
        made, found = lost(bank.step(step)), recognizer.step(step)
        assert found.belief.missing == (1,)
        assert found.evidence.gestemes == (0, 2)
        np.testing.assert_array_equal(found.evidence.log_ratio, made.log_ratio)
        np.testing.assert_array_equal(found.belief.states, layers.step(made).belief.states)


def test_the_filter_goes_by_the_settings_of_its_model(model):
    settings = model.knowledge.filter_settings._replace(unknown_after=0.3)
    changed = model._replace(knowledge=model.knowledge._replace(filter_settings=settings))
    none = np.zeros(0, dtype=np.int32)
    nothing = StepEvidence(0, (), none, none, np.zeros(0), np.zeros(0))
    assert filter_of(changed).step(nothing).unknown == pytest.approx(0.3)
