"""Studies of gestemes whose start is known: how many, how noisy, from how much (4.2.1)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from hmcs_laboratory.data.gestemes import GestemeSet, performed, random_references
from hmcs_laboratory.data.hands import Count, CurveSettings, NotNegative, Share
from hmcs_laboratory.methods.registered import WholeNames, peers_left_out, whole
from hmcs_laboratory.methods.whole import measured_on
from hmcs_laboratory.study import Measured, Scalar, Study, seed_from, stream_of

SOURCE = "Aarno 2007, 4.2.1"


class _Settings(CurveSettings):
    test: Count = 10
    """Performances of each gesteme to recognize."""
    methods: WholeNames = ()
    """All where none is named."""


class NoiseSettings(_Settings):
    """Of the studies `noise` and `peers`."""

    gestemes: Count = 10
    training: Count = 5
    """Performances of each gesteme to learn from."""
    noise: tuple[NotNegative, ...] = (0.05, 0.15, 0.25, 0.35, 0.45, 0.55)
    """κ of (3.3); each gesteme is the same at all of them."""


class PeersSettings(NoiseSettings):
    """Of the study `peers`: the conditions of the hardest goals."""

    gestemes: Count = 25
    noise: tuple[NotNegative, ...] = (0.15, 0.3, 0.5)


class GestemeCountSettings(_Settings):
    """Of the study `gesteme-count`."""

    gestemes: tuple[Count, ...] = (2, 5, 10, 15, 20, 25)
    training: Count = 5
    noise: NotNegative = 0.15


class TrainingCountSettings(_Settings):
    """Of the study `training-count`."""

    gestemes: Count = 10
    training: tuple[Count, ...] = (1, 2, 3, 5, 10, 20)
    noise: NotNegative = 0.15


class PartialSettings(_Settings):
    """Of the study `partial`."""

    gestemes: tuple[Count, ...] = (5, 25)
    training: Count = 5
    noise: NotNegative = 0.15
    seen: tuple[Share, ...] = (0.1, 0.2, 0.5, 1.0)
    """Share of each performance that is seen, from its start."""


def noise_trial(settings: NoiseSettings, rng: np.random.Generator) -> list[Measured]:
    """Measure all methods at every noise."""
    drawing, moving = rng.spawn(2)
    seed = seed_from(rng)
    curves = random_references(settings.references, settings.gestemes, drawing)
    return [
        measured
        for noise, stream in zip(settings.noise, moving.spawn(len(settings.noise)), strict=True)
        for measured in _measured(
            settings,
            performed(
                curves,
                settings.operator(noise),
                training=settings.training,
                test=settings.test,
                rng=stream,
            ),
            {"gestemes": settings.gestemes, "noise": noise},
            seed,
        )
    ]


def gesteme_count_trial(settings: GestemeCountSettings, rng: np.random.Generator) -> list[Measured]:
    """Measure all methods on the first so many gestemes of one set."""
    data, seed = _set(settings, max(settings.gestemes), settings.training, settings.noise, rng)
    return [
        measured
        for count in settings.gestemes
        for measured in _measured(
            settings,
            data.first(gestemes=count),
            {"gestemes": count, "noise": settings.noise},
            seed,
        )
    ]


def training_count_trial(
    settings: TrainingCountSettings, rng: np.random.Generator
) -> list[Measured]:
    """Measure all methods with the first so many performances of one set to learn from."""
    data, seed = _set(settings, settings.gestemes, max(settings.training), settings.noise, rng)
    return [
        measured
        for count in settings.training
        for measured in _measured(
            settings,
            data.first(training=count),
            {"training": count, "noise": settings.noise},
            seed,
        )
    ]


def partial_trial(settings: PartialSettings, rng: np.random.Generator) -> list[Measured]:
    """Measure all methods, learned from whole performances, on the beginnings of others."""
    data, seed = _set(settings, max(settings.gestemes), settings.training, settings.noise, rng)
    return list(_partial(settings, data, seed))


def _partial(settings: PartialSettings, data: GestemeSet, seed: int) -> Iterator[Measured]:
    for count in settings.gestemes:
        part = data.first(gestemes=count)
        for method in whole(settings.methods):
            measures = measured_on(method, part, stream_of(method.name, seed), settings.seen)
            for seen, measured in zip(settings.seen, measures, strict=True):
                setting = {"gestemes": count, "noise": settings.noise, "seen": seen}
                yield Measured(method.name, setting, measured)


def _set(
    settings: _Settings, gestemes: int, training: int, noise: float, rng: np.random.Generator
) -> tuple[GestemeSet, int]:
    drawing, moving = rng.spawn(2)
    curves = random_references(settings.references, gestemes, drawing)
    operator = settings.operator(noise)
    made = performed(curves, operator, training=training, test=settings.test, rng=moving)
    return made, seed_from(rng)


def _measured(
    settings: _Settings, data: GestemeSet, setting: dict[str, Scalar], seed: int
) -> Sequence[Measured]:
    return [
        Measured(method.name, setting, measures)
        for method in whole(settings.methods)
        for measures in measured_on(method, data, stream_of(method.name, seed))
    ]


def _left_out(settings: _Settings) -> str:
    return peers_left_out(settings.methods)


_TINY = {"test": "2", "methods": "hmcs-gestemes,lda"}

PEERS = Study(
    "peers",
    "our gesteme models and the libraries people use, on the same data",
    f"{SOURCE}; hmmlearn, aeon, scikit-learn",
    PeersSettings,
    noise_trial,
    left_out=_left_out,
    tiny={
        "gestemes": "4",
        "training": "3",
        "test": "2",
        "noise": "0.15",
        "methods": "hmcs-gestemes,svm,lda,extra-trees",
    },
)
NOISE = Study(
    "noise",
    "accuracy against the noise of the hand",
    f"{SOURCE}, figs 4.3 and 4.4",
    NoiseSettings,
    noise_trial,
    left_out=_left_out,
    tiny={**_TINY, "gestemes": "4", "noise": "0.1,0.3"},
)
GESTEME_COUNT = Study(
    "gesteme-count",
    "accuracy against the number of gestemes",
    f"{SOURCE}, figs 4.5 and 4.6",
    GestemeCountSettings,
    gesteme_count_trial,
    left_out=_left_out,
    tiny={**_TINY, "gestemes": "2,4"},
)
TRAINING_COUNT = Study(
    "training-count",
    "accuracy against the number of performances to learn from",
    f"{SOURCE}, figs 4.7 and 4.8",
    TrainingCountSettings,
    training_count_trial,
    left_out=_left_out,
    tiny={**_TINY, "gestemes": "4", "training": "1,3"},
)
PARTIAL = Study(
    "partial",
    "accuracy against the part of the gesteme that was seen",
    SOURCE,
    PartialSettings,
    partial_trial,
    left_out=_left_out,
    tiny={**_TINY, "gestemes": "3", "training": "3"},
)
