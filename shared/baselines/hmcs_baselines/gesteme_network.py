"""Hundtofte's network of gesteme HMMs: offline segmentation, and online filtering beside it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hmcs.motion.steps import Step
from hmcs.recognition.belief_builder import BeliefBuilder
from hmcs.recognition.model import Model, axes_of
from hmcs.recognition.recognizer import Recognition, Recognizer
from hmcs.recognition.registry import RecognizerSpec, TrainingData
from hmcs.recognition.segmentation import StateSegment
from hmcs.recognition.task_chain import chain_of
from hmcs_baselines.concatenated import (
    Network,
    NetworkKnowledge,
    NetworkScores,
    NetworkSettings,
    check_network,
    joined,
    learn_network,
    most_probable_segments,
)
from hmcs_baselines.hmm.bank import ForwardBank


def segment(model: Model, steps: Sequence[Step], anywhere: bool) -> tuple[StateSegment, ...]:
    """Return the segments of a whole motion, one step at least, by Viterbi: what the paper does.

    With `anywhere` the motion may begin in any state.
    """
    network, scores = _network(model, anywhere)
    log_emission = np.stack([scores.log_emission(step) for step in steps])
    return most_probable_segments(network, log_emission, steps[0].index)


class GestemeNetwork:
    """Filters the state of the network, step by step."""

    def __init__(self, model: Model, *, anywhere: bool) -> None:
        """Begin as the task does or, with `anywhere`, in any of its states."""
        self._network, self._scores = _network(model, anywhere)
        self._filter = ForwardBank(self._network.initial[None], self._network.transition[None])
        self._cells = (len(model.task.states), len(model.task.gestemes))
        self._beliefs = BeliefBuilder()

    def step(self, step: Step) -> Recognition:
        """Take the next step; steps come in order, without gaps."""
        gain = self._filter.step(self._scores.log_emission(step)[None])
        cells = np.zeros(self._cells)
        np.add.at(cells, (self._network.task_state, self._network.gesteme), self._filter.states[0])
        return self._beliefs.recognition(step.index, cells.sum(axis=1), cells, float(gain[0]))


def _network(model: Model, anywhere: bool) -> tuple[Network, NetworkScores]:
    network = joined(model.knowledge, chain_of(model.task, anywhere=anywhere))
    return network, NetworkScores(model.knowledge, network, model.axes, model.task.dead_zone_m)


def _learn(data: TrainingData) -> NetworkKnowledge:
    task = data.task
    return learn_network(
        data.segments, len(task.gestemes), axes_of(task), task.dead_zone_m, data.settings
    )


def _recognizer(model: Model, anywhere: bool) -> Recognizer:
    return GestemeNetwork(model, anywhere=anywhere)


KIND = RecognizerSpec(
    name="gesteme-network",
    summary="Gaussian gesteme HMMs joined by the task's network into one, filtered online",
    source="Hundtofte, Hager & Okamura 2002, as Aarno 2007, 2.3 describes it; online is ours",
    settings=NetworkSettings,
    knowledge=NetworkKnowledge,
    learn=_learn,
    recognizer=_recognizer,
    check=check_network,
    segment=segment,
)
