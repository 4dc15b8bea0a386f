"""Figures of the simulated operator's motion: 4.2 and 4.11."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.motion.operators import Trace, joined
from hmcs.motion.references import random_gestemes
from hmcs_laboratory.data.hands import Count, CurveSettings, NotNegative, moved
from hmcs_laboratory.data.synthetic_tasks import FIVE_STATES, TaskSettings, five_states
from hmcs_laboratory.figures.drawing import (
    CHANGE_COLOR,
    FAINT,
    INK,
    Drawn,
    Number,
    color_of,
    draw_path,
    label_space,
    listed,
    mark_of,
    new_picture,
)


class TrajectorySettings(CurveSettings):
    """Of figure 4.2; it is drawn in two and in three dimensions, whatever `dimensions` says."""

    gestemes: Count = 6
    """Performed one after another."""
    noise: NotNegative = 0.15
    """κ of (3.3)."""


class TaskFigureSettings(TaskSettings):
    """Of figures of one performance of a task."""

    noise: NotNegative = 0.15
    """κ of (3.3)."""


class _SimulatedPath(NamedTuple):
    reference: Array
    """m, shape (R, D)."""
    trace: Trace

    @property
    def changes(self) -> NDArray[np.intp]:
        """The samples at which another gesteme begins, shape (n,)."""
        return np.flatnonzero(np.diff(self.trace.segments)) + 1

    @property
    def rms_error_m(self) -> float:
        """Root mean square distance of the samples to the reference, m."""
        apart = self.trace.positions[:, None] - self.reference[None]
        nearest = np.linalg.norm(apart, axis=2).min(axis=1)
        return float(np.sqrt(np.mean(nearest**2)))


def typical_trajectories(settings: TrajectorySettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 4.2: typical motions of the simulated operator in 2D and in 3D."""
    flat, spatial = (
        _motion(settings.model_copy(update={"dimensions": dimensions}), stream)
        for dimensions, stream in zip((2, 3), rng.spawn(2), strict=True)
    )
    picture = new_picture(5.0)
    left = picture.add_subplot(1, 2, 1)
    right = picture.add_subplot(1, 2, 2, projection="3d")
    for ax, motion, dimensions in ((left, flat, 2), (right, spatial, 3)):
        draw_path(ax, motion.reference, color=FAINT, linewidth=1.0, linestyle=(0, (4, 3)))
        draw_path(ax, motion.trace.positions, color=color_of(0), linewidth=1.4, marker=".", ms=3)
        dots = motion.trace.positions[motion.changes]
        draw_path(ax, dots, color=CHANGE_COLOR, linestyle="", marker="o", ms=7, zorder=5)
        ax.set_title(f"In {dimensions}D")
        label_space(ax, dimensions)
    picture.legend(handles=_motion_legend(), loc="outside lower center", ncols=3)
    numbers = {
        f"{name}_{what}": value
        for name, motion in (("2d", flat), ("3d", spatial))
        for what, value in (
            ("steps", len(motion.trace.positions) - 1),
            ("changes", len(motion.changes)),
            ("rms_error_m", motion.rms_error_m),
        )
    }
    found = (
        f"{settings.gestemes} gestemes took {numbers['2d_steps']} steps of "
        f"{100 * settings.step_m:g} cm in the plane and {numbers['3d_steps']} in space, with "
        f"{numbers['2d_changes']} and {numbers['3d_changes']} changes marked. The hand was "
        f"{100 * flat.rms_error_m:.1f} and {100 * spatial.rms_error_m:.1f} cm (root mean square) "
        "from its reference."
    )
    differs = (
        "The reference is drawn too. Which gestemes come is chance; how long lines and arcs are "
        "is not in the thesis, see the settings."
    )
    return Drawn(picture, numbers, found, differs)


def five_state_task(settings: TaskFigureSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 4.11: one performance of the task of five states and four gestemes."""
    data = five_states(settings, settings.noise, rng)
    performance = data.performances[0]
    begins = np.stack([step.position for step in performance.steps])[:, :2]
    last = performance.steps[-1]
    points = np.vstack([begins, (last.position + last.displacement)[:2]])
    states = performance.states
    picture = new_picture(5.6, 8.0)
    ax = picture.add_subplot()
    for state, name in enumerate(FIVE_STATES):
        own = np.flatnonzero(states == state)
        piece = points[own[0] : own[-1] + 2]
        draw_path(
            ax,
            piece,
            color=color_of(state),
            linewidth=1.6,
            marker=mark_of(state),
            ms=5,
            label=f"S{state + 1}: gesteme {name}",
        )
    changes = np.flatnonzero(np.diff(states)) + 1
    draw_path(
        ax,
        points[changes],
        color=INK,
        linestyle="",
        marker="o",
        ms=11,
        mfc="none",
        mew=1.4,
        label="change of state",
    )
    draw_path(ax, points[:1], color=INK, linestyle="", marker="*", ms=13, label="start")
    label_space(ax, 2)
    picture.legend(loc="outside right center")
    lengths = _lengths(states)
    numbers: dict[str, Number] = {
        "states": len(set(states.tolist())),
        "gestemes": len({FIVE_STATES[s] for s in states.tolist()}),
        "steps": len(states),
        "steps_of_state": lengths,
    }
    found = (
        f"{numbers['steps']} steps through {numbers['states']} states with "
        f"{numbers['gestemes']} gestemes: {listed([str(n) for n in lengths])} steps in "
        "S1 to S5. S2 and S4 are the same arc."
    )
    differs = (
        "The shapes of the gestemes are drawn by lot: the thesis gives their kinds and order, not "
        "their sizes."
    )
    return Drawn(picture, numbers, found, differs)


def _motion(settings: TrajectorySettings, rng: np.random.Generator) -> _SimulatedPath:
    drawing, moving = rng.spawn(2)
    curves = random_gestemes(settings.references, settings.gestemes, drawing)
    reference, owners = joined(curves, settings.step_m / 2)
    reference = reference[:, : settings.dimensions]
    return _SimulatedPath(
        reference, moved(reference, settings.operator(settings.noise), moving, owners)
    )


def _motion_legend() -> list[Line2D]:
    return [
        Line2D([], [], color=color_of(0), marker=".", label="simulated hand, a dot a sample"),
        Line2D([], [], color=FAINT, linestyle=(0, (4, 3)), label="reference"),
        Line2D(
            [], [], color=CHANGE_COLOR, linestyle="", marker="o", ms=7, label="next gesteme begins"
        ),
    ]


def _lengths(states: NDArray[np.int64]) -> Sequence[int]:
    return [int((states == state).sum()) for state in range(len(FIVE_STATES))]
