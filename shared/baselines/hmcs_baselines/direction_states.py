"""Chapter 3's sub-tasks: motion along nominal directions, by a fully connected HMM (3.1).

Nominal directions are found in demonstrations without labels; an estimator says which of them a
step goes along, and the HMM's filtered probabilities (3.5) which is followed.
Shapes: T steps, D axes, K directions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hmcs.arrays import Array
from hmcs.recognition.checking import (
    LEAST_SPREAD,
    check_distributions,
    check_shapes,
    check_within,
)
from hmcs.recognition.hmm.emissions import Estimated
from hmcs.recognition.hmm.learning import CHAIN, baum_welch
from hmcs.recognition.hmm.model import Hmm
from hmcs.recognition.hmm.topologies import fully_connected, start_anywhere
from hmcs_baselines.directions import (
    DirectionError,
    FoundDirections,
    elbow_directions,
    find_directions,
    nominal_direction,
    pooled_directions,
)
from hmcs_baselines.estimators import (
    Estimator,
    EstimatorSettings,
    check_estimator,
    learn_estimator,
    likelihoods,
)
from hmcs_baselines.hmm.bank import ForwardBank
from hmcs_baselines.svm import SvmSettings

Integers = NDArray[np.intp]


class DirectionStateSettings(NamedTuple):
    """How directions and their HMM are learned; the defaults tell a change soonest and surest."""

    discovery: Literal["chords", "recurring-chords", "kmeans-cusum", "labels"] = "chords"
    """Where nominal directions come from: the best chords of demonstrations that all follow one
    order, or that need not; the text's k-means with the elbow by CUSUM; or the mean direction of
    each labeled part."""
    most_directions: int = 15
    """That k-means looks for."""
    estimator: EstimatorSettings = EstimatorSettings()
    """What tells the directions of steps apart."""
    chain: Literal["counted", "baum-welch"] = "counted"
    """Transition probabilities: of the directions that discovery gave the steps, or, as in the
    text, by Baum–Welch from (3.4) with the estimator fixed."""
    stay: float = 0.7
    """Of (3.4)."""
    iterations: int = 50
    """Of Baum–Welch, at most."""
    any_direction: float = 1e-6
    """In each step any direction whatever may follow with this probability."""
    leave_last: float = 1e-3
    """In each step a direction that no demonstration leaves is left for any other with this
    probability. Counted transitions only."""


class DirectionStates(NamedTuple):
    """Nominal directions and the HMM whose states they are."""

    directions: Array
    """Unit vectors, shape (K, D)."""
    support: Array
    """Share of the demonstrations each occurs in, shape (K,)."""
    initial: Array
    """P(direction at the first step), shape (K,)."""
    transition: Array
    """P(direction j at the next step | direction i), shape (K, K)."""
    estimator: Estimator


def thesis_settings() -> DirectionStateSettings:
    """Return the choices of the text and of the notes to it."""
    return DirectionStateSettings(
        discovery="kmeans-cusum",
        estimator=EstimatorSettings(kind="svm", least_ratio=0.0, svm=SvmSettings()),
        chain="baum-welch",
        any_direction=1e-9,
    )


class DirectionFilter:
    """P(direction | steps so far): the filtered probabilities that (3.5) stands for."""

    def __init__(self, knowledge: DirectionStates, *, anywhere: bool = False) -> None:
        """Begin as demonstrations do or, with `anywhere`, with any direction."""
        count = len(knowledge.initial)
        initial = start_anywhere(count) if anywhere else knowledge.initial
        self._estimator = knowledge.estimator
        self._bank = ForwardBank(initial[None], knowledge.transition[None])
        self._log_likelihood = 0.0

    @property
    def log_likelihood(self) -> float:
        """log P(newest step | those before it) against all directions being alike, nats."""
        return self._log_likelihood

    def step(self, direction: ArrayLike) -> Array:
        """Take the next step's direction, shape (D,), of any length; return P(direction), (K,)."""
        seen = likelihoods(self._estimator, unit_rows(np.asarray(direction, dtype=float)[None]))
        with np.errstate(divide="ignore"):
            log_emission = np.log(seen * seen.shape[1])
        self._log_likelihood = float(self._bank.step(log_emission)[0])
        return np.asarray(self._bank.states[0])


def learn_directions(
    sequences: Sequence[ArrayLike],
    settings: DirectionStateSettings,
    rng: np.random.Generator,
    labels: Sequence[ArrayLike] | None = None,
) -> DirectionStates:
    """Return the directions found in demonstrations and the HMM that tells them apart.

    `sequences` are the steps of each demonstration, unit vectors or of their own length, shape
    (T, D). `labels`, for the discovery `labels` only, says of each step which part of the task it
    belongs to, −1 where none, shape (T,).
    Raises DirectionError for demonstrations without directions or whose steps cancel out, and for
    labels that are missing;
    LearningMissingError for support vectors without scikit-learn.
    """
    steps = [np.asarray(sequence, dtype=float) for sequence in sequences]
    found = _found(steps, settings, rng, labels)
    units = [unit_rows(own) for own in steps]
    estimator = learn_estimator(
        np.concatenate(units),
        np.concatenate(found.labels),
        found.directions,
        settings.estimator,
    )
    if settings.chain == "counted":
        initial, transition = counted_chain(
            found.labels, len(found.directions), settings.leave_last
        )
    else:
        initial, transition = _trained_chain(estimator, units, settings)
    count, share = len(found.directions), settings.any_direction
    return DirectionStates(
        found.directions,
        found.support,
        (1.0 - share) * initial + share / count,
        (1.0 - share) * transition + share / count,
        estimator,
    )


def counted_chain(labels: Sequence[Integers], count: int, leave_last: float) -> tuple[Array, Array]:
    """Return initial and transition probabilities counted in sequences of directions, (T,) each.

    A direction that is never left, or does not occur, is left with the probability `leave_last`,
    for any other alike.
    """
    counts = np.zeros((count, count))
    for own in labels:
        np.add.at(counts, (own[:-1], own[1:]), 1.0)
    initial = np.bincount([own[0] for own in labels], minlength=count) / len(labels)
    left = counts.sum(axis=1) > counts.diagonal()
    rows = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1.0)
    return initial, np.where(left[:, None], rows, fully_connected(count, 1.0 - leave_last))


def unit_rows(steps: Array) -> Array:
    """Return the directions of steps, shape (T, D); a step of length zero has none and stays 0."""
    length = np.linalg.norm(steps, axis=-1, keepdims=True)
    return np.asarray(steps / np.where(length > 0, length, 1.0))


def check_direction_states(states: DirectionStates, axes: int) -> None:
    """Raise ValueError where the arrays do not fit together, or not so many axes."""
    count = states.initial.size
    shapes = {
        "directions": (count, axes),
        "support": (count,),
        "initial": (count,),
        "transition": (count, count),
    }
    check_shapes(states._asdict(), shapes)
    check_within("directions", states.directions, -1.001, 1.001)
    check_within("support", states.support, 0.0, 1.0)
    for field in ("initial", "transition"):
        rows = getattr(states, field)
        check_distributions(field, rows)
        check_within(field, rows, LEAST_SPREAD, 1.0)
    check_estimator(states.estimator, count, axes)


def _found(
    steps: Sequence[Array],
    settings: DirectionStateSettings,
    rng: np.random.Generator,
    labels: Sequence[ArrayLike] | None,
) -> FoundDirections:
    positions = [np.vstack([np.zeros_like(own[:1]), own.cumsum(axis=0)]) for own in steps]
    if settings.discovery == "chords":
        return find_directions(positions)
    if settings.discovery == "recurring-chords":
        return pooled_directions(positions)
    if settings.discovery == "kmeans-cusum":
        seen = unit_rows(np.concatenate([np.diff(own, axis=0) for own in positions]))
        distinct = len(np.unique(seen[seen.any(axis=1)], axis=0))
        if distinct > 1:
            return elbow_directions(positions, rng, most=min(settings.most_directions, distinct))
        return _labeled(steps, [np.zeros(len(own), dtype=np.intp) for own in steps])
    return _labeled(steps, labels)


def _labeled(steps: Sequence[Array], labels: Sequence[ArrayLike] | None) -> FoundDirections:
    """The mean direction of each labeled part; steps without a label have the nearest."""
    if labels is None:
        raise DirectionError("no labels to take directions from: give them, or find directions")
    given = [np.asarray(own, dtype=np.intp) for own in labels]
    units = [unit_rows(own) for own in steps]
    parts = np.unique(np.concatenate(given))
    parts = parts[parts >= 0]
    if not len(parts):
        raise DirectionError("no step has a label: label a part of a demonstration at least")
    stacked, part = np.concatenate(units), np.concatenate(given)
    directions = np.array([nominal_direction(stacked[part == p].sum(axis=0)) for p in parts])
    known = [
        np.where(own >= 0, np.searchsorted(parts, own), (unit @ directions.T).argmax(axis=1))
        for unit, own in zip(units, given, strict=True)
    ]
    support = np.array([np.mean([(own == p).any() for own in given]) for p in parts])
    return FoundDirections(directions, support, tuple(known))


def _trained_chain(
    estimator: Estimator, units: Sequence[Array], settings: DirectionStateSettings
) -> tuple[Array, Array]:
    """π and A by Baum–Welch with the estimator fixed, from (3.4)."""
    seen = [likelihoods(estimator, own) for own in units if len(own) > 1]
    count = seen[0].shape[1]
    start = Hmm(
        start_anywhere(count),
        fully_connected(count, settings.stay),
        Estimated(start_anywhere(count)),
    )
    learned = baum_welch(start, seen, learn=CHAIN, max_iterations=settings.iterations).model
    return learned.initial, learned.transition
