"""Gesteme HMMs in parallel, from steps to probabilities of gestemes (thesis 4.1.1).

Shapes: M gestemes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from hmcs.motion.steps import Step
from hmcs.recognition.model import axes_of
from hmcs.recognition.registry import TrainingData
from hmcs.task import Task
from hmcs_baselines.gesteme_hmms import (
    GestemeHmms,
    GestemeHmmSettings,
    GestemeScores,
    Normals,
    check_gesteme_hmms,
    learn_gesteme_hmms,
)
from hmcs_baselines.observing import (
    ObservationSettings,
    Observed,
    Observer,
    Observing,
    check_observing,
    learn_observing,
    observations,
)
from hmcs_baselines.restarting import (
    Classification,
    CusumSettings,
    Restart,
    gesteme_level,
)
from hmcs_baselines.symbols import Bins


class Gestemes(NamedTuple):
    """What is known of the gestemes of a task."""

    observing: Observing
    hmms: GestemeHmms


def learn_gestemes(
    data: TrainingData,
    observed: Observed,
    observation_settings: ObservationSettings,
    hmm_settings: GestemeHmmSettings,
    *,
    complete: bool,
) -> Gestemes:
    """Return what labeled segments tell of the gestemes; `complete` as `learn_gesteme_hmms`."""
    axes = axes_of(data.task)
    observing = learn_observing(
        [segment.steps for segment in data.segments],
        axes,
        observed,
        observation_settings,
        data.rng,
    )
    by_gesteme = [
        [observations(s.steps, observing, axes) for s in data.segments if s.gesteme == g]
        for g in range(len(data.task.gestemes))
    ]
    data.progress(f"gesteme HMMs on {observed} observations")
    hmms = learn_gesteme_hmms(by_gesteme, observing.symbols, hmm_settings, complete=complete)
    return Gestemes(observing, hmms)


def check_gestemes(gestemes: Gestemes, task: Task) -> None:
    """Raise ValueError where the arrays do not fit together, or not the task."""
    check_gesteme_hmms(gestemes.hmms, len(task.gestemes))
    encoding = gestemes.observing.encoding
    features = check_observing(gestemes.observing, len(axes_of(task)))
    emissions = gestemes.hmms.emissions
    expected: tuple[int, ...] = (features,)
    if encoding is not None:
        dimensions = features if isinstance(encoding, Bins) else 1
        expected = (dimensions, gestemes.observing.symbols or 0)
    if emissions[0].shape[2:] != expected or isinstance(emissions, Normals) != (encoding is None):
        raise ValueError(f"gesteme HMMs emit {emissions[0].shape[2:]}, but {expected} is observed")


class GestemeHmmClassifier:
    """Says after each step which gesteme is performed."""

    def __init__(
        self,
        gestemes: Gestemes,
        axes: Sequence[int],
        restart: Restart,
        cusum: CusumSettings,
    ) -> None:
        self._observer = Observer(gestemes.observing, axes)
        self._scores = GestemeScores(gestemes.hmms)
        self._level = gesteme_level(gestemes.hmms.chains, restart, cusum)
        self._heeds_marks = restart == "given"
        # The first step is always observed.
        self._latest: Classification

    def step(self, step: Step) -> Classification:
        """Take the next step; between windows the classification stays as it was."""
        mark = step.mark and self._heeds_marks
        observation = self._observer.step(step, afresh=mark)
        if observation is not None:
            log_emission = self._scores.log_emission(observation)
            self._latest = self._level.step(step.index, log_emission, mark=mark)
        return self._latest
