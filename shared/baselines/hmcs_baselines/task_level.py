"""The task HMM above gesteme HMMs, its B counted and its A trained with B fixed (thesis 4.1.2).

Shapes: S task states, M gestemes, T steps.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.recognition.checking import (
    LEAST_SPREAD,
    check_distributions,
    check_shapes,
    check_within,
)
from hmcs.recognition.hmm.emissions import Discrete
from hmcs.recognition.hmm.log_transitions import log_of
from hmcs.recognition.hmm.model import Hmm
from hmcs.recognition.task_chain import TaskChain
from hmcs_baselines.hmm.bank import ForwardBank
from hmcs_baselines.hmm.soft_evidence import learn_task

Integers = NDArray[np.int64]


class TaskLevelSettings(NamedTuple):
    """How the task HMM is learned."""

    emission_floor: float = 0.01
    """No gesteme is less probable than this in any task state."""
    any_state: float = 1e-5
    """In each step the task goes to any state whatever with this probability, so that orders never
    trained stay possible."""
    iterations: int = 20
    """Of Baum–Welch with B fixed, at most."""


class GestemeTaskHmm(NamedTuple):
    """The task HMM."""

    initial: Array
    """P(state at the first step), shape (S,)."""
    transition: Array
    """P(state j at the next step | state i), shape (S, S)."""
    gestemes: Array
    """B: P(gesteme passed up | state), shape (S, M)."""


class GestemeLevelOutput(NamedTuple):
    """What the gesteme level passed up in a demonstration, and the truth."""

    gestemes: Array
    """A distribution over gestemes a step, shape (T, M)."""
    states: Integers
    """Index of the task state of each step, −1 without a label, shape (T,)."""


def learn_task_level(
    chain: TaskChain, outputs: Sequence[GestemeLevelOutput], settings: TaskLevelSettings
) -> GestemeTaskHmm:
    """Return the task HMM learned from what the gesteme level said of the demonstrations.

    Training begins from the task's own network, with segments as long as demonstrated; where the
    demonstrations never show what follows a state, the network stays. A state without a
    demonstration of its own is taken to look like those it shares gestemes with.
    """
    runs = [run for each in outputs for run in _labeled_runs(each)]
    states, gestemes = len(chain.initial), outputs[0].gestemes.shape[1]
    start = _network(chain, runs)
    seen = np.unique(np.concatenate([run.states for run in runs]))
    learned = learn_task(
        Hmm(
            _normalized(chain.initial[seen] + 1e-3 / states),
            start[np.ix_(seen, seen)],
            Discrete(np.full((len(seen), gestemes), 1.0 / gestemes)),
        ),
        [run.gestemes for run in runs],
        [np.searchsorted(seen, run.states) for run in runs],
        floor=min(settings.emission_floor, 0.5 / gestemes),
        max_iterations=settings.iterations,
    )
    transition = start.copy()
    departed = [
        k for k, state in enumerate(seen) if any(_departs(run.states, state) for run in runs)
    ]
    transition[np.ix_(seen[departed], seen)] = learned.transition[departed]
    return GestemeTaskHmm(
        _mixed(chain.initial, settings.any_state),
        _mixed(_normalized(transition), settings.any_state),
        _completed(learned.emission.probabilities, seen, chain),
    )


class TaskLevel:
    """Moves the belief over task states by what the gesteme level passes up."""

    def __init__(self, task_hmm: GestemeTaskHmm, *, anywhere: bool = False) -> None:
        """Begin as the task does or, with `anywhere`, in any state."""
        states = len(task_hmm.initial)
        initial = np.full(states, 1.0 / states) if anywhere else task_hmm.initial
        self._filter = ForwardBank(initial[None], task_hmm.transition[None])
        self._gestemes = task_hmm.gestemes

    def step(self, gestemes: Array) -> tuple[Array, float]:
        """Take a distribution over gestemes, shape (M,).

        Returns P(state | all so far), shape (S,), and log P(this | what came before), nats.
        """
        gain = self._filter.step(log_of(self._gestemes @ gestemes)[None])
        return self._filter.states[0], float(gain[0])


def gesteme_shares(chain: TaskChain, gestemes: int) -> Array:
    """Return P(gesteme | state) as the task says, shape (S, M)."""
    shares = np.zeros((len(chain.initial), gestemes))
    shares[chain.slot_state, chain.slot_gesteme] = chain.slot_share
    return shares


def state_given_gesteme(chain: TaskChain, gestemes: int) -> Array:
    """Return P(state | gesteme) before anything is seen, shape (S, M); columns sum to one.

    By how often the task's chain visits each state in as many segments as there are states. A
    gesteme of no state says nothing of them.
    """
    visits, segment = np.zeros_like(chain.initial), chain.initial
    for _ in chain.initial:
        visits = visits + segment
        segment = segment @ chain.transition
    shares = gesteme_shares(chain, gestemes)
    joint = visits[:, None] * shares
    joint = np.where(joint.any(axis=0), joint, shares)
    joint = np.where(joint.any(axis=0), joint, 1.0)
    return np.asarray(joint / joint.sum(axis=0))


def check_task_hmm(task_hmm: GestemeTaskHmm, states: int, gestemes: int) -> None:
    """Raise ValueError where the arrays are not for so many states and gestemes, or hold no
    probabilities above zero."""
    shapes = {
        "initial": (states,),
        "transition": (states, states),
        "gestemes": (states, gestemes),
    }
    arrays = task_hmm._asdict()
    check_shapes(arrays, shapes)
    for field, array in arrays.items():
        check_within(field, array, LEAST_SPREAD, 1.0)
        check_distributions(field, array)


def _labeled_runs(output: GestemeLevelOutput) -> Iterator[GestemeLevelOutput]:
    """What was passed up in each stretch without a gap in its labels."""
    for labeled, run in groupby(range(len(output.states)), lambda t: output.states[t] >= 0):
        steps = list(run)
        if labeled:
            # Baum–Welch needs a transition.
            steps = steps if len(steps) > 1 else steps * 2
            yield GestemeLevelOutput(output.gestemes[steps], output.states[steps])


def _network(chain: TaskChain, runs: Sequence[GestemeLevelOutput]) -> Array:
    """A with the task's arcs, and segments of each state as long as demonstrated."""
    lengths: list[list[int]] = [[] for _ in chain.initial]
    for run in runs:
        for state, steps in groupby(run.states):
            lengths[state].append(len(list(steps)))
    usual = float(np.mean([length for own in lengths for length in own]))
    leaving = np.array([1.0 / np.mean(own) if own else 1.0 / usual for own in lengths])
    transition = leaving[:, None] * chain.transition
    transition[np.diag_indices_from(transition)] += 1.0 - transition.sum(axis=1)
    return transition


def _departs(states: Integers, state: int) -> bool:
    return bool(((states[:-1] == state) & (states[1:] != state)).any())


def _completed(rows: Array, seen: Integers, chain: TaskChain) -> Array:
    """B of all states, given that of those seen."""
    gestemes = rows.shape[1]
    shares = gesteme_shares(chain, gestemes)
    result = np.full((len(shares), gestemes), 1.0 / gestemes)
    result[seen] = rows
    for state in set(range(len(shares))) - set(seen.tolist()):
        alike = shares[seen] @ shares[state]
        if alike.any():
            result[state] = alike @ rows / alike.sum()
    return result


def _normalized(rows: Array) -> Array:
    return np.asarray(rows / rows.sum(axis=-1, keepdims=True))


def _mixed(rows: Array, any_state: float) -> Array:
    return np.asarray((1.0 - any_state) * rows + any_state / rows.shape[-1])
