"""Figures of section 2.2, drawn from the running laws: what a fixture makes of a velocity."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Rectangle
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.fixtures.compliance.cues import stiffness_kept
from hmcs.fixtures.compliance.factor import FREE_FACTOR, Line, crossing, optimal_compliance
from hmcs.fixtures.guides.pull import project_to_path, pulled_direction
from hmcs.fixtures.guides.volumes import Knot, Volume
from hmcs.fixtures.law import Gains, full_speed_gains
from hmcs.fixtures.parts import PreferredSubspace
from hmcs.fixtures.regions.forbidden import Box, Region, nearby, sphere
from hmcs.fixtures.regions.keep_out import KeepOut
from hmcs.motion.closed_loop_operators import STEADY, ClosedLoopOperator
from hmcs.motion.paths import Path
from hmcs.task.fixture_parts import CueName, ScalingName
from hmcs_laboratory.data.hands import Count, Positive
from hmcs_laboratory.figures.drawing import (
    COLORS,
    FAINT,
    INK,
    WRONG_COLOR,
    Drawn,
    color_of,
    new_picture,
)
from hmcs_laboratory.study import StudySettings

SPEED_M_S = 0.1
_MM = 1e3
_PERIOD_S = 0.01
Field = Callable[[Array, Array], Array]
"""What a fixture makes of a velocity, m/s, at a place, m, all (3,)."""


class FieldSettings(StudySettings):
    """Of figures 2.9, 2.10 and 2.15 to 2.17."""

    pull: Positive = 0.5
    """k_d of (2.32)."""
    arrows: Count = 17
    """Along each axis."""


class ForceSettings(StudySettings):
    """Of figure 2.14."""

    cued_at_m: Positive = 0.01
    fade_m: Positive = 0.015
    reach_m: Positive = 0.04


class ComplianceSettings(StudySettings):
    """Of figures 2.12 and 2.13."""

    repeats: Count = 10
    """Performances at each compliance."""
    compliances: Count = 6
    """Between a nearly hard fixture and none."""


CURVE = Path(
    np.stack(
        [
            np.linspace(0.0, 0.2, 81),
            0.025 * np.sin(np.linspace(0.0, 2.0 * np.pi, 81)),
            np.zeros(81),
        ],
        axis=1,
    )
)
OFF_PATH = np.array([0.1, 0.06, 0.0])
"""Point C of figure 2.12."""


def kinds_of_fixture(settings: FieldSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 2.9: forbidden regions, and guidance."""
    del rng
    picture = new_picture(4.2)
    left, right = picture.subplots(1, 2)
    regions: tuple[Region, ...] = (
        sphere(np.array([0.06, 0.0, 0.0]), 0.02),
        Box(np.array([0.14, 0.01, 0.0]), np.array([0.02, 0.03, 0.1])),
    )

    def kept_out(place: Array, velocity: Array) -> Array:
        twist = np.concatenate([velocity, np.zeros(3)])
        return KeepOut(nearby(regions, place, 0.03, 0.0), 0.1).admitted(twist)[:3]

    inside = np.array([any(r.contains(p) for r in regions) for p in _grid(settings)])
    _draw_field(left, settings, kept_out, np.array([SPEED_M_S, 0.0, 0.0]), hidden=inside)
    left.add_patch(Circle((60, 0), 20, color=WRONG_COLOR, alpha=0.25))
    left.add_patch(Rectangle((120, -20), 40, 60, color=WRONG_COLOR, alpha=0.25))
    left.set_title("(a) forbidden regions")
    _draw_field(right, settings, _guided(settings, 0.95), np.array([SPEED_M_S, 0.0, 0.0]))
    _draw_curve(right)
    right.set_title("(b) guidance")
    into = [kept_out(np.array([0.039, 0.0, 0.0]), np.array([SPEED_M_S, 0.0, 0.0]))[0]]
    return Drawn(
        picture,
        {"speed_left_1_mm_before_the_region_m_s": into},
        "Arrows show what becomes of a hand that moves to the right at 100 mm/s everywhere. Beside "
        f"a region it slows to {_MM * into[0]:.0f} mm/s a millimeter away, and slides along it.",
        "The thesis sketches both; here they are the laws that run.",
    )


def stiffness_of_fixtures(settings: FieldSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 2.10: a soft and a hard fixture."""
    del rng
    picture = new_picture(4.2)
    moved = np.array([SPEED_M_S, 0.5 * SPEED_M_S, 0.0])
    left_over = []
    for ax, factor, name in zip(picture.subplots(1, 2), (0.65, 1.0), ("soft", "hard"), strict=True):
        field = _guided(settings, factor)
        _draw_field(ax, settings, field, moved)
        _draw_curve(ax)
        compliance = full_speed_gains(factor).compliance
        ax.set_title(f"{name}: c_τ = {compliance:.2f}")
        left_over.append(compliance)
    return Drawn(
        picture,
        {"compliances": left_over},
        "A hand that moves up and to the right everywhere: the hard fixture leaves only motion "
        f"along the curve and back to it, the soft one {left_over[0]:.0%} of what goes across.",
        "The thesis sketches it; here it is law (2.29) with pull (2.32).",
    )


def force_scaling(settings: ForceSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 2.14: force against error for the nine pairs of cue and scaling."""
    del rng
    picture = new_picture(6.4)
    errors = np.linspace(0.0, settings.reach_m, 201)
    cues: tuple[CueName, ...] = ("pedal", "silence", "recognized")
    names = {"pedal": "explicit: pedal", "silence": "implicit: silence", "recognized": "automatic"}
    scalings: tuple[ScalingName, ...] = ("toggle", "fade", "hold")
    axes = picture.subplots(3, 3, sharex=True, sharey=True)
    # Silence takes a rest before it counts, recognition some motion across the path.
    late_m = {"pedal": 0.0, "silence": 0.0, "recognized": 0.004}
    for row, cue in zip(axes, cues, strict=True):
        at_m = settings.cued_at_m + late_m[cue]
        for ax, scaling in zip(row, scalings, strict=True):
            kept = [
                1.0 if e < at_m else stiffness_kept(e, at_m, scaling, settings.fade_m)
                for e in errors
            ]
            ax.plot(_MM * errors, errors * np.array(kept) / at_m, color=COLORS[0], linewidth=1.8)
            ax.axvline(_MM * at_m, color=INK, linewidth=0.9, linestyle=(0, (4, 3)))
            ax.set_title(f"{names[cue]}, {scaling}")
    for ax in axes[-1]:
        ax.set_xlabel("error, mm")
    for ax in axes[:, 0]:
        ax.set_ylabel("force / force at the cue")
    picture.legend(
        [Line2D([], [], color=INK, linewidth=0.9, linestyle=(0, (4, 3)))],
        ["cue takes effect"],
        loc="outside lower center",
    )
    return Drawn(
        picture,
        {"cued_at_mm": _MM * settings.cued_at_m, "fade_mm": _MM * settings.fade_m},
        "Up to the cue the force grows with the error; then toggle ends it, hold keeps it, and "
        f"fade takes it away over {_MM * settings.fade_m:.0f} mm.",
        "The thesis shows the three scalings; here each stands beside each cue. The automatic cue "
        "comes later, since it takes motion across the path to recognize.",
    )


def tubes(settings: FieldSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 2.15: a tube around a curve."""
    del rng
    return _volume_drawn(
        settings,
        Volume((Knot(0.0, 0.015),), 0.005),
        "Within 15 mm of the curve the hand's velocity passes unchanged; outside it is led back.",
    )


def cones(settings: FieldSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 2.16: a cone that leads to a point."""
    del rng
    return _volume_drawn(
        settings,
        Volume((Knot(0.0, 0.04), Knot(1.0, 0.002)), 0.005),
        "The free space narrows from 40 mm to the target's 2 mm; outside the hand is led back.",
        Path(np.array([[0.0, 0, 0], [0.2, 0, 0]])),
    )


def joined_volumes(settings: FieldSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 2.17: tubes and a cone joined to a safe approach."""
    del rng
    knots = (Knot(0.0, 0.012), Knot(0.45, 0.012), Knot(0.6, 0.035), Knot(1.0, 0.002))
    return _volume_drawn(
        settings,
        Volume(knots, 0.005),
        "A tube of 12 mm opens smoothly into a cone that ends at the target.",
    )


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
            ax.plot(*(_MM * robot[:, :2].T), color=color_of(index), linewidth=1.2, label=label)
            error_m = float(np.sqrt((_off(robot, meant) ** 2).mean()))
            numbers[f"{title}_{compliance:g}_error_mm"] = _MM * error_m
        ax.plot(*(_MM * meant.points[:, :2].T), color=FAINT, linestyle=":", linewidth=1.4)
        ax.plot(*(_MM * CURVE.points[:, :2].T), color=INK, linewidth=0.8)
        ax.set_title(title)
        ax.set_aspect("equal")
        ax.set_xlabel("x, mm")
        if title != titles[1]:
            continue
        ax.plot(*(_MM * OFF_PATH[:2]), marker="*", ms=12, color=WRONG_COLOR, linestyle="")
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
                results[0, t, c, k] = _MM * np.sqrt((_off(robot, meant) ** 2).mean())
                results[1, t, c, k] = _PERIOD_S * len(robot)
    picture = new_picture(4.2)
    lines: list[tuple[Line, Line]] = []
    for ax, what, values, unit in zip(
        picture.subplots(1, 2), ("error", "time"), results, ("mm", "s"), strict=True
    ):
        fitted = []
        for t, name in enumerate(("following", "leaving")):
            mean = values[t].mean(axis=1)
            slope, intercept = np.polyfit(compliances, mean, 1)
            fitted.append(Line(float(slope), float(intercept)))
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


def _guided(settings: FieldSettings, factor: float, path: Path = CURVE) -> Field:
    gains = full_speed_gains(factor)

    def field(place: Array, velocity: Array) -> Array:
        found = project_to_path(path, place, 0.0, path.length_m)
        lean = pulled_direction(
            path.tangent(found.progress_m, 0.003),
            velocity,
            found.across,
            settings.pull * (1.0 - gains.compliance),
            0.02,
            0.1,
        )
        objective = PreferredSubspace.along(lean.direction, gains, lean.strength)
        return objective.wanted(np.concatenate([velocity, np.zeros(3)]))[:3]

    return field


def _volume_drawn(settings: FieldSettings, volume: Volume, found: str, path: Path = CURVE) -> Drawn:
    picture = new_picture(4.0, 7.0)
    ax = picture.subplots()

    def field(place: Array, velocity: Array) -> Array:
        at = project_to_path(path, place, 0.0, path.length_m)
        error_m = float(np.linalg.norm(at.across))
        share = volume.stiffness(at.progress_m / path.length_m, error_m)
        if share == 0.0:
            return velocity
        return _guided(settings, FREE_FACTOR + share * (0.95 - FREE_FACTOR), path)(place, velocity)

    moved = np.array([SPEED_M_S, 0.0, 0.0])
    _draw_field(ax, settings, field, moved)
    _draw_curve(ax, path)
    places = np.linspace(0.0, path.length_m, 201)
    centers = path.at(places)
    tangents = np.gradient(centers, axis=0)
    normals = np.stack([-tangents[:, 1], tangents[:, 0]], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    radii = np.array([volume.radius_m(s / path.length_m) for s in places])
    for side in (-1.0, 1.0):
        wall = centers[:, :2] + side * radii[:, None] * normals
        ax.plot(*(_MM * wall.T), color=COLORS[2], linewidth=1.6)
    free = sum(bool((field(place, moved) == moved).all()) for place in _grid(settings)) / len(
        _grid(settings)
    )
    handles = [
        Line2D([], [], color=COLORS[2], linewidth=1.6),
        Line2D([], [], color=INK, linewidth=1.2),
    ]
    picture.legend(handles, ["wall", "path"], loc="outside lower center", ncols=2)
    return Drawn(
        picture,
        {"radii_mm": [_MM * knot.radius_m for knot in volume.knots], "free_share": free},
        found,
        "The thesis sketches the shape; the arrows here are what the law makes of a hand that "
        "moves to the right everywhere.",
    )


def _grid(settings: FieldSettings) -> Array:
    x = np.linspace(0.0, 0.2, settings.arrows)
    y = np.linspace(-0.055, 0.055, max(2, round(0.6 * settings.arrows)))
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return np.concatenate([places, np.zeros((len(places), 1))], axis=1)


def _draw_field(
    ax: Axes,
    settings: FieldSettings,
    field: Field,
    velocity: Array,
    hidden: NDArray[np.bool_] | None = None,
) -> None:
    places = _grid(settings)
    if hidden is not None:
        places = places[~hidden]
    led = np.array([field(place, velocity) for place in places])
    ax.quiver(
        *(_MM * places[:, :2].T),
        *(_MM * led[:, :2].T),
        angles="xy",
        scale=1100,
        width=0.0035,
        color=COLORS[0],
    )
    ax.set_aspect("equal")
    ax.set_xlabel("x, mm")
    ax.set_ylabel("y, mm")
    ax.set_xlim(-8, 222)
    ax.set_ylim(-62, 62)


def _draw_curve(ax: Axes, path: Path = CURVE) -> None:
    ax.plot(*(_MM * path.points[:, :2].T), color=INK, linewidth=1.2)
