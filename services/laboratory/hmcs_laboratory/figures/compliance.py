"""Figures 2.12 and 2.13: tasks at a fixture, and the compliance that serves them best."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from hmcs.arrays import Array
from hmcs.fixtures.compliance.factor import crossing
from hmcs.fixtures.law import Gains
from hmcs.fixtures.parts import PreferredSubspace
from hmcs.motion.closed_loop_operators import STEADY, ClosedLoopOperator
from hmcs.motion.paths import Path
from hmcs.task.fixture_parts import FittedLine
from hmcs_laboratory.data.hands import Count
from hmcs_laboratory.figures.drawing import FAINT, INK, WRONG_COLOR, Drawn, color_of, new_picture
from hmcs_laboratory.figures.fixture_fields import CURVE, MM, FieldSettings
from hmcs_laboratory.study import StudySettings

_PERIOD_S = 0.01


class ComplianceSettings(StudySettings):
    """Of figures 2.12 and 2.13."""

    repeats: Count = 10
    """Performances at each compliance."""
    compliances: Count = 6
    """Between a nearly hard fixture and none."""


OFF_PATH = np.array([0.1, 0.06, 0.0])
"""Point C of figure 2.12."""
OBSTACLE = np.array([0.1, 0.0, 0.0])
OBSTACLE_RADIUS_M = 0.015
TASKS = ("path following", "off-path targeting", "obstacle avoidance")
SHOWN_COMPLIANCES = (0.2, 0.6, 1.0)
GUIDANCES = {2.0: "-.", 0.5: ":"}
"""s that gives guidance more weight, and less, with the strokes of the thesis' figure."""


def tasks_of_compliance(settings: FieldSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 2.12: following a curve, targeting off it, and going around an obstacle."""
    del settings
    picture = new_picture(3.6)
    numbers: dict[str, Any] = {}
    for ax, title, meant in zip(
        picture.subplots(1, 3, sharey=True), TASKS, meant_paths(), strict=True
    ):
        for index, compliance in enumerate(SHOWN_COMPLIANCES):
            robot = _performed(meant, compliance, np.random.default_rng(rng.integers(2**32)))
            label = f"c_τ = {compliance:g}"
            ax.plot(*(MM * robot[:, :2].T), color=color_of(index), linewidth=1.2, label=label)
            error_m = float(np.sqrt((_off(robot, meant) ** 2).mean()))
            numbers[f"{title}_{compliance:g}_error_mm"] = MM * error_m
            if title == TASKS[2]:
                room_m = float(np.linalg.norm(robot - OBSTACLE, axis=1).min()) - OBSTACLE_RADIUS_M
                numbers[f"{title}_{compliance:g}_room_mm"] = MM * room_m
        ax.plot(*(MM * meant.points[:, :2].T), color=FAINT, linestyle=":", linewidth=1.4)
        ax.plot(*(MM * CURVE.points[:, :2].T), color=INK, linewidth=0.8)
        ax.set_title(title)
        ax.set_aspect("equal")
        ax.set_xlabel("x, mm")
        if title == TASKS[1]:
            ax.plot(*(MM * OFF_PATH[:2]), marker="*", ms=12, color=WRONG_COLOR, linestyle="")
        if title == TASKS[2]:
            ax.add_patch(
                Circle(
                    (MM * OBSTACLE[0], MM * OBSTACLE[1]), MM * OBSTACLE_RADIUS_M, color=WRONG_COLOR
                )
            )
    picture.axes[0].set_ylabel("y, mm")
    handles, labels = picture.axes[0].get_legend_handles_labels()
    handles += [
        Line2D([], [], color=INK, linewidth=0.8),
        Line2D([], [], color=FAINT, linestyle=":", linewidth=1.4),
        Line2D([], [], color=WRONG_COLOR, marker="o", ms=8, linestyle=""),
    ]
    picture.legend(
        handles,
        [*labels, "fixture", "meant", "obstacle"],
        loc="outside lower center",
        ncols=len(handles),
    )
    soft_first = SHOWN_COMPLIANCES[::-1]
    errors = "; ".join(
        f"in {title} is "
        + ", ".join(f"{numbers[f'{title}_{c:g}_error_mm']:.1f}" for c in soft_first)
        + " mm"
        for title in TASKS
    )
    rooms = ", ".join(f"{numbers[f'{TASKS[2]}_{c:g}_room_mm']:.1f}" for c in soft_first)
    return Drawn(
        picture,
        numbers,
        "A simulated operator at three compliances: from the softest to the stiffest fixture the "
        f"error {errors}. The obstacle is passed with {rooms} mm to spare; below zero it is hit.",
        "The thesis sketches the three tasks; here a simulated operator performs them.",
    )


def optimal_compliance_found(settings: ComplianceSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 2.13: error and time against compliance, and where their lines cross."""
    compliances = np.linspace(0.1, 1.0, settings.compliances)
    results = np.zeros((2, 2, len(compliances), settings.repeats))
    for t, meant in enumerate(meant_paths()[:2]):
        for c, compliance in enumerate(compliances):
            for k in range(settings.repeats):
                robot = _performed(meant, compliance, np.random.default_rng(rng.integers(2**32)))
                results[0, t, c, k] = MM * np.sqrt((_off(robot, meant) ** 2).mean())
                results[1, t, c, k] = _PERIOD_S * len(robot)
    picture = new_picture(4.6)
    numbers: dict[str, Any] = {
        "compliances": compliances.tolist(),
        "guidance": [1.0, *GUIDANCES],
    }
    sentences = []
    for ax, what, values, unit in zip(
        picture.subplots(1, 2), ("error", "time"), results, ("mm", "s"), strict=True
    ):
        means, deviations = values.mean(axis=2), values.std(axis=2)
        panel = panel_of(compliances, means)
        for t, name in enumerate(("following (task 1)", "leaving (task 2)")):
            ax.errorbar(
                compliances,
                means[t],
                deviations[t],
                fmt=("o", "s")[t],
                color=color_of(t),
                capsize=2,
                label=name,
            )
            ax.plot(compliances, _along(panel.lines[t], compliances), color=color_of(t))
        for s, style in GUIDANCES.items():
            ax.plot(
                compliances,
                _along(panel.lines[0], compliances, s),
                color=color_of(0),
                linestyle=style,
                linewidth=1.0,
                label=f"task 1, s = {s:g}",
            )
        if panel.points_cross is not None:
            ax.axvline(panel.points_cross, color=INK, linewidth=0.9, linestyle=(0, (4, 3)))
        where = panel.points_cross
        ax.set_title(f"{what}: " + ("no crossing" if where is None else f"best c_τ = {where:.2f}"))
        ax.set_xlabel("compliance c_τ")
        ax.set_ylabel(f"{what}, {unit}")
        ax.set_ylim(0.0, 1.1 * float((means + deviations).max()))
        ax.legend()
        sentences.append(_said(what, panel))
        numbers |= {
            f"{what}_following": means[0].tolist(),
            f"{what}_leaving": means[1].tolist(),
            f"{what}_points_cross": where,
            f"{what}_lines_cross": crossing(*panel.lines, 1.0),
            f"{what}_fits": list(panel.fits),
            **{f"{what}_lines_cross_s_{s:g}": crossing(*panel.lines, s) for s in GUIDANCES},
        }
    return Drawn(
        picture,
        numbers,
        " ".join(sentences),
        "The thesis quotes lines of Marayong et al. for people at a steady-hand robot, whose times "
        "fell on a line too; these are of a simulated operator at a velocity-controlled one. Bars "
        "are standard deviations. The best compliance is where the measured means cross, not "
        "where lines do that fit them badly.",
    )


class Panel(NamedTuple):
    """Two tasks against compliance: straight lines, and where the tasks are equally good."""

    lines: tuple[FittedLine, FittedLine]
    fits: tuple[float, float]
    """Share of the variance of the means that each line explains, R²."""
    points_cross: float | None
    """Where the means, joined by straight pieces, cross; None where they do not."""


def panel_of(compliances: Array, means: Array) -> Panel:
    """Return what two rows of means, shape (2, C), at rising compliances, shape (C,), say."""
    lines, fits = [], []
    for mean in means:
        slope, intercept = np.polyfit(compliances, mean, 1)
        lines.append(FittedLine(slope=float(slope), intercept=float(intercept)))
        rest = mean - (slope * compliances + intercept)
        spread = float(((mean - mean.mean()) ** 2).sum())
        fits.append(1.0 - float((rest**2).sum()) / spread if spread > 0.0 else 1.0)
    apart = means[1] - means[0]
    after = np.flatnonzero(np.diff(np.sign(apart)) != 0)
    cross = None
    if len(after):
        at = int(after[0])
        share = apart[at] / (apart[at] - apart[at + 1])
        cross = float(compliances[at] + share * (compliances[at + 1] - compliances[at]))
    return Panel((lines[0], lines[1]), (fits[0], fits[1]), cross)


def _along(line: FittedLine, compliances: Array, guidance: float = 1.0) -> Array:
    return line.slope * guidance * compliances + line.intercept


def _said(what: str, panel: Panel) -> str:
    points, worst = panel.points_cross, min(panel.fits)
    means = "do not cross" if points is None else f"cross at c_τ = {points:.2f}"
    shifted = ", ".join(
        f"at {crossing(*panel.lines, s):.2f} for s = {s:g}" for s in (1.0, *GUIDANCES)
    )
    return (
        f"By {what} the means {means}; straight lines, of which the worse explains "
        f"{100 * worst:.0f} % of its means' variance, cross {shifted}."
    )


def meant_paths() -> tuple[Path, Path, Path]:
    """Return the ways that are meant in the three tasks: the curve, to a target, around."""
    points = CURVE.points
    x = points[:, 0]
    bump = np.where(np.abs(x - 0.1) < 0.05, 0.5 * (1 + np.cos(np.pi * (x - 0.1) / 0.05)), 0.0)
    around = points + np.outer(bump, [0.0, 0.04, 0.0])
    # There and back side by side: on the very same way nobody could tell going from coming.
    before, after = np.searchsorted(x, [0.095, 0.105])
    there = np.linspace(points[before], OFF_PATH, 30)[1:]
    back = np.linspace(OFF_PATH, points[after], 30)[1:]
    targeting = np.vstack([points[: before + 1], there, back, points[after + 1 :]])
    return CURVE, Path(targeting), Path(around)


def _performed(meant: Path, compliance: float, rng: np.random.Generator) -> Array:
    """Where an operator leads a robot whose fixture is along `CURVE`, m, shape (T, 3)."""
    operator = ClosedLoopOperator(STEADY, meant, rng, period_s=_PERIOD_S)
    robot, trail = meant.points[0].copy(), []
    gains = Gains(1.0, compliance)
    for _ in range(4000):
        motion = operator.step(robot)
        if motion.arrived:
            break
        direction = CURVE.tangent(CURVE.project(robot), 0.003)
        objective = PreferredSubspace.along(direction, gains)
        twist = np.concatenate([motion.velocity, np.zeros(3)])
        robot = robot + _PERIOD_S * objective.wanted(twist)[:3]
        trail.append(robot)
    return np.array(trail)


def _off(robot: Array, meant: Path) -> Array:
    return np.array([np.linalg.norm(meant.at(meant.project(p)) - p) for p in robot])
