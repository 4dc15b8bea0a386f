"""Motion followed by states of one direction each, as chapter 3 does, and how it is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.motion.steps import Step
from hmcs_baselines.direction_states import DirectionFilter, DirectionStates
from hmcs_laboratory.data.tasks import TaskSet, as_performance
from hmcs_laboratory.figures.drawing import FAINT, INK, color_of, draw_path, mark_of

Integers = NDArray[np.int64]
SURE = 0.95
"""A change is seen when the direction after it is more probable than this."""
_LEAST_SHOWN = 1e-9


class FollowedPath(NamedTuple):
    """A performance as the filter followed it."""

    points: Array
    """m, shape (T + 1, D)."""
    probabilities: Array
    """P(direction | steps so far), shape (T, K)."""

    @property
    def likely(self) -> Integers:
        """The most probable direction after each step, shape (T,)."""
        return np.asarray(self.probabilities.argmax(axis=1))


def likely_order(knowledge: DirectionStates) -> list[int]:
    """Return the states from the most probable first one on, each the most probable next."""
    order = [int(knowledge.initial.argmax())]
    while len(order) < len(knowledge.initial):
        leaving = knowledge.transition[order[-1]].copy()
        leaving[order] = -1.0
        order.append(int(leaving.argmax()))
    return order


def taught_steps(data: TaskSet) -> list[tuple[Step, ...]]:
    """Return the steps of each demonstration."""
    return [as_performance(each, data.task).steps for each in data.demonstrations]


def moves_of(steps: Sequence[Step], dimensions: int) -> Array:
    """Return the displacements of steps, m, shape (T, D)."""
    return np.array([step.displacement[:dimensions] for step in steps])


def follow_path(knowledge: DirectionStates, steps: Sequence[Step], dimensions: int) -> FollowedPath:
    """Follow steps by the filter of chapter 3, from where the first of them begins."""
    following = DirectionFilter(knowledge)
    moves = moves_of(steps, dimensions)
    start = steps[0].position[:dimensions]
    points = np.vstack([start, start + moves.cumsum(axis=0)])
    return FollowedPath(points, np.array([following.step(move) for move in moves]))


def draw_classified(ax: Axes, seen: FollowedPath) -> None:
    """Draw a path with a symbol at each step, that of its most probable state."""
    draw_path(ax, seen.points, color=FAINT, linewidth=0.8)
    for state in range(seen.probabilities.shape[1]):
        own = seen.points[1:][seen.likely == state]
        draw_path(ax, own, color=color_of(state), linestyle="", marker=mark_of(state), ms=5)


def draw_likelihoods(ax: Axes, seen: FollowedPath) -> None:
    """Draw the probability of each state over the steps."""
    for state, own in enumerate(seen.probabilities.T):
        ax.plot(
            own,
            color=color_of(state),
            linewidth=1.5,
            marker=mark_of(state),
            ms=4,
            markevery=(state, 6),
        )
    ax.set_title("Normalized likelihood of each state")
    ax.set_xlabel("step")
    ax.set_ylabel("probability")
    ax.set_xlim(-0.5, len(seen.probabilities) - 0.5)


def draw_matrix(ax: Axes, transition: Array, order: Sequence[int] = ()) -> None:
    """Draw a transition matrix, shape (K, K), with its numbers and on a logarithmic scale.

    Rows and columns stand in the given order of the states, if any: of a sequence the successors
    then stand beside the diagonal.
    """
    count = len(transition)
    order = list(order) or list(range(count))
    transition = transition[np.ix_(order, order)]
    shown = np.maximum(transition, _LEAST_SHOWN)
    image = ax.imshow(shown, cmap="Blues", norm=LogNorm(_LEAST_SHOWN, 1.0))
    ax.grid(visible=False)
    for i, j in np.ndindex(count, count):
        value = transition[i, j]
        ax.text(
            j,
            i,
            f"{value:.3f}" if value >= 1e-3 else f"{value:.0e}".replace("e-0", "e−"),
            ha="center",
            va="center",
            color="white" if value > 1e-4 else INK,
            fontsize=9.5 if count <= 6 else 7.5,
        )
    names = [str(k + 1) for k in order]
    ax.set_xticks(range(count), names)
    ax.set_yticks(range(count), names)
    ax.set_xlabel("to state")
    ax.set_ylabel("from state")
    ax.set_title("A: probability of a transition")
    picture = ax.get_figure()
    assert picture is not None
    picture.colorbar(image, ax=ax, shrink=0.8, label="probability in a step")


def state_handles(count: int) -> list[Line2D]:
    """Return the entries of the legend for so many states."""
    return [
        Line2D([], [], color=color_of(k), marker=mark_of(k), ms=5, label=f"state {k + 1}")
        for k in range(count)
    ]
