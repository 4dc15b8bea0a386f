"""Transition matrices and initial distributions to start learning from (thesis 2.1.2, 3.4).

What a topology sets to zero stays zero through learning. Shapes: N states; matrices (N, N),
initial distributions (N,).
"""

from __future__ import annotations

import numpy as np

from hmcs.arrays import Array
from hmcs.errors import UserError


class TopologyError(UserError, ValueError):
    """A topology asked for that is no Markov chain; says which value, and what is expected."""


def fully_connected(states: int, stay: float = 0.7) -> Array:
    """Return P(stay) on the diagonal and the rest spread evenly over all other states (3.4).

    A single state stays with certainty. Raises TopologyError unless 0 ≤ stay ≤ 1.
    """
    _check_states(states)
    _check_share("stay", stay, closed=True)
    if states == 1:
        return np.ones((1, 1))
    transition = np.full((states, states), (1.0 - stay) / (states - 1))
    np.fill_diagonal(transition, stay)
    return transition


def left_right(states: int, epsilon: float, *, skip: float = 0.0, leaves: bool = False) -> Array:
    """Return a sequential left-right chain: 1 − ε stays, ε goes on (2.1.2).

    Of ε, the share `skip` jumps over one state where there is one to jump over. The last state
    stays with certainty, or with `leaves` leaves the model with probability ε.
    Raises TopologyError unless 0 < ε < 1 and 0 ≤ skip ≤ 1.
    """
    _check_states(states)
    _check_share("epsilon", epsilon)
    _check_share("skip", skip, closed=True)
    transition = np.diag(np.full(states, 1.0 - epsilon))
    for state in range(states - 1):
        jump = skip * epsilon if state + 2 < states else 0.0
        transition[state, state + 1] = epsilon - jump
        if jump:
            transition[state, state + 2] = jump
    if not leaves:
        transition[-1, -1] = 1.0
    return transition


def start_in(states: int, first: int = 0) -> Array:
    """Return the initial distribution that starts in one state with certainty.

    Raises TopologyError when there is no such state.
    """
    _check_states(states)
    if not 0 <= first < states:
        raise TopologyError(
            f"first state {first} is not one of 0 to {states - 1}: name one of them"
        )
    return np.asarray(np.eye(states)[first])


def start_anywhere(states: int) -> Array:
    """Return the uniform initial distribution."""
    _check_states(states)
    return np.full(states, 1.0 / states)


def _check_states(states: int) -> None:
    if states < 1:
        raise TopologyError(f"{states} states: a model needs at least one")


def _check_share(name: str, value: float, *, closed: bool = False) -> None:
    # A NaN fails both comparisons.
    if not (0.0 <= value <= 1.0 if closed else 0.0 < value < 1.0):
        bounds = "from 0 to 1" if closed else "strictly between 0 and 1"
        raise TopologyError(f"{name} is {value}: give a probability {bounds}")
