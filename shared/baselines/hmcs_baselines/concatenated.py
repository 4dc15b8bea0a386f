"""One HMM for a whole task: gesteme HMMs joined by the task's network (Hundtofte et al. 2002).

What is observed does not depend on where the hand is: its direction, the length of its step, and
the force it exerts. Arcs of the network carry no probabilities: whatever may follow is as likely.
Shapes: K slots (one gesteme in one state of the task), L states of all slots in turn, S task
states, M gestemes, F dimensions, T steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.motion.steps import Step
from hmcs.recognition.checking import LEAST_SPREAD, check_shapes, check_spreads, check_within
from hmcs.recognition.hmm.inference import shortest_path, smooth
from hmcs.recognition.model import axes_of
from hmcs.recognition.segmentation import (
    StateSegment,
    edges_where,
    segments_between,
    summed_by,
)
from hmcs.recognition.segments import Segment
from hmcs.recognition.task_chain import TaskChain
from hmcs.task import Task
from hmcs_baselines.gesteme_hmms import (
    GestemeHmms,
    GestemeHmmSettings,
    GestemeScores,
    Normals,
    check_gesteme_hmms,
    learn_gesteme_hmms,
    normals_of,
)

Integers = NDArray[np.int64]


_LEAST_LOG_LENGTH = 0.1
_LEAST_FORCE = 1e-3
"""N or N·m; a sensor that varies less is constant, and in its own unit."""


class NetworkSettings(NamedTuple):
    """How a network of gesteme HMMs is learned."""

    gestemes: GestemeHmmSettings = GestemeHmmSettings()
    """Of each gesteme; the paper varies the number of states."""
    off_network: float = 1e-3
    """Once a gesteme is over, any other follows with this probability, whatever the network says.
    The paper has none: with 0 a task performed in another order is never recognized again."""


class NetworkKnowledge(NamedTuple):
    """A network of gesteme HMMs."""

    hmms: GestemeHmms
    """On direction, log of the step's length over the dead zone and, where the demonstrations
    have it, force and torque; each divided by its scale."""
    leaving: Array
    """P(gesteme over after a step | its last state), shape (M,)."""
    scales: Array
    """Unit in which each dimension is observed, shape (F,): 1 for directions, for the others their
    standard deviation over all demonstrations, 0.1 at least for the log of the length."""
    off_network: float


class Network(NamedTuple):
    """The states of all slots, and what they are part of."""

    initial: Array
    """Shape (L,)."""
    transition: Array
    """Shape (L, L)."""
    slot: Integers
    """Of each state, shape (L,)."""
    within: Integers
    """Index of each state in its gesteme's HMM, shape (L,)."""
    gesteme: Integers
    """Of each state, shape (L,)."""
    task_state: Integers
    """Of each state, shape (L,)."""


def learn_network(
    segments: Sequence[Segment],
    gestemes: int,
    axes: Sequence[int],
    dead_zone_m: float,
    settings: NetworkSettings,
) -> NetworkKnowledge:
    """Return what is learned from segments that cover all gestemes."""
    forced = all(step.wrench is not None for segment in segments for step in segment.steps)
    observed = [observations(segment.steps, axes, dead_zone_m, forced) for segment in segments]
    scales = np.concatenate(observed).std(axis=0)
    scales[: len(axes)] = 1.0
    # What hardly varies is no more telling for that.
    scales[len(axes)] = max(scales[len(axes)], _LEAST_LOG_LENGTH)
    scales[scales < _LEAST_FORCE] = 1.0
    by_gesteme: list[list[Array]] = [[] for _ in range(gestemes)]
    for segment, seen in zip(segments, observed, strict=True):
        by_gesteme[segment.gesteme].append(seen / scales)
    hmms = learn_gesteme_hmms(by_gesteme, None, settings.gestemes, complete=True)
    lengths = [float(np.mean([len(seen) for seen in own])) for own in by_gesteme]
    return NetworkKnowledge(hmms, _leaving(hmms, lengths), scales, settings.off_network)


def observations(
    steps: Sequence[Step], axes: Sequence[int], dead_zone_m: float, forced: bool
) -> Array:
    """Return direction, log length over dead zone and, if `forced`, wrench of steps, (T, F)."""
    moves = np.array([step.displacement for step in steps])[:, list(axes)]
    lengths = np.linalg.norm(moves, axis=1, keepdims=True)
    # A step along none of the axes looked at is hardly one.
    lengths = np.maximum(lengths, 1e-3 * dead_zone_m)
    columns = [moves / lengths, np.log(lengths / dead_zone_m)]
    if forced:
        columns.append(np.array([step.wrench for step in steps]))
    return np.hstack(columns)


def joined(knowledge: NetworkKnowledge, chain: TaskChain) -> Network:
    """Return the HMM of the whole task; it begins in any of the slots the chain may begin in."""
    chains, slots = knowledge.hmms.chains, len(chain.slot_state)
    counts = chains.states[chain.slot_gesteme]
    slot = np.repeat(np.arange(slots), counts)
    first = np.concatenate([[0], np.cumsum(counts)[:-1]])
    within = np.arange(len(slot)) - first[slot]
    transition = np.zeros((len(slot), len(slot)))
    arcs = _arcs(chain, knowledge.off_network)
    for k, (gesteme, begin, count) in enumerate(
        zip(chain.slot_gesteme, first, counts, strict=True)
    ):
        end = begin + count
        transition[begin:end, begin:end] = chains.transition[gesteme, :count, :count]
        leaving = knowledge.leaving[gesteme] * arcs[k].sum()
        transition[end - 1] *= 1.0 - leaving
        transition[end - 1, first] += knowledge.leaving[gesteme] * arcs[k]
    possible = chain.initial[chain.slot_state] > 0
    initial = np.zeros(len(slot))
    initial[first[possible]] = 1.0 / possible.sum()
    return Network(
        initial,
        transition,
        slot,
        within,
        chain.slot_gesteme[slot].astype(np.int64),
        chain.slot_state[slot].astype(np.int64),
    )


class NetworkScores:
    """The log-likelihood of steps under all states of a network."""

    def __init__(
        self,
        knowledge: NetworkKnowledge,
        network: Network,
        axes: Sequence[int],
        dead_zone_m: float,
    ) -> None:
        self._axes, self._dead_zone_m = axes, dead_zone_m
        self._scales = knowledge.scales
        self._where = (network.gesteme, network.within)
        self._scores = GestemeScores(knowledge.hmms)
        self._unforced_count = len(axes) + 1
        self._forced = len(knowledge.scales) > self._unforced_count
        means, variances = normals_of(knowledge.hmms)
        kept = slice(0, self._unforced_count)
        self._unforced = GestemeScores(
            knowledge.hmms._replace(emissions=Normals(means[..., kept], variances[..., kept]))
        )

    def log_emission(self, step: Step) -> Array:
        """Return log P(step | state), shape (L,); a force that is not felt is left out."""
        forced = self._forced and step.wrench is not None
        seen = observations([step], self._axes, self._dead_zone_m, forced)[0]
        scores = self._scores if forced == self._forced else self._unforced
        return np.asarray(scores.log_emission(seen / self._scales[: len(seen)])[self._where])


def most_probable_segments(
    network: Network, log_emission: Array, first: int
) -> tuple[StateSegment, ...]:
    """Return the most probable segmentation of a motion of T ≥ 1 steps (Viterbi).

    `log_emission` has shape (T, L); `first` is the index of the first step. A state that follows
    itself makes two segments.
    """
    path = shortest_path(network.initial, network.transition, log_emission).path
    posterior = smooth(network.initial, network.transition, log_emission).states
    slot, within = network.slot[path], network.within[path]
    # Left-right HMMs never go back: a state of smaller index is another performance.
    return segments_between(
        edges_where((slot[1:] != slot[:-1]) | (within[1:] < within[:-1])),
        network.task_state[path],
        network.gesteme[path],
        summed_by(network.task_state, posterior, int(network.task_state.max()) + 1),
        first,
    )


def _leaving(hmms: GestemeHmms, lengths: Sequence[float]) -> Array:
    """P(over | last state), so that gestemes last as long as demonstrated."""
    leaving = np.ones(len(lengths))
    for m, (count, length) in enumerate(zip(hmms.chains.states, lengths, strict=True)):
        stay = np.diagonal(hmms.chains.transition[m])[: count - 1]
        before = float((1.0 / np.maximum(1.0 - stay, 1.0 / length)).sum())
        leaving[m] = 1.0 / max(length - before, 1.0)
    return leaving


def _arcs(chain: TaskChain, off_network: float) -> Array:
    """P(slot next | slot over), shape (K, K); rows where the task ends sum to less than one."""
    slots = len(chain.slot_state)
    follows = chain.transition[np.ix_(chain.slot_state, chain.slot_state)] > 0
    arcs = follows / np.maximum(follows.sum(axis=1, keepdims=True), 1)
    return np.asarray((1.0 - off_network) * arcs + off_network / slots)


def check_network(knowledge: NetworkKnowledge, task: Task) -> None:
    """Raise ValueError where the arrays do not fit together, or not the task."""
    gestemes, axes = len(task.gestemes), len(axes_of(task))
    check_gesteme_hmms(knowledge.hmms, gestemes)
    dimensions = normals_of(knowledge.hmms).means.shape[2]
    if dimensions not in (axes + 1, axes + 7):
        raise ValueError(f"{dimensions} dimensions, expected {axes + 1}, or {axes + 7} with force")
    check_shapes(knowledge._asdict(), {"scales": (dimensions,), "leaving": (gestemes,)})
    check_spreads("scales", knowledge.scales)
    check_within("leaving", knowledge.leaving, LEAST_SPREAD, 1.0)
    check_within("off_network", knowledge.off_network, 0.0, 1.0)
