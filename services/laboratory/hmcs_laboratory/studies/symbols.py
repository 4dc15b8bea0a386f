"""The study of how many symbols gesteme HMMs tell directions apart by (4.2.1)."""

from __future__ import annotations

import numpy as np

from hmcs_laboratory.data.gestemes import performed, random_references
from hmcs_laboratory.data.hands import Count, CurveSettings, NotNegative
from hmcs_laboratory.methods.registered import WholeNames, peers_left_out, whole
from hmcs_laboratory.methods.symbol_hmms import SYMBOL_METHODS, with_symbols
from hmcs_laboratory.methods.whole import measured_on
from hmcs_laboratory.study import Measured, Study, seed_from, stream_of


class SymbolCountSettings(CurveSettings):
    """Of the study `symbol-count`."""

    symbols: tuple[Count, ...] = (2, 4, 10, 25, 60)
    """Centers of the code book (OD), or bins of each dimension (MD, FFT)."""
    gestemes: Count = 10
    training: Count = 5
    """Performances of each gesteme to learn from."""
    test: Count = 10
    """Performances of each gesteme to recognize."""
    noise: NotNegative = 0.15
    """κ of (3.3)."""
    methods: WholeNames = tuple(method.name for method in SYMBOL_METHODS)
    """One that has no symbols is measured once, and the same for any number of them."""


def symbol_count_trial(settings: SymbolCountSettings, rng: np.random.Generator) -> list[Measured]:
    """Measure all methods with every number of symbols on one set of gestemes."""
    drawing, moving = rng.spawn(2)
    seed = seed_from(rng)
    data = performed(
        random_references(settings.references, settings.gestemes, drawing),
        settings.operator(settings.noise),
        training=settings.training,
        test=settings.test,
        rng=moving,
    )
    rows = []
    for method in whole(settings.methods):
        measures: dict[str, float] = {}
        for count in settings.symbols:
            able = with_symbols(method, count)
            if able is not method or not measures:
                (measures,) = measured_on(able, data, stream_of(method.name, seed))
            rows.append(Measured(method.name, {"symbols": count}, measures))
    return rows


SYMBOL_COUNT = Study(
    "symbol-count",
    "accuracy against the number of symbols",
    "Aarno 2007, 4.2.1, figs 4.9 and 4.10",
    SymbolCountSettings,
    symbol_count_trial,
    left_out=lambda settings: peers_left_out(settings.methods),
    tiny={
        "gestemes": "3",
        "training": "2",
        "test": "2",
        "symbols": "4,10",
        "methods": "od-hmm,md-hmm,fft-hmm-no-floor,lda",
    },
)
