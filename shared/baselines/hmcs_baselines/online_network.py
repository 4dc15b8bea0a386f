"""Li and Okamura's continuous online network of gesteme HMMs (2.34–2.35)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.steps import Step
from hmcs.recognition.belief_builder import BeliefBuilder
from hmcs.recognition.model import Model
from hmcs.recognition.recognizer import Recognition, Recognizer
from hmcs.recognition.registry import RecognizerSpec, TrainingData
from hmcs.recognition.task_chain import TaskChain, chain_of
from hmcs_baselines.classifying import (
    GestemeClassifier,
    Gestemes,
    check_gestemes,
    learn_gestemes,
)
from hmcs_baselines.gesteme_hmms import GestemeHmmSettings
from hmcs_baselines.observing import ObservationSettings, Observed
from hmcs_baselines.restarting import CusumSettings
from hmcs_baselines.task_level import gesteme_shares


class OnlineNetworkSettings(NamedTuple):
    """The choices of the online network."""

    observations: Observed = "direction"
    """What the gesteme HMMs observe; the paper's HMMs are continuous."""
    observing: ObservationSettings = ObservationSettings()
    """Numbers of symbols, and the windows."""
    gestemes: GestemeHmmSettings = GestemeHmmSettings()
    """How gesteme HMMs are learned."""


class OnlineNetwork:
    """Says which gesteme is performed; states that share one share its probability."""

    def __init__(self, model: Model, *, anywhere: bool) -> None:
        """Begin as the task does or, with `anywhere`, in any of its states."""
        chain = chain_of(model.task, anywhere=anywhere)
        self._state_given_gesteme = state_given_gesteme(chain, len(model.task.gestemes))
        self._classifier = GestemeClassifier(
            model.knowledge, model.axes, "network", CusumSettings()
        )
        self._beliefs = BeliefBuilder()

    def step(self, step: Step) -> Recognition:
        """Take the next step; steps come in order, without gaps."""
        classification = self._classifier.step(step)
        cells = self._state_given_gesteme * classification.gestemes
        return self._beliefs.recognition(
            step.index, cells.sum(axis=1), cells, classification.log_likelihood
        )


def state_given_gesteme(chain: TaskChain, gestemes: int) -> Array:
    """Return P(state | gesteme) before anything is seen, shape (S, M); columns sum to one.

    By how often the task's chain visits each state in as many segments as there are states. A
    gesteme of no state says nothing of them.
    """
    visits, segment = np.zeros_like(chain.initial), chain.initial
    for _ in chain.initial:
        visits = visits + segment
        segment = segment @ chain.transition
    shares = gesteme_shares(chain, gestemes)
    joint = visits[:, None] * shares
    joint = np.where(joint.any(axis=0), joint, shares)
    joint = np.where(joint.any(axis=0), joint, 1.0)
    return np.asarray(joint / joint.sum(axis=0))


def _learn(data: TrainingData) -> Gestemes:
    settings: OnlineNetworkSettings = data.settings
    return learn_gestemes(
        data, settings.observations, settings.observing, settings.gestemes, complete=True
    )


def _recognizer(model: Model, anywhere: bool) -> Recognizer:
    return OnlineNetwork(model, anywhere=anywhere)


KIND = RecognizerSpec(
    name="online-network",
    summary="gesteme HMMs that are all always restarted, from the end of any; no task HMM",
    source="Li & Okamura 2003, as Aarno 2007, 2.34–2.35 gives it",
    settings=OnlineNetworkSettings,
    knowledge=Gestemes,
    learn=_learn,
    recognizer=_recognizer,
    check=check_gestemes,
)
