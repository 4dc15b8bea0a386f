"""How long states last: dwell times and durations learned from labeled sequences.

The distributions are those of `semi_markov`; with the mean dwell time alone an ordinary HMM has to
do, whose stays are geometric (Hannaford & Lee 1990, thesis 2.33).
Shapes: N states, T steps of a sequence, D the longest duration, steps.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs_baselines.hmm.markov import checked_rows, checked_states


class DurationError(UserError, ValueError):
    """A model of durations, or evidence for it, that does not fit together; says where."""


def stays(labels: Sequence[ArrayLike], states: int) -> list[list[int]]:
    """Return the lengths, steps, of all stays in each state, from state sequences (T,).

    Raises MarkovModelError for an empty sequence or a state out of range, DurationError for a state
    that is never seen.
    """
    lengths: list[list[int]] = [[] for _ in range(states)]
    for sequence in labels:
        path = checked_states(sequence, states)
        firsts = np.flatnonzero(np.diff(path, prepend=-1))
        for first, length in zip(firsts, np.diff(firsts, append=len(path)), strict=True):
            lengths[path[first]].append(int(length))
    for state, own in enumerate(lengths):
        if not own:
            raise DurationError(f"state {state} is never seen: give a labeled sequence with it")
    return lengths


def learned_durations(
    labels: Sequence[ArrayLike], states: int, longest: int, *, spread_steps: float = 0.0
) -> Array:
    """Return P(a stay lasts d + 1 steps | state), shape (N, D), from labeled state sequences.

    Each stay seen counts for its own length, or with `spread_steps` for the lengths around it by a
    normal density of that standard deviation: a few demonstrations do not show every length.
    Raises as `stays`, and DurationError when a stay is longer than `longest`.
    """
    length = np.arange(1, longest + 1)
    durations = np.zeros((states, longest))
    for state, own in enumerate(stays(labels, states)):
        if max(own) > longest:
            raise DurationError(
                f"a stay in state {state} lasts {max(own)} steps, the longest allowed is "
                f"{longest}: allow longer ones"
            )
        distance = np.abs(length[None] - np.array(own)[:, None])
        weight = (
            np.exp(-0.5 * (distance / spread_steps) ** 2) if spread_steps > 0 else distance == 0
        )
        durations[state] = (weight / weight.sum(axis=1, keepdims=True)).mean(axis=0)
    return durations


def geometric_durations(stay_probability: ArrayLike, longest: int) -> Array:
    """Return the durations (N, D) of an ordinary HMM with A[i, i] = `stay_probability` (N,).

    What lies beyond D counts as D, so that over T ≤ D observations nothing is lost.
    """
    stay = np.asarray(stay_probability, dtype=float)[:, None]
    if ((stay < 0) | (stay > 1)).any() or longest < 1:
        raise DurationError(
            f"stay probabilities {stay.ravel().tolist()} over {longest} steps: give numbers from 0 "
            "to 1, and 1 step or more"
        )
    before = stay ** np.arange(longest)
    return np.concatenate([before[:, :-1] * (1.0 - stay), before[:, -1:]], axis=1)


def mean_dwells_s(labels: Sequence[ArrayLike], states: int, sample_period_s: float) -> Array:
    """Return t̄ of (2.33), the mean time in each state from first to last sample, s, shape (N,).

    Counted so, `dwell_transition` gives the most likely A[i, i]. Raises as `stays`.
    """
    means = [np.mean(own) for own in stays(labels, states)]
    return (np.array(means) - 1.0) * sample_period_s


def dwell_transition(
    mean_dwell_s: ArrayLike, sample_period_s: float, branches: ArrayLike | None = None
) -> Array:
    """Return A (N, N) of Hannaford & Lee (2.33): A[i, i] = t̄ / (t̄ + dt).

    `mean_dwell_s` is t̄, (N,). The rest of each row goes to the next state, or is shared by
    `branches`, (N, N): P(next state | state is left). A row of zeros marks a final state, which is
    never left; without branches the last one is. Raises DurationError for times that are negative
    or not finite and for wrong branches.
    """
    dwell = np.asarray(mean_dwell_s, dtype=float)
    if dwell.ndim != 1 or len(dwell) == 0 or not (np.isfinite(dwell) & (dwell >= 0)).all():
        raise DurationError(f"mean dwell times are {dwell.tolist()}: give 0 s or more per state")
    if not 0 < sample_period_s < np.inf:
        raise DurationError(f"the sample period is {sample_period_s} s: give more than 0 s")
    count = len(dwell)
    shares = np.eye(count, k=1)
    if branches is not None:
        shares = checked_rows(branches, "branches", count, leaving=True)
    total = shares.sum(axis=1)
    final = total == 0
    if (
        shares.shape != (count, count)
        or np.diag(shares).any()
        or not np.allclose(total[~final], 1.0, rtol=0.0, atol=1e-9)
    ):
        raise DurationError(
            f"branches {shares.tolist()}: give a square matrix with a zero diagonal whose rows sum "
            "to 1, or to 0 for a final state"
        )
    stay = np.where(final, 1.0, dwell / (dwell + sample_period_s))
    return np.asarray(np.diag(stay) + (1.0 - stay)[:, None] * shares)
