"""Layered hidden Markov models with any number of layers (thesis 2.1.3, 4.1).

A layer holds hidden Markov models that run in parallel over a window of what comes from below and
says which of them it is; a layer of one model says which of its states it is in. Layer 0 observes
the process (the text counts from the top: its level N); each layer above observes the layer below,
either the winner (winner takes all) or the whole distribution q over its M classes, over which it
marginalizes its B: P(q | state i) = Σ_k B[i, k]·q_k. A winner is the distribution that is sure, so
both take the same way. When to restart a layer is decided by the caller.
Shapes: K models in a layer, N states in the largest of them, M classes of the layer below.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal, NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs.recognition.hmm.emissions import Discrete, Emission, Observations
from hmcs.recognition.hmm.inference import ImpossibleSequenceError
from hmcs.recognition.hmm.model import Hmm, validate
from hmcs_baselines.hmm.markov import checked_rows
from hmcs_baselines.hmm.soft_evidence import SoftSymbols

Passes = Literal["winner", "distribution"]


class LayerError(UserError, ValueError):
    """Layers that do not fit together, or no such layer; says which and why."""


@dataclass(frozen=True, eq=False)
class Layer:
    """Models in parallel, and how the layer sees and passes on.

    Raises LayerError when there is no model or a setting is out of range; ModelError when a model
    is none; MarkovModelError when `prior` is no distribution.
    """

    models: tuple[Hmm[Any], ...]
    """Over any emission at layer 0, over `Discrete` above it."""
    window: int | None = None
    """The last so many observations count; None: all since the restart."""
    granularity: int = 1
    """One output upward for every so many observations, from their mean classification."""
    passes: Passes = "winner"
    """What goes upward: the winner of the mean classification, or the mean itself."""
    prior: Array | None = None
    """P(model), shape (K,); None: all alike."""

    def __post_init__(self) -> None:
        if not self.models:
            raise LayerError("a layer without a model: give one or more")
        for model in self.models:
            validate(model)
        if (self.window is not None and self.window < 1) or self.granularity < 1:
            raise LayerError(
                f"window {self.window} and granularity {self.granularity}: give 1 or more "
                "(or no window: all since the restart)"
            )
        if self.passes not in ("winner", "distribution"):
            raise LayerError(f"passes is {self.passes!r}: 'winner' or 'distribution' is expected")
        if self.prior is not None:
            checked_rows(np.asarray(self.prior)[None], "the prior of a layer", len(self.models))

    @property
    def classes(self) -> int:
        """M, what the layer tells apart: its models, or the states of its only model."""
        return len(self.models) if len(self.models) > 1 else len(self.models[0].initial)


class LayerBelief(NamedTuple):
    """What a layer makes of its window."""

    models: Array
    """P(model | window), shape (K,)."""
    states: tuple[Array, ...]
    """P(model k and its state i at the last observation | window), a shape (N_k,) for each model;
    all of them together sum to one."""
    output: Array | None
    """What went upward at this step, shape (M,), or None when nothing did."""

    @property
    def classification(self) -> Array:
        """P(class | window), shape (M,): of the models, or of the states of the only model."""
        return self.models if len(self.models) > 1 else self.states[0]


class LayerStackFilter:
    """Moves the belief of every layer from observation to observation."""

    def __init__(self, layers: Sequence[Layer]) -> None:
        """Stand before the first observation; `layers` come lowest first.

        Raises LayerError when there are none, or a layer does not observe the classes of the one
        below.
        """
        if not layers:
            raise LayerError("no layers: give one or more, lowest first")
        for number, (below, layer) in enumerate(pairwise(layers), start=1):
            _check_observes(number, layer, below.classes)
        self._banks = [_Bank(number, layer) for number, layer in enumerate(layers)]
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._states = [bank.start() for bank in self._banks]
        self._beliefs = [
            bank.belief(state) for bank, state in zip(self._banks, self._states, strict=True)
        ]

    def restart(self, layer: int) -> None:
        """Let a layer forget its window and what it has not yet passed on; others keep theirs.

        Raises LayerError when there is no such layer.
        """
        if not 0 <= layer < len(self._banks):
            raise LayerError(f"no layer {layer}: there are 0 to {len(self._banks) - 1}")
        self._states[layer] = self._banks[layer].start()
        self._beliefs[layer] = self._banks[layer].belief(self._states[layer])

    def step(self, observation: Any) -> tuple[LayerBelief, ...]:
        """Return the belief of every layer, lowest first, after one more observation.

        A layer that nothing reached keeps its belief (before its first observation, the prior).
        Raises ObservationError when layer 0 cannot take the observation, ImpossibleSequenceError
        when no model of a layer gives its window a probability; the filter stays as it was.
        """
        states = list(self._states)
        beliefs = [belief._replace(output=None) for belief in self._beliefs]
        evidence: Any = observation
        for number, bank in enumerate(self._banks):
            states[number], beliefs[number] = bank.advanced(states[number], evidence)
            evidence = beliefs[number].output
            if evidence is None:
                break
        self._states, self._beliefs = states, beliefs
        return tuple(beliefs)


def run(
    layers: Sequence[Layer],
    observations: Observations,
    restarts: Mapping[int, Collection[int]] | None = None,
) -> list[tuple[LayerBelief, ...]]:
    """Return the beliefs of all layers after each observation.

    `restarts[l]` are the observations before which layer l is restarted. Raises as
    `LayerStackFilter`.
    """
    layered = LayerStackFilter(layers)
    beliefs = []
    for t, observation in enumerate(observations):
        for layer, times in (restarts or {}).items():
            if t in times:
                layered.restart(layer)
        beliefs.append(layered.step(observation))
    return beliefs


class _LayerState(NamedTuple):
    log_alpha: Array
    """log P(o_s..o_t, state i at t | model k) for starts s, oldest first, shape (S, K, N)."""
    seen: int
    """Observations since the restart."""
    total: Array
    """Sum of the classifications since the last output, shape (M,)."""
    waiting: int
    """How many they are."""


class _Bank:
    """The models of a layer side by side, padded to the states of the largest."""

    def __init__(self, number: int, layer: Layer) -> None:
        self._number, self._layer = number, layer
        self._emissions: list[Emission] = [
            SoftSymbols(model.emission) if number else model.emission for model in layer.models
        ]
        self._sizes = [len(model.initial) for model in layer.models]
        count, most = len(self._sizes), max(self._sizes)
        prior = np.full(count, 1.0 / count) if layer.prior is None else layer.prior
        initial, transition = np.zeros((count, most)), np.zeros((count, most, most))
        for k, (model, size) in enumerate(zip(layer.models, self._sizes, strict=True)):
            initial[k, :size] = prior[k] * model.initial
            transition[k, :size, :size] = model.transition
        with np.errstate(divide="ignore"):
            self._log_initial, self._log_transition = np.log(initial), np.log(transition)

    def start(self) -> _LayerState:
        nothing = np.empty((0, *self._log_initial.shape))
        return _LayerState(nothing, 0, np.zeros(self._layer.classes), 0)

    def belief(self, state: _LayerState) -> LayerBelief:
        """Return what is believed of the window from its first start on, without an output."""
        log_joint = state.log_alpha[0] if state.seen else self._log_initial
        joint = np.exp(log_joint - log_joint.max())
        joint /= joint.sum()
        states = tuple(row[:size] for row, size in zip(joint, self._sizes, strict=True))
        return LayerBelief(joint.sum(axis=1), states, None)

    def advanced(self, state: _LayerState, evidence: Any) -> tuple[_LayerState, LayerBelief]:
        moved, log_emission = self._moved(state), self._log_emission(evidence)
        top = log_emission.max(where=np.isfinite(moved).any(axis=0), initial=-np.inf)
        # What all starts and models have in common tells nothing, and may be large.
        log_alpha = moved + (log_emission - (top if np.isfinite(top) else 0.0))
        if not np.isfinite(log_alpha[0]).any():
            raise ImpossibleSequenceError(
                f"layer {self._number}: no model gives its window a probability with observation "
                f"{state.seen} since the restart: check structural zeros and emission floors",
                state.seen,
            )
        state = state._replace(log_alpha=log_alpha, seen=state.seen + 1)
        belief = self.belief(state)
        total, waiting = state.total + belief.classification, state.waiting + 1
        if waiting < self._layer.granularity:
            return state._replace(total=total, waiting=waiting), belief
        mean = total / waiting
        output = np.eye(len(mean))[mean.argmax()] if self._layer.passes == "winner" else mean
        return (
            state._replace(total=np.zeros_like(total), waiting=0),
            belief._replace(output=output),
        )

    def _moved(self, state: _LayerState) -> Array:
        """Return log P(o_s..o_{t−1}, state i at t) for the starts that count at t, (S, K, N).

        A window that slides carries the recursions from all its starts, so that none is redone, as
        it would be with the recursion of `inference` from the window's first observation on.
        """
        window = self._layer.window
        if state.seen == 0:
            return self._log_initial[None]
        log_alpha = state.log_alpha
        if window is not None:
            log_alpha = log_alpha[max(0, len(log_alpha) - (window - 1)) :]
        moved = np.logaddexp.reduce(log_alpha[..., None] + self._log_transition, axis=2)
        if window is not None:
            moved = np.concatenate([moved, self._log_initial[None]])
        return np.asarray(moved)

    def _log_emission(self, evidence: Any) -> Array:
        result = np.full(self._log_initial.shape, -np.inf)
        observation = np.asarray(evidence)[None]
        for k, (emission, size) in enumerate(zip(self._emissions, self._sizes, strict=True)):
            result[k, :size] = emission.log_likelihood(observation)[0]
        return result


def _check_observes(number: int, layer: Layer, classes: int) -> None:
    for k, model in enumerate(layer.models):
        emission = model.emission
        if not isinstance(emission, Discrete):
            raise LayerError(
                f"model {k} of layer {number} has a {type(emission).__name__} emission: a layer "
                "above another observes its classes, give Discrete"
            )
        if emission.probabilities.shape[1] != classes:
            raise LayerError(
                f"model {k} of layer {number} observes {emission.probabilities.shape[1]} symbols: "
                f"the layer below tells {classes} classes apart, give one symbol for each"
            )
