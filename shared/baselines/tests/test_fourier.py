from __future__ import annotations

import numpy as np

from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import steps_of_demonstration
from hmcs.recognition.learning import learn
from hmcs.recognition.registry import recognizer_of
from hmcs.task import Task
from hmcs_baselines.layered_hmm import FOURIER
from hmcs_baselines.observing import ObservationSettings
from hmcs_baselines.symbols import Fourier
from support.lessons import lesson_task

PERIODS = {"slow": 12, "quick": 4}
"""Steps of a wave of the direction."""


def waves_task() -> Task:
    fields = lesson_task().model_dump()
    fields["gestemes"] = [{"name": name} for name in PERIODS]
    fields["states"] = [
        {"name": name, "gestemes": [name], "next": [other]}
        for name, other in zip(PERIODS, reversed(PERIODS), strict=True)
    ]
    return Task.model_validate({**fields, "start": ["slow"]})


def waved(seed: int) -> Demonstration:
    """All directions of one wave are in the other one, too, and as often."""
    rng = np.random.default_rng(seed)
    moves, labels = [np.zeros((1, 3))], ["slow"]
    for name, period in PERIODS.items():
        angle = np.sign(np.sin(2 * np.pi * (np.arange(48) + 0.5) / period))
        angle = angle + rng.normal(0, 0.05, 48)
        moves.append(0.0101 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1))
        labels += [name] * 48
    positions = np.cumsum(np.concatenate(moves), axis=0)
    return Demonstration(f"waves-{seed}", np.arange(97) / 10.0, positions, tuple(labels))


def test_gestemes_are_distinguished_by_how_fast_they_turn_where_directions_alone_are_alike() -> (
    None
):
    settings = FOURIER.settings()._replace(observing=ObservationSettings(symbols=8))
    demonstrations = [waved(seed) for seed in range(4)]
    model = learn(waves_task(), demonstrations, settings, recognizer="fourier")
    recognizer = recognizer_of(model)
    steps = steps_of_demonstration(waved(9), 0.01)
    likely = [int(recognizer.step(step).belief.states.argmax()) for step in steps]
    true = np.repeat([0, 1], 48)
    assert (np.array(likely) == true).mean() > 0.9


def test_all_gestemes_share_one_code_book_of_window_features() -> None:
    observing = ObservationSettings(symbols=8, fourier=Fourier(4, 2))
    settings = FOURIER.settings()._replace(observing=observing)
    model = learn(waves_task(), [waved(0)], settings, recognizer="fourier")
    observing, hmms = model.knowledge.gestemes
    assert observing.encoding.centers.shape == (8, 3 * 4)
    assert hmms.emissions.probabilities.shape[2:] == (1, 8)
    assert model.knowledge.restart == "network"
