"""The study of size and turn: gestemes performed otherwise than they were demonstrated."""

from __future__ import annotations

import math
from itertools import product
from typing import Annotated

import numpy as np
from pydantic import Field

from hmcs_laboratory.data.hands import NotNegative
from hmcs_laboratory.data.synthetic_tasks import TaskSettings, five_states, of_other_sizes
from hmcs_laboratory.methods.online import followed, learned, state_measures
from hmcs_laboratory.methods.registered import OnlineNames, online
from hmcs_laboratory.study import Measured, Study, seed_from, stream_of

Size = Annotated[float, Field(ge=0, lt=1)]
Turn = Annotated[float, Field(ge=0, le=180)]


class ScaleSettings(TaskSettings):
    """Of the study `scale`."""

    noise: NotNegative = 0.15
    """κ of (3.3)."""
    sizes: tuple[Size, ...] = (0.0, 0.3, 0.5)
    """Each segment is performed as large as demonstrated times a factor in 1 ± size."""
    turns_deg: tuple[Turn, ...] = (15.0,)
    """Each segment is turned by an angle in ± turn."""
    methods: OnlineNames = ()
    """All where none is named."""


def scale_trial(settings: ScaleSettings, rng: np.random.Generator) -> list[Measured]:
    """Learn the five-state task as demonstrated, follow it in every size and turn.

    The gestemes are drawn so that as demonstrated every turn from one to the next is at least
    θ_min = 30°; turned by ± 15° each, two may follow one another without any.
    """
    data = five_states(settings, settings.noise, rng)
    others = [
        (
            {"size": size, "turn_deg": turn_deg},
            of_other_sizes(data, settings, settings.noise, size, math.radians(turn_deg), rng),
        )
        for size, turn_deg in product(settings.sizes, settings.turns_deg)
    ]
    seed = seed_from(rng)
    rows = []
    for method in online(settings.methods):
        able = learned(method, data, stream_of(method.name, seed))
        for setting, other in others:
            what = followed(able, other.performances)
            rows.append(Measured(method.name, setting, state_measures(what, other.performances)))
    return rows


SCALE = Study(
    "scale",
    "gestemes performed larger, smaller or turned: the task of five states",
    "Aarno 2007, chapter 5, on the task of fig. 4.11",
    ScaleSettings,
    scale_trial,
    tiny={
        "demonstrations": "2",
        "performances": "1",
        "sizes": "0.3",
        "methods": "hmcs-segment-filter-aligned,concatenated-hmm",
    },
)
