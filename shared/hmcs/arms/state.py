"""Where an arm is, what its joints can do, and what is near it."""

from __future__ import annotations

from typing import NamedTuple

from hmcs.arrays import Array


class Pose(NamedTuple):
    """A position and an orientation, in the robot's base frame unless said otherwise."""

    position: Array
    """m, shape (3,)."""
    orientation: Array
    """Unit quaternion x y z w, shape (4,)."""


class JointLimits(NamedTuple):
    """What the joints of an arm can do; all of shape (n,)."""

    lower: Array
    """rad, m of a prismatic joint; minus infinity of one that turns without end."""
    upper: Array
    """rad or m; infinity of a joint that turns without end."""
    speed: Array
    """rad/s or m/s."""


class Nearest(NamedTuple):
    """The obstacle nearest to the arm."""

    name: str
    distance_m: float
    """Negative in penetration."""


class Touch(NamedTuple):
    """A place where the arm touches an obstacle."""

    name: str
    """Of the obstacle."""
    separation_per_joint: Array
    """Derivative of the distance there with respect to the joint positions, m/rad, shape (n,):
    times the joint velocities it is the speed of parting, negative where the arm presses in."""


class LinkNear(NamedTuple):
    """Where a link of the arm is near a forbidden region, k places."""

    name: str
    """Of the region."""
    distances_m: Array
    """Negative where the link is inside, shape (k,)."""
    separation_per_joint: Array
    """As in `Touch`, shape (k, n)."""


class ArmState(NamedTuple):
    """Where an arm is and what is near it, at one instant."""

    joint_positions: Array
    """rad, shape (n,)."""
    joint_velocities: Array
    """rad/s, shape (n,)."""
    tool: Pose
    """Of the tool frame."""
    jacobian: Array
    """Of the tool frame, base frame, linear part first, shape (6, n)."""
    nearest: Nearest | None
    """None where no obstacle is within reach of the search."""
    touches: tuple[Touch, ...]
    """Empty while the arm is free."""
    links_near: tuple[LinkNear, ...] = ()
    """Where links are near a forbidden region of the task; empty where none is, or where the driver
    cannot tell: then the tool alone is kept out."""

    @property
    def tool_twist(self) -> Array:
        """Velocity of the tool frame, m/s and rad/s, base frame, shape (6,)."""
        twist: Array = self.jacobian @ self.joint_velocities
        return twist

    @property
    def contacts(self) -> tuple[str, ...]:
        """Names of the obstacles touched, each once, sorted."""
        return tuple(sorted({touch.name for touch in self.touches}))
