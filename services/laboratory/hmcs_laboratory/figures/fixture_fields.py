"""Figures 2.9, 2.10 and 2.15 to 2.17: what the running laws make of a velocity at each place."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Rectangle
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.fixtures.compliance.factor import FREE_FACTOR
from hmcs.fixtures.guides.pull import project_to_path, pulled_direction
from hmcs.fixtures.guides.volumes import volume_radius_m, volume_stiffness
from hmcs.fixtures.law import full_speed_gains
from hmcs.fixtures.parts import PreferredSubspace
from hmcs.fixtures.regions.forbidden import Box, Region, nearby, sphere
from hmcs.fixtures.regions.keep_out import KeepOut
from hmcs.motion.paths import Path
from hmcs.task.fixture_parts import VolumeKnot, VolumeSetup
from hmcs_laboratory.data.hands import Count, Positive
from hmcs_laboratory.figures.drawing import COLORS, INK, WRONG_COLOR, Drawn, new_picture
from hmcs_laboratory.study import StudySettings

SPEED_M_S = 0.1
MM = 1e3
Field = Callable[[Array, Array], Array]
"""What a fixture makes of a velocity, m/s, at a place, m, all (3,)."""


class FieldSettings(StudySettings):
    """Of figures 2.9, 2.10 and 2.15 to 2.17."""

    pull: Positive = 0.5
    """k_d of (2.32)."""
    arrows: Count = 17
    """Along each axis."""


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
        f"a region it slows to {MM * into[0]:.0f} mm/s a millimeter away, and slides along it.",
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


def tubes(settings: FieldSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 2.15: a tube around a curve."""
    del rng
    return _volume_drawn(
        settings,
        _volume((0.0, 0.015)),
        "Within 15 mm of the curve the hand's velocity passes unchanged; outside it is led back.",
    )


def cones(settings: FieldSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 2.16: a cone that leads to a point."""
    del rng
    return _volume_drawn(
        settings,
        _volume((0.0, 0.04), (1.0, 0.002)),
        "The free space narrows from 40 mm to the target's 2 mm; outside the hand is led back.",
        Path(np.array([[0.0, 0, 0], [0.2, 0, 0]])),
    )


def joined_volumes(settings: FieldSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 2.17: tubes and a cone joined to a safe approach."""
    del rng
    return _volume_drawn(
        settings,
        _volume((0.0, 0.012), (0.45, 0.012), (0.6, 0.035), (1.0, 0.002)),
        "A tube of 12 mm opens smoothly into a cone that ends at the target.",
    )


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


def _volume(*knots: tuple[float, float]) -> VolumeSetup:
    """A volume of so many knots: progress, and radius in m."""
    return VolumeSetup(
        knots=tuple(VolumeKnot(progress=share, radius_m=radius_m) for share, radius_m in knots)
    )


def _volume_drawn(
    settings: FieldSettings, volume: VolumeSetup, found: str, path: Path = CURVE
) -> Drawn:
    picture = new_picture(4.0, 7.0)
    ax = picture.subplots()

    def field(place: Array, velocity: Array) -> Array:
        at = project_to_path(path, place, 0.0, path.length_m)
        error_m = float(np.linalg.norm(at.across))
        share = volume_stiffness(volume, at.progress_m / path.length_m, error_m)
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
    radii = np.array([volume_radius_m(volume, s / path.length_m) for s in places])
    for side in (-1.0, 1.0):
        wall = centers[:, :2] + side * radii[:, None] * normals
        ax.plot(*(MM * wall.T), color=COLORS[2], linewidth=1.6)
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
        {"radii_mm": [MM * knot.radius_m for knot in volume.knots], "free_share": free},
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
        *(MM * places[:, :2].T),
        *(MM * led[:, :2].T),
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
    ax.plot(*(MM * path.points[:, :2].T), color=INK, linewidth=1.2)
