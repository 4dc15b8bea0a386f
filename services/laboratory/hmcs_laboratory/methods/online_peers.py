"""Online peers: trees on a window of steps, and one HMM of all states on directions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import Step
from hmcs.recognition.hmm.emissions import Gaussian
from hmcs.recognition.hmm.learning import EMISSION, baum_welch
from hmcs.recognition.hmm.model import Hmm
from hmcs.recognition.hmm.topologies import left_right, start_in
from hmcs.recognition.model import axes_of
from hmcs.recognition.recognizer import Recognition, TaskBelief
from hmcs.recognition.scoring import NONE
from hmcs.recognition.segments import segments_of
from hmcs.task import Task
from hmcs_baselines.hmm.bank import ForwardBank, GaussianScores
from hmcs_laboratory.data.tasks import as_performance, path_of
from hmcs_laboratory.methods.features import directions
from hmcs_laboratory.methods.online import Fresh
from hmcs_laboratory.methods.windows import FROM_START, LONG, Window, fit_window_trees

PHASES = 5
VARIANCE_FLOOR = 0.01
ANY_STATE = 1e-6
"""Probability that a state is followed by any other than the task names."""


class WindowTrees:
    """Classifies each step by the window of steps that ends with it."""

    def __init__(self, trees: Any, window: Window, task: Task) -> None:
        self._trees = trees
        self._window = window
        self._task = task
        self._axes = list(axes_of(task))
        self._points: list[Array] = []

    def step(self, step: Step) -> Recognition:
        """Take the next step."""
        if not self._points:
            self._points.append(step.position[self._axes])
            self._origin = self._points[0]
        self._points.append((step.position + step.displacement)[self._axes])
        # One point more than steps: where the first of them began.
        self._points = self._points[-self._window.steps - 1 :]
        window = self._window.features(np.array(self._points), self._origin)[-1:]
        states = np.zeros(len(self._task.states))
        states[self._trees.classes_] = self._trees.predict_proba(window)[0]
        return recognition(step.index, states, self._task)


class ConcatenatedHmm:
    """One HMM: the left-right models of all states' gestemes, joined in the order of the task."""

    def __init__(self, bank: ForwardBank, scores: GaussianScores, task: Task) -> None:
        self._bank = bank
        self._scores = scores
        self._task = task
        self._axes = list(axes_of(task))

    def step(self, step: Step) -> Recognition:
        """Take the next step."""
        move = step.displacement[self._axes]
        direction = directions(np.stack([np.zeros_like(move), move]))[0]
        increment = self._bank.step(self._scores.log_emission(direction))
        states = self._bank.states.reshape(len(self._task.states), PHASES).sum(axis=1)
        return recognition(step.index, states, self._task, float(increment[0]))


def learn_long_window_trees(
    task: Task, demonstrations: Sequence[Demonstration], rng: np.random.Generator
) -> Fresh:
    """Fit extremely randomised trees to long windows of all demonstrated steps."""
    return _learned_trees(task, demonstrations, LONG, rng)


def learn_start_trees(
    task: Task, demonstrations: Sequence[Demonstration], rng: np.random.Generator
) -> Fresh:
    """Fit them to short windows, and where the hand is seen from the start of the task."""
    return _learned_trees(task, demonstrations, FROM_START, rng)


def _learned_trees(
    task: Task,
    demonstrations: Sequence[Demonstration],
    window: Window,
    rng: np.random.Generator,
) -> Fresh:
    axes = list(axes_of(task))
    made = [as_performance(demonstration, task) for demonstration in demonstrations]
    paths = [path_of(each.steps)[:, axes] for each in made]
    windows = np.concatenate([window.features(path, path[0]) for path in paths])
    states = np.concatenate([each.states for each in made])
    labeled = states != NONE
    trees = fit_window_trees(windows[labeled], states[labeled], rng)
    return lambda: WindowTrees(trees, window, task)


def learn_concatenated_hmm(
    task: Task, demonstrations: Sequence[Demonstration], _rng: np.random.Generator
) -> Fresh:
    """Learn a left-right Gaussian HMM on directions of each gesteme, and join them."""
    axes = list(axes_of(task))
    names = [gesteme.name for gesteme in task.gestemes]
    sequences: list[list[Array]] = [[] for _ in names]
    for segment in segments_of(task, demonstrations):
        sequences[segment.gesteme].append(directions(path_of(segment.steps)[:, axes]))
    of_gesteme = [_gesteme_model(own) for own in sequences]
    own = [of_gesteme[names.index(state.gestemes[0])] for state in task.states]
    initial, transition = _joined(task, own)
    means = np.concatenate([model.emission.means for model in own])
    variances = np.concatenate([model.emission.variances for model in own])
    scores = GaussianScores(means[None], variances[None])
    return lambda: ConcatenatedHmm(ForwardBank(initial[None], transition[None]), scores, task)


def recognition(index: int, states: Array, task: Task, log_likelihood: float = 0.0) -> Recognition:
    """Return the belief of a recognizer that knows states only, and no unknown motion."""
    names = [gesteme.name for gesteme in task.gestemes]
    best = task.states[int(states.argmax())]
    belief = TaskBelief(
        step=index,
        states=states,
        unknown=0.0,
        gesteme=names.index(best.gestemes[0]),
        segment_start=index,
        log_likelihood=log_likelihood,
        missing=(),
    )
    return Recognition(belief, log_likelihood, False)


def _gesteme_model(sequences: Sequence[Array]) -> Hmm[Gaussian]:
    pieces = [
        np.concatenate([np.array_split(sequence, PHASES)[n] for sequence in sequences])
        for n in range(PHASES)
    ]
    everything = np.concatenate(sequences)
    filled = [piece if len(piece) else everything for piece in pieces]
    dwell = max(float(np.mean([len(sequence) for sequence in sequences])) / PHASES, 1.25)
    first = Hmm(
        start_in(PHASES),
        left_right(PHASES, 1.0 / dwell, leaves=True),
        Gaussian(
            np.stack([piece.mean(axis=0) for piece in filled]),
            np.stack([piece.var(axis=0) + VARIANCE_FLOOR for piece in filled]),
            VARIANCE_FLOOR,
        ),
    )
    return baum_welch(first, sequences, learn=EMISSION).model


def _joined(task: Task, models: Sequence[Hmm[Gaussian]]) -> tuple[Array, Array]:
    count = len(models)
    order = [state.name for state in task.states]
    named = np.array([[state.next.get(name, 0.0) for name in order] for state in task.states])
    initial = np.zeros((count, PHASES))
    transition = np.zeros((count, PHASES, count, PHASES))
    for q, model in enumerate(models):
        initial[q] = task.start.get(order[q], 0.0) * model.initial
        transition[q, :, q, :] += model.transition
        leaving = 1.0 - model.transition.sum(axis=1)
        for after, following in enumerate(models):
            share = (1.0 - ANY_STATE) * named[q, after] + ANY_STATE / count
            transition[q, :, after, :] += share * np.outer(leaving, following.initial)
    # Where the task ends the hand stays in its last state.
    lost = 1.0 - transition.sum(axis=(2, 3))
    transition[np.arange(count), :, np.arange(count), -1] += lost
    size = count * PHASES
    return initial.ravel(), transition.reshape(size, size)
