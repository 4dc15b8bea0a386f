"""Task models that observe a classifier below instead of the process (thesis 2.1.3, 4.1.2).

Evidence from below is a distribution q over M symbols for each step; a winner is one that is sure.
Shapes: N states, T steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hmcs.arrays import Array
from hmcs.recognition.hmm.emissions import Discrete, ObservationError, Observations
from hmcs.recognition.hmm.learning import CHAIN, baum_welch
from hmcs.recognition.hmm.model import Hmm
from hmcs_baselines.hmm.markov import checked_states


@dataclass(frozen=True, eq=False)
class SoftSymbols:
    """Distributions over symbols in the place of symbols; a sequence has shape (T, M)."""

    symbols: Discrete
    """B of the symbols themselves."""

    @property
    def states(self) -> int:
        """N."""
        return self.symbols.states

    def log_likelihood(self, observations: Observations) -> Array:
        """Return log Σ_k B[i, k]·q_k, shape (T, N); raises ObservationError for another shape."""
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(self.checked(observations) @ self.symbols.probabilities.T))

    def reestimated(
        self, sequences: Sequence[Observations], posteriors: Sequence[Array]
    ) -> SoftSymbols:
        """Return the emission with B from expected counts, the symbol as hidden as the state."""
        B = self.symbols.probabilities
        counts = np.zeros_like(B)
        for observations, posterior in zip(sequences, posteriors, strict=True):
            q = self.checked(observations)
            evidence = q @ B.T
            share = np.divide(posterior, evidence, out=np.zeros_like(evidence), where=evidence > 0)
            counts += B * (share.T @ q)
        return SoftSymbols(self.symbols.from_counts(counts))

    def checked(self, observations: Observations) -> Array:
        """Return the evidence if it is of this kind; raises ObservationError otherwise."""
        q = np.asarray(observations, dtype=float)
        count = self.symbols.probabilities.shape[1]
        if q.ndim != 2 or q.shape[1] != count or not (q >= 0).all():
            raise ObservationError(
                f"evidence of shape {q.shape}: give a distribution over {count} symbols for each "
                f"observation, shape (T, {count})"
            )
        return q


def learn_task(
    start: Hmm[Discrete],
    evidence: Sequence[Array],
    labels: Sequence[ArrayLike],
    *,
    floor: float,
    max_iterations: int = 20,
) -> Hmm[Discrete]:
    """Return the task HMM learned as in 4.1.2.

    B is counted: how often each symbol was passed up in each labeled state, none below `floor`.
    Initial and transition probabilities come from Baum–Welch with B fixed, from those of `start`;
    with distributions as evidence symbols count by their shares. `evidence` are outputs of the
    layer below, (T, M), `labels` the state at each, (T,).
    Raises ObservationError when they do not fit together or a state has no label, MarkovModelError
    for a label that is no state, and what `baum_welch` raises.
    """
    states, symbols = start.emission.probabilities.shape
    if len(evidence) != len(labels) or not len(evidence):
        raise ObservationError(
            f"{len(evidence)} sequences of evidence and {len(labels)} of labels: give as many of "
            "both, one or more"
        )
    observed = SoftSymbols(start.emission)
    counts = np.zeros((states, symbols))
    for number, (outputs, sequence) in enumerate(zip(evidence, labels, strict=True)):
        path = checked_states(sequence, states)
        q = observed.checked(outputs)
        if len(q) != len(path):
            raise ObservationError(
                f"sequence {number} has {len(q)} outputs and {len(path)} labels: give one label "
                "for each output"
            )
        np.add.at(counts, path, q)
    unseen = np.flatnonzero(counts.sum(axis=1) == 0)
    if len(unseen):
        raise ObservationError(
            f"no label is state {unseen[0]}: label a sequence in which it happens"
        )
    emission = Discrete(start.emission.probabilities, floor).from_counts(counts)
    learned = baum_welch(
        Hmm(start.initial, start.transition, SoftSymbols(emission)),
        evidence,
        learn=CHAIN,
        max_iterations=max_iterations,
    )
    return Hmm(learned.model.initial, learned.model.transition, emission)
