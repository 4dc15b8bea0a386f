"""Offline segmentation by the segment filter against enumeration of every segmentation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.recognition.learning import learn
from hmcs.recognition.registry import segmentation_of
from hmcs.recognition.segment_filter.filter import SegmentFilter
from hmcs.recognition.segment_filter.offline import OfflineSegmenter
from hmcs.recognition.segmentation import label_of
from hmcs.recognition.segments import labeled_steps
from support.lessons import ROUND, lesson_task, performed
from support.segmentations import (
    SETTINGS,
    UNKNOWN,
    enumerate_segmentations,
    random_chain,
    random_evidence,
)


def as_segments(chain, history):
    """(state, gesteme, start, stop) of a history of hypotheses."""
    found = []
    for t, hypothesis in enumerate(history):
        if hypothesis == UNKNOWN:
            if found and found[-1][0] is None:
                found[-1] = (*found[-1][:3], t + 1)
            else:
                found.append((None, None, t, t + 1))
        else:
            slot, start = hypothesis
            own = (int(chain.slot_state[slot]), int(chain.slot_gesteme[slot]), start)
            if found and found[-1][:3] == own:
                found.pop()
            found.append((*own, t + 1))
    return found


tiny = given(
    seed=st.integers(0, 10_000),
    steps=st.integers(1, 5),
    shared=st.booleans(),
    hole=st.booleans(),
)


def tiny_model(seed, steps, shared, hole):
    rng = np.random.default_rng(seed)
    chain = random_chain(rng, shared=shared)
    absent = {(steps - 1, 1)} if hole and steps > 1 else set()
    return chain, random_evidence(rng, steps, absent=absent)


@tiny
@settings(max_examples=30)
def test_smoothing_is_exact_over_every_segmentation(seed, steps, shared, hole):
    chain, evidence = tiny_model(seed, steps, shared, hole)
    posterior = OfflineSegmenter(chain, SETTINGS, evidence).posterior()
    states, unknown = np.zeros((steps, 2)), np.zeros(steps)
    for history, weight in enumerate_segmentations(chain, evidence):
        for t, hypothesis in enumerate(history):
            if hypothesis == UNKNOWN:
                unknown[t] += weight
            else:
                states[t, chain.slot_state[hypothesis[0]]] += weight
    total = states.sum(axis=1) + unknown
    np.testing.assert_allclose(posterior.states, states / total[:, None], atol=1e-12)
    np.testing.assert_allclose(posterior.unknown, unknown / total, atol=1e-12)


@tiny
@settings(max_examples=30)
def test_the_segmentation_is_the_heaviest_of_all(seed, steps, shared, hole):
    chain, evidence = tiny_model(seed, steps, shared, hole)
    segmenter = OfflineSegmenter(chain, SETTINGS, evidence)
    found, posterior = segmenter.segments(), segmenter.posterior()
    weights: dict[tuple, float] = {}
    for history, weight in enumerate_segmentations(chain, evidence):
        weights[tuple(as_segments(chain, history))] = weight
    heaviest = max(weights, key=weights.__getitem__)
    assert tuple(segment[:4] for segment in found) == heaviest
    for segment in found:
        own = posterior.unknown if segment.state is None else posterior.states[:, segment.state]
        assert segment.probability == pytest.approx(own[segment.start : segment.stop].mean())


@given(seed=st.integers(0, 10_000))
@settings(max_examples=10)
def test_of_the_last_step_it_believes_what_the_filter_does(seed):
    rng = np.random.default_rng(seed)
    chain, evidence = random_chain(rng), random_evidence(rng, 12)
    task_filter = SegmentFilter(chain, SETTINGS)
    for item in evidence:
        belief = task_filter.step(item)
    posterior = OfflineSegmenter(chain, SETTINGS, evidence).posterior()
    np.testing.assert_allclose(posterior.states[-1], belief.states, atol=1e-12)
    assert posterior.unknown[-1] == pytest.approx(belief.unknown, abs=1e-12)


def test_a_demonstration_nobody_learned_from_is_cut_where_its_labels_change() -> None:
    task = lesson_task()
    model = learn(task, [performed(seed) for seed in range(4)])
    labeled = labeled_steps(task, performed(60))
    found = segmentation_of(model, labeled.steps)
    assert [label_of(task, segment) for segment in found] == list(ROUND)
    edges = [0, *(np.flatnonzero(np.diff(labeled.states)) + 1), len(labeled.steps)]
    np.testing.assert_allclose([each.start for each in found], edges[:-1], atol=2)
    assert [each.stop for each in found[:-1]] == [each.start for each in found[1:]]
    assert found[-1].stop == len(labeled.steps)
    assert min(segment.probability for segment in found) > 0.8


def test_a_motion_that_is_no_part_of_the_task_is_unknown() -> None:
    task = lesson_task()
    model = learn(task, [performed(seed) for seed in range(4)])
    steps = list(labeled_steps(task, performed(60)).steps)
    strange = [
        step._replace(index=len(steps) + k, displacement=-step.displacement * (1, -1, 1))
        for k, step in enumerate(steps[:20])
    ]
    found = segmentation_of(model, steps + strange)
    assert any(segment.state is None and segment.start >= len(steps) - 3 for segment in found)


def test_no_steps_have_no_segments() -> None:
    model = learn(lesson_task(), [performed(0)])
    assert segmentation_of(model, []) == ()
