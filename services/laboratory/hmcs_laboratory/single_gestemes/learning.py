"""Learning what `single_gestemes` knows, from examples of each gesteme.

Shapes as there; n examples altogether.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hmcs.arrays import Array
from hmcs.recognition.segment_filter.variants import VariantSettings, split_into_variants
from hmcs_laboratory.single_gestemes.closed_loop_learning import ClosedLoopSettings, fit_closed_loop
from hmcs_laboratory.single_gestemes.model import (
    Beginnings,
    Shapes,
    SingleGestemeError,
    SingleGestemes,
    checked_motion,
    pooled,
    voices,
)
from hmcs_laboratory.single_gestemes.shape_vectors import (
    HandSettings,
    beginning_vector,
    expected_covariance,
    whole_vector,
)
from hmcs_laboratory.single_gestemes.shrinkage import Discriminants, class_means, shared_covariance

Indices = NDArray[np.intp]
Motions = Sequence[Sequence[Array]]


class SingleSettings(NamedTuple):
    """The choices of learning; defaults are good without tuning."""

    points: int = 12
    """Points along a whole motion that are compared."""
    beginning_points: int = 6
    """Points along a beginning; one of fewer steps is left to the closed loop."""
    length_ratio: float = 1.1
    """Beginnings are learned at lengths that grow by this, and by a step at least."""
    least_log_length_deviation: float = 0.05
    closed_loop: ClosedLoopSettings = ClosedLoopSettings()
    variants: VariantSettings = VariantSettings()
    hand: HandSettings = HandSettings()
    """Stands in for the examples where no motion was performed twice."""
    weights: tuple[float, float] = (0.5, 0.5)
    """Of the closed loop and the shape, where nothing is known of what they are worth."""
    one_weights: tuple[float, float] = (0.06, 0.3)
    """The same of whole motions, where no gesteme was performed twice."""
    one_beginning_weights: tuple[float, float] = (0.3, 0.15)
    """The same of beginnings."""
    log_weight_deviation: float = 0.7
    """Standard deviation of the logarithms of weights about those, before anything is left out."""
    rounds: int = 3
    """So many times an example of each gesteme is left out to learn the weights; 0 never."""
    beginnings: tuple[float, ...] = (0.25, 0.5)
    """Shares of the examples left out that are seen, for the weights of beginnings."""


DEFAULT_SETTINGS = SingleSettings()

_FEWEST_TO_LEAVE_OUT = 3
"""With fewer examples of every gesteme, those that remain are no measure."""


def learn_single(
    examples: Sequence[Sequence[ArrayLike]], settings: SingleSettings = DEFAULT_SETTINGS
) -> SingleGestemes:
    """Return what is known of gestemes from examples of each; one is enough to start.

    `examples[g]` are whole performances of gesteme g: positions, shape (T, D), T of 2 at least, D
    2 or 3, a sample a step. Where nothing can be left out, the weights are those of the settings.
    Raises SingleGestemeError for no gesteme, a gesteme without examples, and an example that is
    empty, not finite, of another dimension, or never moves.
    """
    motions = _checked(examples)
    most = max(len(own) for own in motions)
    learned = _learned(motions, settings)
    if most == 1:
        return learned._replace(
            whole_weights=np.array(settings.one_weights),
            beginning_weights=np.array(settings.one_beginning_weights),
        )
    if most < _FEWEST_TO_LEAVE_OUT or not settings.rounds:
        return learned
    usual = settings.weights
    whole, beginnings, labels = _judged(motions, settings)
    return learned._replace(
        whole_weights=pool_weights([whole], labels, usual, settings.log_weight_deviation),
        beginning_weights=pool_weights(beginnings, labels, usual, settings.log_weight_deviation),
    )


def pool_weights(
    views: Sequence[Array], labels: Indices, usual: Sequence[float], deviation: float
) -> Array:
    """Return the weights, (W,), with which voices are pooled best: a MAP estimate.

    `views` are log posteriors of voices, shape (W, n, G) each, of the same n motions with gestemes
    `labels`; several views of one motion count as one. A weight is log-normal about the usual one
    beforehand. The best of a grid of factors from 1/16 to 4 is taken.
    """
    factors = np.geomspace(1.0 / 16.0, 4.0, 25)
    rows = np.arange(len(labels))

    def badness(chosen: tuple[float, ...]) -> float:
        weights = np.asarray(usual) * chosen
        lost = [-pooled(view, weights)[rows, labels].sum() for view in views]
        return float(np.mean(lost) + 0.5 * (np.log(chosen) ** 2).sum() / deviation**2)

    best = min(product(factors, repeat=len(usual)), key=badness)
    return np.asarray(np.asarray(usual) * best)


def _checked(examples: Sequence[Sequence[ArrayLike]]) -> list[list[Array]]:
    if not len(examples):
        raise SingleGestemeError("no gestemes: give examples of one at least")
    motions: list[list[Array]] = []
    dimensions = None
    for g, own in enumerate(examples):
        if not len(own):
            raise SingleGestemeError(f"gesteme {g} has no examples: give one at least")
        motions.append([])
        for k, positions in enumerate(own):
            name = f"positions of example {k} of gesteme {g}"
            moved = checked_motion(positions, name, dimensions)
            if len(moved) < 2:
                raise SingleGestemeError(f"{name} never move: leave the example out")
            dimensions = moved.shape[1]
            motions[-1].append(moved - moved[0])
    return motions


def _learned(motions: Motions, settings: SingleSettings) -> SingleGestemes:
    split = split_into_variants(motions, settings.variants)
    variants = [(g, group) for g, groups in enumerate(split) for group in groups]
    by_variant = [[motions[g][k] for k in group] for g, group in variants]
    shares = [len(group) / len(motions[g]) for g, group in variants]
    return SingleGestemes(
        np.array([g for g, _ in variants]),
        np.log(shares),
        fit_closed_loop(by_variant, settings.closed_loop),
        _shapes(by_variant, settings),
        np.array(settings.weights),
        np.array(settings.weights),
    )


def _shapes(by_variant: Motions, settings: SingleSettings) -> Shapes:
    everything = [positions for own in by_variant for positions in own]
    variant = np.repeat(np.arange(len(by_variant)), [len(own) for own in by_variant])
    lengths = np.array([len(positions) - 1 for positions in everything])

    points = settings.beginning_points
    whole = _discriminants(
        [whole_vector(positions, settings.points) for positions in everything],
        variant,
        lambda: expected_covariance(everything, settings.points, settings.hand, whole=True),
    )
    steps = _grid(points, int(lengths.max()), settings.length_ratio)
    parts = [_of_beginnings(everything, variant, count, settings) for count in steps]
    features = points * everything[0].shape[1]
    log_lengths = np.log(lengths)
    mean = class_means(log_lengths[:, None], variant)[:, 0]
    spread = float(np.sqrt(((log_lengths - mean[variant]) ** 2).mean()))
    if len(everything) == len(by_variant):
        spread = settings.hand.log_length
    return Shapes(
        settings.points,
        points,
        whole,
        Beginnings(
            np.array(steps, dtype=np.intp),
            np.array([part.means for part in parts]).reshape(-1, len(by_variant), features),
            np.array([part.precision for part in parts]).reshape(-1, features, features),
        ),
        mean,
        max(spread, settings.least_log_length_deviation),
    )


def _of_beginnings(
    everything: Sequence[Array], variant: Indices, steps: int, settings: SingleSettings
) -> Discriminants:
    points = settings.beginning_points
    begun = [positions[: steps + 1] for positions in everything]
    return _discriminants(
        [beginning_vector(positions, steps, points) for positions in everything],
        variant,
        lambda: expected_covariance(begun, points, settings.hand, whole=False),
    )


def _discriminants(
    vectors: Sequence[Array], variant: Indices, expected: Callable[[], Array]
) -> Discriminants:
    """Of the examples' own covariance, or of the one expected where no two tell of any."""
    stacked = np.stack(vectors)
    covariance = shared_covariance(stacked, variant)
    precision = np.linalg.inv(expected() if covariance is None else covariance)
    return Discriminants(class_means(stacked, variant), np.asarray(precision, dtype=np.float64))


def _grid(first: int, last: int, ratio: float) -> list[int]:
    steps = []
    count = first
    while count <= last:
        steps.append(count)
        count = max(count + 1, round(count * ratio))
    return steps


def _judged(motions: Motions, settings: SingleSettings) -> tuple[Array, list[Array], Indices]:
    """Log posteriors of examples left out: whole, (2, n, G), and of each share seen; labels."""
    whole: list[Array] = []
    parts: list[list[Array]] = [[] for _ in settings.beginnings]
    labels: list[int] = []
    for turn in range(min(settings.rounds, max(len(own) for own in motions))):
        # A gesteme with one example keeps it.
        left_out = [g for g, own in enumerate(motions) if turn < len(own) and len(own) > 1]
        rest = [
            [positions for k, positions in enumerate(own) if k != turn or g not in left_out]
            for g, own in enumerate(motions)
        ]
        known = _learned(rest, settings)
        tried = [motions[g][turn] for g in left_out]
        whole.append(voices(known, tried, whole=True))
        for share, part in zip(settings.beginnings, parts, strict=True):
            begun = [p[: max(2, int(np.ceil(share * len(p))))] for p in tried]
            part.append(voices(known, begun, whole=False))
        labels += left_out
    return (
        np.concatenate(whole, axis=1),
        [np.concatenate(part, axis=1) for part in parts],
        np.array(labels),
    )
