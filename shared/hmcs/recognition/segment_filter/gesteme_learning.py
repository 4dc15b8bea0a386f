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

from hmcs.arrays import Array
from hmcs.recognition.hmm.emissions import Gaussian
from hmcs.recognition.hmm.learning import EMISSION, baum_welch
from hmcs.recognition.hmm.model import Hmm
from hmcs.recognition.segment_filter.exits import DEFAULT_WEIGHTS
from hmcs.recognition.segment_filter.filter import FilterSettings
from hmcs.recognition.segment_filter.gestemes import LONGEST_WINDOW_STEPS, GestemeParameters
from hmcs.recognition.segment_filter.sensor_densities import (
    SensorDensities,
    SensorWeights,
    sensor_rows,
    sensor_weights,
    sensors_used,
    variance_floors,
)
from hmcs.recognition.segment_filter.variants import VariantSettings, split_into_variants
from hmcs.recognition.segments import Segment


class LearningSettings(NamedTuple):
    """The choices of learning; defaults are good without tuning."""

    phases_per_step: float = 0.8
    """Phases of a gesteme for each step of its demonstrations' mean length."""
    phases_at_least: int = 3
    position_floor_steps: float = 1.0
    """Standard deviation of positions never below so many steps."""
    direction_floor: float = 0.1
    """Standard deviation of unit directions never below this."""
    prior_demonstrations: float = 4.0
    """The variances of all gestemes together count as much as so many demonstrations."""
    prior_position_share: float = 0.05
    """With one demonstration: standard deviation of positions as a share of the path's length."""
    prior_direction: float = 0.3
    """With one demonstration: standard deviation of unit directions."""
    refine_iterations: int = 3
    """Iterations of Baum–Welch on means and variances after the alignment by path length."""
    variants: VariantSettings = VariantSettings()
    """When demonstrations of one gesteme are so far apart that they are different motions."""
    senses: SensorWeights = SensorWeights()
    """Further senses, and how much each counts."""
    temperature: float = 4.0
    """See `Scoring`."""
    alignment_sigma: float = 0.0
    """Standard deviation of size and turn (rad) in which a gesteme may be performed; 0.16
    recognizes ±30 % and ±15°, 0 takes gestemes as they were demonstrated."""
    background_quantile: float = 0.01
    """The background is one temperature below this quantile of the log-likelihoods of steps of
    demonstrations left out of learning."""
    prune_nats: float = 30.0
    window_factor: float = 2.0
    """The window is so many times the longest gesteme of the demonstrations..."""
    window_limit_steps: int = LONGEST_WINDOW_STEPS
    """...but at most this. Starts long ago cost little: hardly any of them lives on."""
    alarm_window_steps: int = 20
    unknown_rise: float = 0.9
    """The background is raised by so much of the alarm's threshold: then unknown motion is not
    only raises the alarm but becomes the most probable state of the filter."""
    filter: FilterSettings = FilterSettings()
    """What the task does not foresee."""


class _Fitted(NamedTuple):
    """One variant of a gesteme."""

    gesteme: int
    share: float
    """Of the gesteme's demonstrations."""
    means: Array
    variances: Array
    chain: Array
    """Initial, stay, advance, skip, each (phases,)."""
    remaining: Array
    end: Array
    normal: Array
    sense_means: Array
    sense_variances: Array


def fit_gestemes(
    by_gesteme: Sequence[Sequence[Segment]], axes: Sequence[int], settings: LearningSettings
) -> GestemeParameters:
    """Return the HMMs of all gestemes from their segments; see the module's docstring.

    The exit is the default one: it is learned from segments left out, see `learning`.
    """
    motions = [[segment.trajectory(axes) for segment in own] for own in by_gesteme]
    split = split_into_variants([[m.positions for m in own] for own in motions], settings.variants)
    groups = [(g, group) for g, own in enumerate(split) for group in own]
    models = [(g, [motions[g][k] for k in group]) for g, group in groups]
    names = sensors_used([s for own in by_gesteme for s in own], settings.senses)
    felt = [[sensor_rows(by_gesteme[g][k], names) for k in group] for g, group in groups]
    sense_floor = variance_floors([rows for own in felt for rows in own])
    step_m = float(np.mean([length for _, own in models for m in own for length in m.lengths]))
    observed = [[m.observations for m in own] for _, own in models]
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
    prior = _prior_variance(own_variance, lengths, len(axes), step_m, settings)
    floor = np.repeat([settings.position_floor_steps * step_m, settings.direction_floor], len(axes))
    fitted = []
    for k, (g, own_motions) in enumerate(models):
        count, own = phases[k], own_variance[k]
        freedom = len(aligned[k]) - 1
        variance = prior if own is None else own
        shrunk = (freedom * variance + settings.prior_demonstrations * prior) / (
            freedom + settings.prior_demonstrations
        )
        means = aligned[k].mean(axis=0)
        variances = np.broadcast_to(shrunk + floor**2, means.shape)
        chain = _left_right(count, lengths[k])
        if settings.refine_iterations:
            means = _refined(means, variances, chain, observed[k], settings)
        sensed = np.stack([_resampled(rows, count) for rows in felt[k]])
        fitted.append(
            _Fitted(
                g,
                len(own_motions) / len(by_gesteme[g]),
                means,
                variances,
                chain,
                (count - 0.5 - np.arange(count)) * lengths[k] / count,
                np.mean([m.positions[-1] for m in own_motions], axis=0),
                _unit(np.mean([m.passing for m in own_motions], axis=0)),
                sensed.mean(axis=0),
                _smoothed(sensed.var(axis=0)) + sense_floor,
            )
        )
    weights = sensor_weights(names, settings.senses)
    return _packed(fitted, len(by_gesteme), len(axes), step_m, names, weights)


def _packed(
    fitted: Sequence[_Fitted],
    gestemes: int,
    dimensions: int,
    step_m: float,
    sense_names: tuple[str, ...],
    sense_weights: Array,
) -> GestemeParameters:
    own = [[f for f in fitted if f.gesteme == g] for g in range(gestemes)]
    widest = max(sum(len(f.means) for f in variants) for variants in own)
    most = max(len(variants) for variants in own)
    shape = (gestemes, widest)
    means, variances = np.zeros((*shape, 2 * dimensions)), np.ones((*shape, 2 * dimensions))
    chain, remaining = np.zeros((4, *shape)), np.zeros(shape)
    variant = np.zeros(shape, dtype=np.int32)
    ends, normals = np.zeros((2, gestemes, most, dimensions))
    sense_means = np.zeros((*shape, len(sense_weights)))
    sense_variances = np.ones_like(sense_means)
    for g, variants in enumerate(own):
        begin = 0
        for v, f in enumerate(variants):
            here = slice(begin, begin + len(f.means))
            means[g, here], variances[g, here] = f.means, f.variances
            chain[:, g, here] = f.chain
            chain[0, g, here] *= f.share
            remaining[g, here], variant[g, here] = f.remaining, v
            ends[g, v], normals[g, v] = f.end, f.normal
            sense_means[g, here], sense_variances[g, here] = f.sense_means, f.sense_variances
            begin = here.stop
    initial, stay, advance, skip = chain
    return GestemeParameters(
        means=means,
        variances=variances,
        initial=initial,
        stay=stay,
        advance=advance,
        skip=skip,
        remaining=remaining,
        variant=variant,
        ends=ends,
        normals=normals,
        exit_weights=DEFAULT_WEIGHTS,
        step_m=step_m,
        senses=SensorDensities(sense_names, sense_means, sense_variances, sense_weights),
    )


def _unit(vector: Array) -> Array:
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-12))


def _resampled(observations: Array, count: int) -> Array:
    """Observations at the centers of `count` stretches of equal length, shape (count, F)."""
    given = (np.arange(len(observations)) + 0.5) / len(observations)
    wanted = (np.arange(count) + 0.5) / count
    columns = [np.interp(wanted, given, column) for column in observations.T]
    return np.ascontiguousarray(np.array(columns).reshape(len(columns), count).T)


def _smoothed(variance: Array, reach: int = 2) -> Array:
    """Mean over neighboring phases: few demonstrations tell little about one phase alone."""
    padded = np.pad(variance, ((reach, reach), (0, 0)), mode="edge")
    width = 2 * reach + 1
    return np.asarray(np.mean([padded[k : k + len(variance)] for k in range(width)], axis=0))


def _prior_variance(
    own: Sequence[Array | None],
    lengths: Sequence[float],
    dimensions: int,
    step_m: float,
    settings: LearningSettings,
) -> Array:
    seen = [variance.mean(axis=0) for variance in own if variance is not None]
    if seen:
        return np.asarray(np.mean(seen, axis=0))
    position = settings.prior_position_share * float(np.mean(lengths)) * step_m
    return np.repeat([position**2, settings.prior_direction**2], dimensions)


def _left_right(phases: int, length: float) -> Array:
    """Initial, stay, advance and skip, each (phases,), for a mean length in steps.

    A phase lasts length / phases steps on average; the excess below covers faster and slower hands.
    A hand that does not leave stays in the last phase.
    """
    dwell = max(length / phases, 0.5)
    stay = max(1.0 - 1.0 / dwell, 0.0) + 0.08
    skip = max(1.0 / dwell - 1.0, 0.0) + 0.08
    advance = 1.0 / dwell - 2.0 * max(1.0 / dwell - 1.0, 0.0) + 0.02
    stay, advance, skip = np.array([stay, advance, skip]) / (stay + advance + skip)
    chain = np.zeros((4, phases))
    chain[0, :2] = 0.8, 0.2
    chain[1], chain[2, :-1], chain[3, :-2] = stay, advance, skip
    chain[2, -2] += skip
    chain[1, -1] = 1.0
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
