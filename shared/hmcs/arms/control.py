"""From a commanded twist to joint velocities: resolved rate with damped least squares, and limits.

Pure functions: what is carried from tick to tick is passed in and handed back. Resolved rate after
Whitney (1969), damping after Nakamura and Hanafusa (1986) and Wampler (1986).

While the arm follows, a reference pose is integrated from the limited twist and the tool is drawn
to it, so that neither damping nor the arm's own lag adds up to a drift. While it stands, it is held
where it came to rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hmcs.arms.inverses import inverse_of
from hmcs.arms.limits import (
    Limits,
    bounds_of,
    speed_scale,
    within_acceleration,
    within_planes,
    within_speed,
    within_walls,
)
from hmcs.arms.state import ArmState, Pose
from hmcs.arrays import Array, shortened
from hmcs.fixtures.regions.forbidden import NOTHING, Candidates
from hmcs.motion import quaternions


@dataclass(frozen=True)
class Tuning:
    """How the arm is controlled."""

    damping: float = 0.02
    """λ of the damped least squares."""
    slowest_share: float = 0.25
    """On its way into a singularity (smallest singular value below 2λ) the tool slows down in
    proportion, never below this share of its speed."""
    surely_into: float = 0.3
    """Cosine between a motion and the steepest way into a singularity from which on it slows down
    fully; below it slows down less, so that nothing switches on and off."""
    correction_per_s: float = 10.0
    """Rate at which the tool is drawn to its reference pose, and a standing arm to its place."""
    largest_lag_m: float = 0.005
    """The reference pose never runs further ahead of the tool."""
    largest_lag_rad: float = 0.02
    posture_per_s: float = 0.5
    """Rate at which a redundant arm returns to its first posture within its null space."""
    standing_rad_s: float = 0.01
    """Below this joint speed an arm that was stopped counts as standing."""


class Following(NamedTuple):
    """What is carried on while the arm follows commands."""

    pose: Pose
    """Where the tool should be by now."""
    twist: Array
    """The limited velocity it follows, shape (6,)."""


class Standing(NamedTuple):
    """What is carried on while the arm stands or comes to a stand."""

    joint_positions: Array | None = None
    """Where it is held, rad, shape (n,); None until it has come to rest."""


class JointCommand(NamedTuple):
    """What the arm is to do in this tick, and why."""

    joint_velocities: Array
    """rad/s, shape (n,)."""
    carried: Following | Standing
    """To be passed to the next tick."""
    limited: tuple[str, ...]
    """The limits that shape the motion: `speed`, `acceleration`, `workspace`, `region`,
    `singularity`, `joint_speed`, `joint_1` …, `contact`."""

    @property
    def reference_twist(self) -> Array:
        """The velocity the tool follows after all limits, shape (6,)."""
        return self.carried.twist if isinstance(self.carried, Following) else np.zeros(6)


def stand(arm: ArmState, carried: Following | Standing, tuning: Tuning) -> JointCommand:
    """Return the motion that brings the arm to a stand as fast as it can brake, and holds it there.

    An arm in contact is not held in place, lest it press on what it touches.
    """
    still = float(np.abs(arm.joint_velocities).max()) < tuning.standing_rad_s
    place = carried.joint_positions if isinstance(carried, Standing) else None
    if arm.touches or (place is None and not still):
        return JointCommand(np.zeros_like(arm.joint_positions), Standing(), ())
    if place is None:
        place = arm.joint_positions
    back = np.clip(tuning.correction_per_s * (place - arm.joint_positions), -0.05, 0.05)
    return JointCommand(back, Standing(place), ())


def follow(
    arm: ArmState,
    twist: Array,
    carried: Following | Standing,
    posture: Array,
    limits: Limits,
    tuning: Tuning,
    period_s: float,
    planes: Candidates = NOTHING,
) -> JointCommand:
    """Return the motion that follows `twist`, m/s and rad/s, shape (6,), within all limits.

    The speed limits keep the direction of the linear and of the angular part; a wall of the
    workspace takes away the part that leads out, and a plane before a forbidden region the part
    that leads in. Joint ranges, joint speeds and contacts slow the motion as a whole, so that they
    never turn the tool from the commanded direction. After all of these the reference changes
    within the acceleration limits; only ranges, walls, planes and contacts may brake harder. What
    draws the tool to its reference and a redundant arm to its `posture` (n,) gets what is left: it
    never holds the commanded motion up.
    """
    if not isinstance(carried, Following):
        carried = Following(arm.tool, np.zeros(6))
    fast_enough = within_speed(twist, limits)
    walled = within_walls(fast_enough, arm.tool.position, limits)
    admitted = within_planes(walled, planes, limits)
    inverse = inverse_of(arm.jacobian, tuning.damping)
    clear = inverse.smallest / (2 * tuning.damping)
    into = min(1.0, max(0.0, inverse.into_singularity(admitted) / tuning.surely_into))
    slowed = admitted * (1.0 - into * (1.0 - min(1.0, max(clear, tuning.slowest_share))))

    bounds = bounds_of(arm, limits, planes)
    no_motion = np.zeros_like(arm.joint_positions)
    scale, bound = bounds.scale(no_motion, inverse.velocities(slowed))
    wanted = within_acceleration(scale * slowed, carried.twist, limits, period_s)
    led = inverse.velocities(wanted)
    hard_scale, hard_bound = bounds.hard.scale(no_motion, led)

    lag = _lag(arm.tool, carried.pose, tuning)
    drawn = within_speed(wanted + tuning.correction_per_s * lag, limits)
    drawn = within_planes(within_walls(drawn, arm.tool.position, limits), planes, limits)
    aside = inverse.velocities(drawn - wanted) + inverse.within_null_space(
        tuning.posture_per_s * (posture - arm.joint_positions)
    )
    aside_scale, _ = bounds.scale(hard_scale * led, aside)
    velocities = hard_scale * led + aside_scale * aside
    slowing = speed_scale(arm.jacobian @ velocities, limits)

    followed = slowing * hard_scale * wanted
    pose = Pose(
        arm.tool.position + lag[:3] + followed[:3] * period_s,
        quaternions.turned(
            quaternions.turned(arm.tool.orientation, lag[3:], 1.0), followed[3:], period_s
        ),
    )
    limited = (
        *(("speed",) if _differ(fast_enough, twist) else ()),
        *(("workspace",) if _differ(walled, fast_enough) else ()),
        *(("region",) if _differ(admitted, walled) else ()),
        *(("singularity",) if clear < 1.0 else ()),
        *bound,
        *(("acceleration",) if _differ(wanted, scale * slowed) else ()),
        *hard_bound,
    )
    return JointCommand(
        slowing * velocities,
        Following(pose, followed),
        tuple(dict.fromkeys(limited)),
    )


def _lag(tool: Pose, reference: Pose, tuning: Tuning) -> Array:
    """Return how far the reference is ahead of the tool, m and rad, shape (6,), clipped."""
    return np.concatenate(
        [
            shortened(reference.position - tool.position, tuning.largest_lag_m),
            shortened(
                quaternions.between(tool.orientation, reference.orientation), tuning.largest_lag_rad
            ),
        ]
    )


def _differ(one: Array, other: Array) -> bool:
    return bool((np.abs(one - other) > 1e-9).any())
