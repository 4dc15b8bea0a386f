"""Our recognizer of a single gesteme whose start is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hmcs.arrays import Array
from hmcs_laboratory.methods.whole import Examples
from hmcs_laboratory.single_gestemes.learning import learn_single
from hmcs_laboratory.single_gestemes.model import SingleGestemes, scores


@dataclass(frozen=True)
class Single:
    """A closed loop and shapes, pooled."""

    knowledge: SingleGestemes
    same_share: bool = False
    """Whether it learned from the share of motions that it is shown."""

    def classify(self, positions: Array, *, complete: bool) -> Array:
        """Return log P(gesteme | motion), shape (G,)."""
        return scores(self.knowledge, positions, whole=complete or self.same_share)


def fit_single(examples: Examples, _rng: np.random.Generator) -> Single:
    """Learn from whole gestemes; beginnings are recognized by the same knowledge."""
    return Single(learn_single(examples))


def fit_single_of_share(examples: Examples, _rng: np.random.Generator) -> Single:
    """Learn from beginnings as if they were whole, to recognize beginnings of the same share."""
    return Single(learn_single(examples), same_share=True)
