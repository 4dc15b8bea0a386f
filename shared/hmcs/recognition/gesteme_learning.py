"""Learning gestemes from their segments (thesis 4.1.1).

Each gesteme becomes a left-right Gaussian HMM on (displacement from the segment's start,
direction): phases of equal path length over the demonstrations' mean, variances shrunk toward
those of all gestemes together so that one demonstration is enough to start (MAP), and floors below
which no agreement between demonstrations is believed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.recognition.gestemes import GestemeParameters
from hmcs.recognition.hmm.emissions import Gaussian
from hmcs.recognition.hmm.learning import EMISSION, baum_welch
from hmcs.recognition.hmm.model import Hmm
from hmcs.recognition.segment_filter import FilterSettings
from hmcs.recognition.segments import Segment

Array = NDArray[np.float64]


class LearningSettings(NamedTuple):
    """The choices of learning; defaults are good without tuning."""

    phases_per_step: float = 0.5
    """Phases of a gesteme for each step of its demonstrations' mean length."""
    phases_at_least: int = 3
    position_floor_dead_zones: float = 1.0
    """Standard deviation of positions never below so many dead zones."""
    direction_floor: float = 0.2
    """Standard deviation of unit directions never below this."""
    prior_demonstrations: float = 4.0
    """The variances of all gestemes together count as much as so many demonstrations."""
    prior_position_share: float = 0.05
    """With one demonstration: standard deviation of positions as a share of the path's length."""
    prior_direction: float = 0.3
    """With one demonstration: standard deviation of unit directions."""
    refine_iterations: int = 3
    """Iterations of Baum–Welch on means and variances after the alignment by path length."""
    temperature: float = 4.0
    """See `Scoring`."""
    background_quantile: float = 0.01
    """The background is one temperature below this quantile of the log-likelihoods of steps of
    demonstrations left out of learning."""
    prune_nats: float = 30.0
    window_factor: float = 2.0
    """The window is so many times the longest gesteme of the demonstrations..."""
    window_limit_steps: int = 300
    """...but at most this."""
    alarm_window_steps: int = 20
    alarm_quantile: float = 0.01
    """The alarm's threshold is this quantile of window means on demonstrations left out."""
    filter: FilterSettings = FilterSettings()
    """What the task does not foresee."""


def fit_gestemes(
    by_gesteme: Sequence[Sequence[Segment]],
    axes: Sequence[int],
    dead_zone_m: float,
    settings: LearningSettings,
) -> GestemeParameters:
    """Return the HMM of each gesteme from its segments; see the module's docstring."""
    observed = [[_observations(segment, axes) for segment in own] for own in by_gesteme]
    lengths = [float(np.mean([len(o) for o in own])) for own in observed]
    phases = [
        max(settings.phases_at_least, round(length * settings.phases_per_step))
        for length in lengths
    ]
    aligned = [
        np.stack([_resampled(o, count) for o in own])
        for own, count in zip(observed, phases, strict=True)
    ]
    own_variance = [_smoothed(a.var(axis=0, ddof=1)) if len(a) > 1 else None for a in aligned]
    prior = _prior_variance(own_variance, lengths, len(axes), dead_zone_m, settings)
    floor = np.repeat(
        [settings.position_floor_dead_zones * dead_zone_m, settings.direction_floor], len(axes)
    )
    widest = max(phases)
    shape = (len(by_gesteme), widest, 2 * len(axes))
    means, variances = np.zeros(shape), np.ones(shape)
    chain = np.zeros((5, len(by_gesteme), widest))
    for g, count in enumerate(phases):
        freedom = len(aligned[g]) - 1
        own = own_variance[g]
        variance = prior if own is None else own
        shrunk = (freedom * variance + settings.prior_demonstrations * prior) / (
            freedom + settings.prior_demonstrations
        )
        chain[:, g, :count] = _left_right(count, lengths[g])
        means[g, :count] = aligned[g].mean(axis=0)
        variances[g, :count] = shrunk + floor**2
        if settings.refine_iterations:
            means[g, :count] = _refined(
                means[g, :count], variances[g, :count], chain[:, g, :count], observed[g], settings
            )
    return GestemeParameters(means, variances, *chain)


def _observations(segment: Segment, axes: Sequence[int]) -> Array:
    """Displacement from the segment's origin after each step, and its direction, shape (T, 2D)."""
    moves = np.array([step.displacement for step in segment.steps])[:, list(axes)]
    lengths = np.linalg.norm(moves, axis=1, keepdims=True)
    return np.hstack([np.cumsum(moves, axis=0), moves / np.maximum(lengths, 1e-12)])


def _resampled(observations: Array, count: int) -> Array:
    """Observations at the centers of `count` stretches of equal length, shape (count, F)."""
    given = (np.arange(len(observations)) + 0.5) / len(observations)
    wanted = (np.arange(count) + 0.5) / count
    return np.stack([np.interp(wanted, given, column) for column in observations.T], axis=1)


def _smoothed(variance: Array, reach: int = 2) -> Array:
    """Mean over neighboring phases: few demonstrations tell little about one phase alone."""
    padded = np.pad(variance, ((reach, reach), (0, 0)), mode="edge")
    width = 2 * reach + 1
    return np.asarray(np.mean([padded[k : k + len(variance)] for k in range(width)], axis=0))


def _prior_variance(
    own: Sequence[Array | None],
    lengths: Sequence[float],
    dimensions: int,
    dead_zone_m: float,
    settings: LearningSettings,
) -> Array:
    seen = [variance.mean(axis=0) for variance in own if variance is not None]
    if seen:
        return np.asarray(np.mean(seen, axis=0))
    position = settings.prior_position_share * float(np.mean(lengths)) * dead_zone_m
    return np.repeat([position**2, settings.prior_direction**2], dimensions)


def _left_right(phases: int, length: float) -> Array:
    """Initial, stay, advance, skip, leave, each (phases,), for a mean length in steps.

    A phase lasts length / phases steps on average; the excess below covers faster and slower hands.
    """
    dwell = max(length / phases, 0.5)
    stay = max(1.0 - 1.0 / dwell, 0.0) + 0.08
    skip = max(1.0 / dwell - 1.0, 0.0) + 0.08
    advance = 1.0 / dwell - 2.0 * max(1.0 / dwell - 1.0, 0.0) + 0.02
    stay, advance, skip = np.array([stay, advance, skip]) / (stay + advance + skip)
    chain = np.zeros((5, phases))
    chain[0, :2] = 0.8, 0.2
    chain[1] = stay
    chain[2, :-1], chain[4, -1] = advance, advance + skip
    chain[3, :-2], chain[4, -2] = skip, skip
    return chain


def _refined(
    means: Array,
    variances: Array,
    chain: Array,
    sequences: Sequence[Array],
    settings: LearningSettings,
) -> Array:
    count = len(means)
    transition = np.diag(chain[1]) + np.diag(chain[2, :-1], 1) + np.diag(chain[3, :-2], 2)
    learned = baum_welch(
        Hmm(chain[0], transition[:count, :count], Gaussian(means, variances)),
        sequences,
        learn=EMISSION,
        max_iterations=settings.refine_iterations,
    )
    return learned.model.emission.means
