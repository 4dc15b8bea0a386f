"""What a physics engine does for a simulated arm, and which engines there are.

An engine is found by its entry point, the name that the setting `engine` gives:

    [project.entry-points."hmcs.robot_engines"]
    pybullet = "hmcs_robot_pybullet.engine:PyBulletEngine"
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from importlib.metadata import entry_points
from typing import NamedTuple, Protocol

from hmcs.arms.state import JointLimits
from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs.task import ForbiddenRegion, Obstacle
from hmcs_robot.kinematics import Kinematics
from hmcs_robot.robots import RobotModel

ENTRY_POINTS = "hmcs.robot_engines"
AUTO = "auto"
PREFERRED = ("pybullet", "mujoco")
"""Of these `auto` takes the first that can be imported."""
JOINTS_BETWEEN = 3
"""Links with fewer joints between them cannot be brought together within the joints' ranges."""
CLEAR_AT_HOME_M = 0.02
"""Links that are nearer at home are built so."""
_INSTALL = {
    "pybullet": "install hmcs-robot-pybullet on CPython 3.11 (there are no wheels for later ones)",
    "mujoco": "install hmcs-robot-mujoco",
}


class Cell(NamedTuple):
    """What an engine simulates: an arm at the origin, and what stands around it."""

    model: RobotModel
    obstacles: tuple[Obstacle, ...]
    """The arm collides with them."""
    forbidden: tuple[ForbiddenRegion, ...]
    """Distances are measured to them; nothing collides with them."""


class Near(NamedTuple):
    """Where a link of the arm is near an obstacle or a region, k places."""

    link: int
    name: str
    """Of the obstacle or region."""
    distances_m: Array
    """Negative in penetration, shape (k,)."""
    on_arm: Array
    """m, base frame, shape (k, 3)."""
    normals: Array
    """Unit vectors away from the obstacle or region, shape (k, 3)."""


class Meeting(NamedTuple):
    """A place where two links of the arm are near each other; points have shape (3,)."""

    one: int
    other: int
    on_one: Array
    """m, base frame."""
    on_other: Array
    normal: Array
    """Unit vector from the other link to the one."""


class Engine(Kinematics, Protocol):
    """An arm in a cell, each of its joints moved by a motor with the torque it has, under gravity.

    Links are numbered as the engine likes; the base has none of the numbers in `moving_links`.
    """

    limits: JointLimits
    joint_names: tuple[str, ...]
    """As in the URDF, n of them."""
    moving_links: frozenset[int]
    """Links with a joint of the arm between them and the base."""

    def link_name(self, link: int) -> str:
        """Return the name of a link, as in the URDF."""
        ...

    def joints(self) -> tuple[Array, Array]:
        """Return joint positions, rad, and velocities, rad/s, both of shape (n,)."""
        ...

    def separation_per_joint(
        self, link: int, points: Array, normals: Array, joint_positions: Array
    ) -> Array:
        """Return how points of `link`, m, base frame, move along `normals`, m/rad.

        One point and normal have shape (3,), the answer (n,); k of them (k, 3), the answer (k, n).
        """
        ...

    def near_obstacles(self, within_m: float) -> Iterable[Near]:
        """Return where links are so near to obstacles."""
        ...

    def near_regions(self, within_m: float) -> Iterable[Near]:
        """Return where moving links are so near to regions: each link and region once.

        Boxes that cover its surface may stand for a mesh.
        """
        ...

    def links_touching(
        self, links: Collection[int], mesh: ForbiddenRegion, within_m: float
    ) -> frozenset[int]:
        """Return which of the links are so near to a mesh, asked triangle by triangle."""
        ...

    def near_itself(self, within_m: float) -> Iterable[Meeting]:
        """Return where links that can meet are so near to each other.

        Links that are near each other at the model's home are built so, and links with fewer than
        `JOINTS_BETWEEN` joints between them cannot be brought together.
        """
        ...

    def step(self, joint_velocities: Array) -> None:
        """Advance the physics by one period, with the motors at `joint_velocities`, rad/s, (n,)."""
        ...

    def close(self) -> None:
        """End the simulation."""
        ...


class OpensEngine(Protocol):
    """An engine's class; raises UserError where no window opens or the arm cannot be loaded."""

    def __call__(self, cell: Cell, period_s: float, *, gui: bool) -> Engine:
        """Load a cell; one step of its physics takes `period_s`."""
        ...


def engine_named(name: str) -> tuple[str, OpensEngine]:
    """Return the name of an engine and what opens it; `auto` is the first that is installed.

    Raises UserError where there is none of that name or it is not installed.
    """
    found = {entry.name: entry for entry in entry_points(group=ENTRY_POINTS)}
    if name == AUTO:
        known = [
            each for each in (*PREFERRED, *sorted(set(found) - set(PREFERRED))) if each in found
        ]
    elif name in found or name in PREFERRED:
        known = [name]
    else:
        choice = ", ".join(sorted({AUTO, *PREFERRED, *found}))
        raise UserError(f"engine is {name!r}, expected one of {choice}")
    why = "there is no such distribution"
    for each in known:
        try:
            return each, found[each].load()
        except (ImportError, KeyError) as error:
            why = str(error) if isinstance(error, ImportError) else why
    remedy = _INSTALL.get(name) or "; or ".join(_INSTALL[each] for each in reversed(PREFERRED))
    raise UserError(f"engine {name}: cannot simulate an arm ({why}): {remedy}")
