"""Our gesteme models as classifiers of a whole gesteme whose start is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hmcs.motion.steps import Step
from hmcs.recognition.gesteme_learning import LearningSettings, fit_gestemes
from hmcs.recognition.gestemes import GestemeParameters
from hmcs.recognition.hmm.bank import ForwardBank, GaussianScores
from hmcs.recognition.segments import Segment
from hmcs_laboratory.methods.features import directions, flat
from hmcs_laboratory.methods.whole import Examples

Array = NDArray[np.float64]

LEAST_PROBABILITY = 1e-300


@dataclass(frozen=True)
class GestemeModels:
    """The left-right Gaussian HMMs of `hmcs.recognition`, all begun at the first step."""

    parameters: GestemeParameters
    scores: GaussianScores
    transition: Array
    """Shape (G, N, N); rows sum to less than one by the probability that the gesteme is over."""

    def classify(self, positions: Array, *, complete: bool) -> Array:
        """Return log P(steps | gesteme), and that the last one ends it if complete, shape (G,)."""
        bank = ForwardBank(self.parameters.initial, self.transition)
        moved = positions[1:] - positions[0]
        for observation in np.hstack([moved, directions(positions)]):
            bank.step(self.scores.log_emission(observation))
        if not complete:
            return bank.log_likelihood
        ended = (bank.states * self.parameters.leave).sum(axis=1)
        return np.asarray(bank.log_likelihood + np.log(np.maximum(ended, LEAST_PROBABILITY)))


def fit_ours(examples: Examples, _rng: np.random.Generator) -> GestemeModels:
    """Learn as the layered recognizer does; the mean step counts as its dead zone."""
    steps = np.concatenate([np.diff(positions, axis=0) for positions in flat(examples)])
    dimensions = steps.shape[1]
    parameters = fit_gestemes(
        [[_segment(positions, g) for positions in own] for g, own in enumerate(examples)],
        range(dimensions),
        float(np.linalg.norm(steps, axis=1).mean()),
        LearningSettings(),
    )
    return GestemeModels(
        parameters, GaussianScores(parameters.means, parameters.variances), _transition(parameters)
    )


def _segment(positions: Array, gesteme: int) -> Segment:
    spatial = np.zeros((len(positions), 3))
    spatial[:, : positions.shape[1]] = positions
    moves = np.diff(spatial, axis=0)
    steps = tuple(
        Step(t, here, move) for t, (here, move) in enumerate(zip(spatial, moves, strict=False))
    )
    return Segment("", gesteme, gesteme, spatial, steps)


def _transition(parameters: GestemeParameters) -> Array:
    count, phases = parameters.stay.shape
    transition = np.zeros((count, phases, phases))
    here = np.arange(phases)
    transition[:, here, here] = parameters.stay
    transition[:, here[:-1], here[1:]] = parameters.advance[:, :-1]
    transition[:, here[:-2], here[2:]] = parameters.skip[:, :-2]
    return transition
