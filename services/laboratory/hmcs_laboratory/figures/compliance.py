"""Figures 2.12 and 2.13: tasks at a fixture, and the compliance that serves them best."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.lines import Line2D

from hmcs.arrays import Array
from hmcs.fixtures.compliance.factor import crossing, optimal_compliance
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


def tasks_of_compliance(settings: FieldSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 2.12: following a curve, targeting off it, and going around an obstacle."""
    del settings
    picture = new_picture(3.6)
    titles = ("path following", "off-path targeting", "obstacle avoidance")
    numbers: dict[str, Any] = {}
    for ax, title, meant in zip(
        picture.subplots(1, 3, sharey=True), titles, _meant_paths(), strict=True
    ):
        for index, compliance in enumerate((0.2, 0.6, 1.0)):
            robot = _performed(meant, compliance, np.random.default_rng(rng.integers(2**32)))
            label = f"c_τ = {compliance:g}"
            ax.plot(*(MM * robot[:, :2].T), color=color_of(index), linewidth=1.2, label=label)
            error_m = float(np.sqrt((_off(robot, meant) ** 2).mean()))
            numbers[f"{title}_{compliance:g}_error_mm"] = MM * error_m
        ax.plot(*(MM * meant.points[:, :2].T), color=FAINT, linestyle=":", linewidth=1.4)
        ax.plot(*(MM * CURVE.points[:, :2].T), color=INK, linewidth=0.8)
        ax.set_title(title)
        ax.set_aspect("equal")
        ax.set_xlabel("x, mm")
        if title != titles[1]:
            continue
        ax.plot(*(MM * OFF_PATH[:2]), marker="*", ms=12, color=WRONG_COLOR, linestyle="")
    picture.axes[0].set_ylabel("y, mm")
    handles, labels = picture.axes[0].get_legend_handles_labels()
    handles += [
        Line2D([], [], color=INK, linewidth=0.8),
        Line2D([], [], color=FAINT, linestyle=":", linewidth=1.4),
    ]
    picture.legend(
        handles, [*labels, "fixture", "meant"], loc="outside lower center", ncols=len(handles)
    )
    return Drawn(
        picture,
        numbers,
        "A simulated operator at three compliances: from the softest to the stiffest fixture the "
        "error "
        + "; ".join(
            f"in {title} is "
            + ", ".join(f"{numbers[f'{title}_{c:g}_error_mm']:.1f}" for c in (1.0, 0.6, 0.2))
            + " mm"
            for title in titles
        )
        + ".",
        "The thesis sketches the three tasks; here a simulated operator performs them.",
    )


def optimal_compliance_found(settings: ComplianceSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 2.13: error and time against compliance, and where their lines cross."""
    compliances = np.linspace(0.1, 1.0, settings.compliances)
    following, leaving, _ = _meant_paths()
    results = np.zeros((2, 2, len(compliances), settings.repeats))
    for t, meant in enumerate((following, leaving)):
        for c, compliance in enumerate(compliances):
            for k in range(settings.repeats):
                robot = _performed(meant, compliance, np.random.default_rng(rng.integers(2**32)))
                results[0, t, c, k] = MM * np.sqrt((_off(robot, meant) ** 2).mean())
                results[1, t, c, k] = _PERIOD_S * len(robot)
    picture = new_picture(4.2)
    lines: list[tuple[FittedLine, FittedLine]] = []
    for ax, what, values, unit in zip(
        picture.subplots(1, 2), ("error", "time"), results, ("mm", "s"), strict=True
    ):
        fitted = []
        for t, name in enumerate(("following", "leaving")):
            mean = values[t].mean(axis=1)
            slope, intercept = np.polyfit(compliances, mean, 1)
            fitted.append(FittedLine(slope=float(slope), intercept=float(intercept)))
            ax.plot(compliances, mean, ("o", "s")[t], color=color_of(t), label=name)
            ax.plot(compliances, slope * compliances + intercept, color=color_of(t))
        lines.append((fitted[0], fitted[1]))
        best = crossing(fitted[0], fitted[1], 1.0)
        ax.axvline(best, color=INK, linewidth=0.9, linestyle=(0, (4, 3)))
        ax.set_title(f"{what}: the lines cross at c_τ = {best:.2f}")
        ax.set_xlabel("compliance c_τ")
        ax.set_ylabel(f"{what}, {unit}")
        ax.legend()
    both = optimal_compliance(lines[0], lines[1], 1.0, 0.5)
    return Drawn(
        picture,
        {
            "by_error": crossing(*lines[0], 1.0),
            "by_time": crossing(*lines[1], 1.0),
            "both_alike": both,
            "slopes": [line.slope for pair in lines for line in pair],
        },
        f"With error and time alike (w = ½) the optimal compliance is {both:.2f}.",
        "The thesis quotes lines of Marayong et al. for people at a steady-hand robot; these are "
        "of a simulated operator at a velocity-controlled one. Where the lines do not cross "
        "between 0 and 1 the nearer end is taken.",
    )


def _meant_paths() -> tuple[Path, Path, Path]:
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
