"""Gesteme HMMs in parallel and a task HMM above them, learned and run (thesis, chapter 4).

Shapes: M gestemes, S task states, T steps.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs.motion.steps import Step
from hmcs.recognition.belief_builder import BeliefBuilder
from hmcs.recognition.checking import LARGEST, check_within
from hmcs.recognition.hmm.inference import shortest_path, smooth
from hmcs.recognition.hmm.log_transitions import log_of
from hmcs.recognition.model import Model, axes_of
from hmcs.recognition.recognizer import Recognition
from hmcs.recognition.registry import TrainingData
from hmcs.recognition.segmentation import StateSegment, edges_where, segments_between
from hmcs.recognition.segments import (
    LabeledSteps,
    LearningError,
    labeled_steps,
    segments_of,
)
from hmcs.recognition.task_chain import chain_of
from hmcs.task import Task
from hmcs_baselines.classifying import (
    GestemeHmmClassifier,
    Gestemes,
    check_gestemes,
    learn_gestemes,
)
from hmcs_baselines.gesteme_hmms import GestemeHmmSettings
from hmcs_baselines.observing import ObservationSettings, Observed
from hmcs_baselines.restarting import Classification, CusumSettings, Restart
from hmcs_baselines.task_level import (
    GestemeLevelOutput,
    GestemeTaskHmm,
    TaskLevel,
    TaskLevelSettings,
    check_task_hmm,
    gesteme_shares,
    learn_task_level,
    state_given_gesteme,
)

Evidence = Literal["winner", "soft", "none"]
Confusions = Literal["training", "held-out"]


class LayeredHmmSettings(NamedTuple):
    """The choices of the layered HMM."""

    observations: Observed = "od"
    """What the gesteme HMMs observe; see there."""
    observing: ObservationSettings = ObservationSettings()
    """Numbers of symbols, and the windows."""
    gestemes: GestemeHmmSettings = GestemeHmmSettings()
    """How gesteme HMMs are learned."""
    restart: Restart = "network"
    """When the gesteme HMMs begin anew: where the pedal says (given: as the thesis evaluates
    them), by the CUSUM test, all the time in a network as Li and Okamura's, or never. The default
    asks nothing of the operator."""
    cusum: CusumSettings = CusumSettings()
    """The test, where restarts are found by it."""
    evidence: Evidence = "winner"
    """What the task HMM is shown: the most probable gesteme, as in the thesis, or all of them with
    their probabilities (soft), which halves the false switches. None: there is no task HMM, and
    states are as probable as the gestemes they are performed with, those that share one by how
    often the task visits them."""
    task: TaskLevelSettings = TaskLevelSettings()
    """How the task HMM is learned."""
    confusions: Confusions = "training"
    """From what the task HMM learns how gestemes are confused: what the gesteme HMMs say of the
    demonstrations they were learned from (training), or what others, learned without it, say of
    each (held-out; stacked generalization, Wolpert 1992). The former is as in the thesis."""


class TwoLevels(NamedTuple):
    """What gesteme HMMs and the task HMM above them know."""

    gestemes: Gestemes
    task: GestemeTaskHmm | None
    """None where it is shown nothing."""
    restart: Restart
    cusum: CusumSettings
    evidence: Evidence


def learn_two_levels(data: TrainingData, settings: LayeredHmmSettings) -> TwoLevels:
    """Return what is learned: first the gestemes, then the task from what they say.

    The task HMM is trained on what the gesteme HMMs pass up of whole demonstrations, restarted as
    they will be, so that it expects their mistakes; where restarts are given, at the labels.
    """
    task, gestemes = data.task, _learned_gestemes(data, settings)
    if settings.evidence == "none":
        return TwoLevels(gestemes, None, settings.restart, settings.cusum, "none")
    outputs = []
    for number, demonstration in enumerate(data.demonstrations):
        labeled = labeled_steps(task, demonstration)
        classifying = gestemes
        if settings.confusions == "held-out":
            classifying = _learned_without(number, data, settings) or gestemes
        classifier = GestemeHmmClassifier(
            classifying, axes_of(task), settings.restart, settings.cusum
        )
        passed = [
            passed_up(classifier.step(step), settings.evidence) for step in with_marks(labeled)
        ]
        outputs.append(GestemeLevelOutput(np.array(passed), labeled.states))
    data.progress("task HMM on what the gesteme HMMs say of the demonstrations")
    task_hmm = learn_task_level(chain_of(task), outputs, settings.task)
    return TwoLevels(gestemes, task_hmm, settings.restart, settings.cusum, settings.evidence)


def _learned_gestemes(data: TrainingData, settings: LayeredHmmSettings) -> Gestemes:
    return learn_gestemes(
        data,
        settings.observations,
        settings.observing,
        settings.gestemes,
        complete=settings.restart == "network",
    )


def _learned_without(
    number: int, data: TrainingData, settings: LayeredHmmSettings
) -> Gestemes | None:
    """The gesteme HMMs of all demonstrations but one; None where those lack a gesteme."""
    others = (*data.demonstrations[:number], *data.demonstrations[number + 1 :])
    data.progress(f"gesteme HMMs without demonstration {number + 1}")
    try:
        segments = segments_of(data.task, others)
        return _learned_gestemes(
            data._replace(demonstrations=others, segments=tuple(segments)), settings
        )
    except LearningError:
        return None


def passed_up(classification: Classification, evidence: Evidence) -> Array:
    """Return the distribution over gestemes that the task HMM is shown, shape (M,)."""
    gestemes = classification.gestemes
    return gestemes if evidence == "soft" else np.eye(len(gestemes))[gestemes.argmax()]


def check_two_levels(knowledge: TwoLevels, task: Task) -> None:
    """Raise ValueError where the arrays do not fit together, or not the task."""
    check_gestemes(knowledge.gestemes, task)
    check_within("drift_nats", knowledge.cusum.drift_nats, 0.0, LARGEST)
    check_within("threshold_nats", knowledge.cusum.threshold_nats, 0.0, LARGEST)
    if (knowledge.task is None) != (knowledge.evidence == "none"):
        raise ValueError(
            f"field 'evidence' is {knowledge.evidence!r}: expected 'none' exactly where there is "
            "no task HMM"
        )
    if knowledge.task is not None:
        check_task_hmm(knowledge.task, len(task.states), len(task.gestemes))


class TwoLevelRecognizer:
    """Both levels in one object, or the gesteme level alone."""

    def __init__(self, model: Model, *, anywhere: bool) -> None:
        """Begin as the task does or, with `anywhere`, in any of its states."""
        knowledge: TwoLevels = model.knowledge
        self._classifier = GestemeHmmClassifier(
            knowledge.gestemes, model.axes, knowledge.restart, knowledge.cusum
        )
        self._evidence = knowledge.evidence
        chain, gestemes = chain_of(model.task, anywhere=anywhere), len(model.task.gestemes)
        self._task: TaskLevel | None = None
        if knowledge.task is None:
            self._state_given_gesteme = state_given_gesteme(chain, gestemes)
        else:
            self._task = TaskLevel(knowledge.task, anywhere=anywhere)
            self._outside = np.where(gesteme_shares(chain, gestemes) > 0, 0.0, -1.0)
        self._beliefs = BeliefBuilder()

    def step(self, step: Step) -> Recognition:
        """Take the next step; steps come in order, without gaps."""
        classification = self._classifier.step(step)
        if self._task is None:
            cells = self._state_given_gesteme * classification.gestemes
            states, log_likelihood = cells.sum(axis=1), classification.log_likelihood
        else:
            cells = self._outside + classification.gestemes
            states, log_likelihood = self._task.step(passed_up(classification, self._evidence))
        return self._beliefs.recognition(
            step.index, states, cells, log_likelihood, classification.start
        )


def segment_two_levels(
    model: Model, steps: Sequence[Step], *, anywhere: bool
) -> tuple[StateSegment, ...]:
    """Return the segments of a whole motion, one step at least, by Viterbi in the task HMM.

    The gesteme level passes up what it does online. With `anywhere` the motion may begin in any
    state. Raises UserError where there is no task HMM, or where gesteme HMMs are to be restarted by
    a pedal that no step was marked with.
    """
    knowledge: TwoLevels = model.knowledge
    task_hmm = knowledge.task
    if task_hmm is None:
        raise UserError(
            f"model {model.name!r} has no task HMM (evidence=none), and no offline segmentation "
            "without one: train it with --set evidence=winner"
        )
    if knowledge.restart == "given" and not any(step.mark for step in steps[1:]):
        raise UserError(
            f"model {model.name!r} has its gesteme HMMs restarted by the pedal, and the motion has "
            "no mark of it: train with --set restart=network"
        )
    classifier = GestemeHmmClassifier(
        knowledge.gestemes, model.axes, knowledge.restart, knowledge.cusum
    )
    passed = np.array([passed_up(classifier.step(step), knowledge.evidence) for step in steps])
    states = len(task_hmm.initial)
    initial = np.full(states, 1.0 / states) if anywhere else task_hmm.initial
    log_emission = log_of(passed @ task_hmm.gestemes.T)
    path = shortest_path(initial, task_hmm.transition, log_emission).path
    posterior = smooth(initial, task_hmm.transition, log_emission).states
    # Of a state's own gestemes the likeliest is performed, whatever mistakes the level below makes.
    own = gesteme_shares(chain_of(model.task), passed.shape[1])[path] > 0
    gestemes = np.where(own, passed, -1.0).argmax(axis=1)
    return segments_between(
        edges_where(path[1:] != path[:-1]), path, gestemes, posterior, steps[0].index
    )


def with_marks(labeled: LabeledSteps) -> Iterator[Step]:
    """Yield the steps, the pedal down where the label is another."""
    before = None
    for step, state, gesteme in zip(labeled.steps, labeled.states, labeled.gestemes, strict=True):
        yield step._replace(mark=(state, gesteme) != before)
        before = (state, gesteme)
