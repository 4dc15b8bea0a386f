"""What the service needs of an arm: the simulation is one driver, a real robot would be another."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from hmcs.arms.state import ArmState, JointLimits
from hmcs.arrays import Array

if TYPE_CHECKING:
    from hmcs_robot.arm_description import ArmDescription


class ArmDriver(Protocol):
    """An arm that follows joint velocities."""

    name: str
    limits: JointLimits
    joint_names: tuple[str, ...]
    """As in the URDF, n of them."""
    links_within: tuple[str, ...]
    """Links that are not kept out of a forbidden region, since they reach into it at the start."""

    def read(self) -> ArmState:
        """Return where the arm is now."""
        ...

    def move(self, joint_velocities: Array) -> None:
        """Follow `joint_velocities`, rad/s, shape (n,), for one control period."""
        ...

    def robot_description(self) -> ArmDescription:
        """Return what is needed to draw it."""
        ...

    def close(self) -> None:
        """Let go of the arm."""
        ...
