"""Gesteme models in parallel: every gesteme scored for every living segment start (thesis 4.1.1).

A gesteme is a left-right Gaussian HMM whose phases observe where the hand is relative to the
segment's origin and which way it goes. What a pair (gesteme, start s) makes of step t is a pure
function of steps s..t: it depends on no other pair, no task and no other classifier, to the bit.
With an alignment each pair scales and turns its gesteme to what it has seen; see `alignment`.
Shapes: G gestemes, N phases (the longest gesteme's; shorter ones are padded with impossible
phases), D axes looked at, F = 2·D observed dimensions, p living pairs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.motion.steps import Step
from hmcs.recognition.recognizer import StepEvidence
from hmcs.recognition.segment_filter import alignment
from hmcs.recognition.segment_filter.alignment import Alignment
from hmcs.recognition.segment_filter.exits import exit_features, exit_probability
from hmcs.recognition.segment_filter.sensor_densities import SensorDensities, log_densities
from hmcs.recognition.step_features import StepFeatureReader

Integers = NDArray[np.int32]

LONGEST_WINDOW_STEPS = 1_999
"""No window of a model is longer. Who joins replays one step more than the window, and an input
device remembers 2,000 steps at least; the fixture lays its guide at a start up to 2,048 steps ago.
"""


class GestemeParameters(NamedTuple):
    """The left-right Gaussian HMMs of all gestemes of a model.

    A gesteme that is performed in several ways has a left-right chain for each of them, its
    variants, one after the other in its phases.
    """

    means: Array
    """Displacement from the segment's origin, m, then unit direction, shape (G, N, F)."""
    variances: Array
    """Of the same, shape (G, N, F)."""
    initial: Array
    """P(phase at the segment's first step), shape (G, N)."""
    stay: Array
    """P(same phase at the next step | no exit), shape (G, N); zero in padding."""
    advance: Array
    """P(next phase | no exit), shape (G, N)."""
    skip: Array
    """P(the phase after the next | no exit), shape (G, N); the three sum to one in each phase."""
    remaining: Array
    """Steps from the phase to the end of its variant, shape (G, N)."""
    variant: Integers
    """Which variant of its gesteme a phase belongs to, shape (G, N)."""
    ends: Array
    """Where a variant ends, from its origin, m, shape (G, V, D)."""
    normals: Array
    """Unit direction in which a variant's end is passed, shape (G, V, D)."""
    exit_weights: Array
    """Of the exit's logistic regression, shape (10,); see `exits`."""
    step_m: float
    """Mean length of a step, m."""
    senses: SensorDensities
    """What the phases expect of further senses, shapes (G, N, S)."""


class Scoring(NamedTuple):
    """How likelihoods become evidence; the same for all gestemes of a model."""

    background: float
    """Log density that counts as ratio zero, nats."""
    temperature: float
    """The log-likelihood ratio is divided by it: successive steps share their errors, so their
    evidence counts for less than independent observations would."""
    window_steps: int
    """A start older than this is dropped."""
    prune_nats: float
    """A pair whose running ratio falls below minus this is dropped."""
    alignment: Alignment = Alignment()
    """In what size and turn a gesteme may be performed."""


class GestemeBank:
    """Scores the gestemes it holds, step by step.

    It has a forward recursion of its own: no product with a matrix, whose sums depend on how many
    pairs there are, may stand where a pair is the same to the bit whichever others are there.
    """

    def __init__(
        self,
        parameters: GestemeParameters,
        scoring: Scoring,
        axes: Sequence[int],
        held: Sequence[int],
    ) -> None:
        """Hold the gestemes with the indices `held`; look at the `axes` of positions only."""
        self._parameters = parameters
        self._scoring = scoring
        self._axes = list(axes)
        # A dimension each, (F, G, N): see `_log_emissions`.
        self._means = np.ascontiguousarray(np.moveaxis(parameters.means, 2, 0))
        self._precisions = np.ascontiguousarray(np.moveaxis(1.0 / parameters.variances, 2, 0))
        possible = _possible(parameters)
        log_possible = np.where(possible, 0.0, -np.inf)
        self._log_scale = (
            -0.5 * np.log(2.0 * np.pi * parameters.variances).sum(axis=2) + log_possible
        )
        self._aligned: alignment.Phases | None = None
        if scoring.alignment.sigma > 0:
            self._aligned = alignment.phases_of(
                parameters.means, parameters.variances, possible, scoring.alignment
            )
        self._similarity = alignment.as_learned(0, len(self._axes))
        self._reader = StepFeatureReader(parameters.senses.names, self._axes)
        self._held = np.array(sorted(held), dtype=np.int32)
        phases = parameters.means.shape[1]
        self._gesteme = np.zeros(0, dtype=np.int32)
        self._start = np.zeros(0, dtype=np.int32)
        self._phase = np.zeros((0, phases))
        self._origin = np.zeros((0, len(self._axes)))
        self._running = np.zeros(0)
        self._leaving = np.zeros(0)
        self._exit_features = np.zeros((0, len(parameters.exit_weights)))

    @property
    def held(self) -> tuple[int, ...]:
        """Indices of the gestemes held."""
        return tuple(int(g) for g in self._held)

    @property
    def exit_features(self) -> Array:
        """What the exit of each living pair was judged by after the last step, shape (p, 10)."""
        return self._exit_features

    @property
    def similarity(self) -> alignment.Similarity:
        """In what size and turn each living pair is performed; of no pair without an alignment."""
        return self._similarity

    def step(self, step: Step) -> StepEvidence:
        """Score the next step; steps come in order, without gaps."""
        index = step.index
        here, move = step.position[self._axes], step.displacement[self._axes]
        gesteme, start, phase = self._predict(index)
        fresh = len(self._held)
        origin = np.concatenate([self._origin, np.repeat(here[None, :], fresh, axis=0)])
        running = np.concatenate([self._running, np.zeros(fresh)])
        exited = np.concatenate([self._leaving, np.zeros(fresh)])

        length = float(np.sqrt((move**2).sum()))
        direction = move / length if length > 0 else np.zeros_like(move)
        where = here + move - origin
        similarity = self._similarity
        if self._aligned is None:
            log_emission = self._log_emissions(gesteme, where, direction)
        else:
            similarity = alignment.joined(similarity, alignment.as_learned(fresh, len(here)))
            log_emission = alignment.log_densities(
                self._aligned, similarity, gesteme, where, direction
            )
        if self._parameters.senses.names:
            log_density = log_densities(self._parameters.senses, self._reader.step(step))
            log_emission += log_density.take(gesteme, axis=0)
        top = log_emission.max(axis=1)
        joint = phase * np.exp(log_emission - top[:, None])
        total = np.maximum(joint.sum(axis=1), 1e-300)
        log_ratio = (top + np.log(total) - self._scoring.background) / self._scoring.temperature
        running += log_ratio

        living = (running > -self._scoring.prune_nats) & (
            start > index - self._scoring.window_steps
        )
        self._gesteme, self._start, self._origin = gesteme[living], start[living], origin[living]
        self._running, self._phase = running[living], (joint / total[:, None])[living]
        if self._aligned is not None:
            self._similarity = alignment.updated(
                self._aligned,
                alignment.picked(similarity, living),
                self._gesteme,
                self._phase,
                where[living],
            )
        self._exit_features = self._features_of_exit(here + move, direction)
        self._leaving = exit_probability(self._parameters.exit_weights, self._exit_features)
        return StepEvidence(
            index, self.held, self._gesteme, self._start, exited[living], log_ratio[living]
        )

    def replaced(self, fresh: GestemeBank, keep: Sequence[int]) -> GestemeBank:
        """Return a bank with the pairs of the gestemes `keep` of this one and all of `fresh`.

        `fresh` has been shown the same last steps; it holds none of `keep`.
        """
        bank = GestemeBank(
            self._parameters, self._scoring, self._axes, sorted({*keep, *fresh.held})
        )
        bank._reader = self._reader
        mine = np.isin(self._gesteme, list(keep))
        gesteme = np.concatenate([self._gesteme[mine], fresh._gesteme])
        start = np.concatenate([self._start[mine], fresh._start])
        order = np.lexsort((gesteme, start))
        bank._gesteme, bank._start = gesteme[order], start[order]
        bank._phase = np.concatenate([self._phase[mine], fresh._phase])[order]
        bank._origin = np.concatenate([self._origin[mine], fresh._origin])[order]
        bank._running = np.concatenate([self._running[mine], fresh._running])[order]
        bank._leaving = np.concatenate([self._leaving[mine], fresh._leaving])[order]
        if self._aligned is not None:
            both = alignment.joined(alignment.picked(self._similarity, mine), fresh._similarity)
            bank._similarity = alignment.picked(both, order)
        return bank

    def keep_only(self, start: int) -> None:
        """Forget all pairs but those that began at step `start`."""
        kept = self._start == start
        self._gesteme, self._start, self._origin = (
            self._gesteme[kept],
            self._start[kept],
            self._origin[kept],
        )
        self._running, self._phase = self._running[kept], self._phase[kept]
        self._leaving, self._exit_features = self._leaving[kept], self._exit_features[kept]
        if self._aligned is not None:
            self._similarity = alignment.picked(self._similarity, kept)

    def _log_emissions(self, gesteme: Integers, where: Array, direction: Array) -> Array:
        """Return the log density of what each pair observed in each phase, shape (p, N).

        `where` is each pair's displacement from its origin, (p, D); `direction`, (D,), is the same
        for all, so its share is worked out once a gesteme. Not by `log_gaussian`: summed in this
        order, recordings of earlier versions are replayed to the last bit. Dimension by dimension:
        one sum over a short last axis takes four times as long.
        """
        axes = len(self._axes)
        shared = self._log_scale.copy()
        for f, component in enumerate(direction, start=axes):
            shared -= 0.5 * (component - self._means[f]) ** 2 * self._precisions[f]
        distance = np.zeros((len(gesteme), shared.shape[1]))
        for f, column in enumerate(where.T):
            term = column[:, None] - self._means[f].take(gesteme, axis=0)
            term *= term
            term *= self._precisions[f].take(gesteme, axis=0)
            distance += term
        distance *= -0.5
        distance += shared.take(gesteme, axis=0)
        return distance

    def _predict(self, index: int) -> tuple[Integers, Integers, Array]:
        """Move every pair's phases one step on, given no exit, and start a pair per gesteme."""
        p = self._parameters
        moved = self._phase * p.stay[self._gesteme]
        moved[:, 1:] += (self._phase * p.advance[self._gesteme])[:, :-1]
        moved[:, 2:] += (self._phase * p.skip[self._gesteme])[:, :-2]
        count = len(self._held)
        return (
            np.concatenate([self._gesteme, self._held]),
            np.concatenate([self._start, np.full(count, index, dtype=np.int32)]),
            np.concatenate([moved, p.initial[self._held]]),
        )

    def _features_of_exit(self, there: Array, direction: Array) -> Array:
        p, gesteme = self._parameters, self._gesteme
        likely = self._phase.argmax(axis=1)
        variant = p.variant[gesteme, likely]
        remaining = (self._phase * p.remaining.take(gesteme, axis=0)).sum(axis=1)
        ends, normals = p.ends[gesteme, variant], p.normals[gesteme, variant]
        seen = np.broadcast_to(direction, normals.shape)
        if self._aligned is not None:
            similarity = self._similarity
            remaining = remaining * (1.0 + similarity.growth)
            ends = alignment.placed(similarity, ends)
            normals = alignment.turned(similarity, normals)
            seen = alignment.turned(similarity, seen, back=True)
        return exit_features(
            remaining,
            (there - self._origin - ends) / p.step_m,
            normals,
            seen - p.means[gesteme, likely, len(self._axes) :],
        )


def _possible(parameters: GestemeParameters) -> NDArray[np.bool_]:
    chain = parameters.stay + parameters.advance + parameters.skip
    return np.asarray(chain > 0)
