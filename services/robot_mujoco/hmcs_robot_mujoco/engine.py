"""The engine `mujoco`: an arm among what stands in its cell, simulated by MuJoCo."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from itertools import combinations, groupby, product
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from hmcs.arms.state import Pose
from hmcs.arrays import Array
from hmcs.fixtures.regions.closest import cross
from hmcs.task import ForbiddenRegion
from hmcs_robot.description.following import CAUGHT_UP_PER_S, followed_by
from hmcs_robot.engine import CLEAR_AT_HOME_M, JOINTS_BETWEEN, Cell, Meeting, Near
from hmcs_robot.solids import corners_of
from hmcs_robot_mujoco.distances import Closest, OwnPairs, Pairs
from hmcs_robot_mujoco.loading import loaded
from hmcs_robot_mujoco.motors import torques_for
from hmcs_robot_mujoco.triangles import Probe

if TYPE_CHECKING:
    from hmcs_robot_mujoco.window import Window


class MujocoEngine:
    """An arm in a model of MuJoCo; see `hmcs_robot.engine.Engine`.

    Links are numbered as MuJoCo's bodies. Raises UserError for an arm that MuJoCo cannot load, and
    where no window opens.
    """

    def __init__(self, cell: Cell, period_s: float, *, gui: bool) -> None:
        cell_of = loaded(cell, period_s)
        self._model, self._period_s = cell_of.model, period_s
        self._data = mujoco.MjData(self._model)
        self._elsewhere = mujoco.MjData(self._model)
        """For what is asked of a posture that the arm is not in."""
        arm = cell_of.arm
        self.limits, self.joint_names = arm.chain.limits, arm.chain.joint_names
        self._torques = arm.chain.efforts
        moved = [self._model.joint(k).name for k in range(self._model.njnt)]
        self._per_joint, self._offsets = followed_by(arm.chain, moved)
        self._leaders = [moved.index(name) for name in self.joint_names]
        """Of the joints that MuJoCo moves; the others follow these."""
        self._tool = int(self._model.body(arm.tool_link).id)
        self._tool_offset = np.array([0.0, 0.0, cell.model.tool_offset_m])
        self._mass = np.zeros((self._model.nv, self._model.nv))
        self._obstacles = cell_of.obstacles
        self._joints_below = _joints_below(self._model)
        self.moving_links = frozenset(
            link for link, below in enumerate(self._joints_below) if below
        )
        self._link_of: list[int] = self._model.geom_bodyid.tolist()
        moving = [g for g, link in enumerate(self._link_of) if link in self.moving_links]
        self._geoms_of = [
            [geom for geom, of in enumerate(self._link_of) if of == link]
            for link in range(self._model.nbody)
        ]
        self._to_obstacles = Pairs(self._model, moving, list(self._obstacles))
        self._to_regions = {
            name: Pairs(self._model, moving, list(geoms)) for name, geoms in cell_of.regions.items()
        }
        self.place(arm.home)
        self._own_pairs = self._that_may_meet()
        self._window = _window(self._model, self._data) if gui else None

    def link_name(self, link: int) -> str:
        """Return the name of a link, as in the URDF."""
        return str(self._model.body(link).name)

    def place(self, joint_positions: Array) -> None:
        """Put the arm at `joint_positions`, rad, shape (n,), at rest."""
        self._data.qpos[:] = self._all_moved(joint_positions)
        self._data.qvel[:] = 0.0
        mujoco.mj_step1(self._model, self._data)

    def tool(self) -> Pose:
        """Return the pose of the tool frame where the arm is now."""
        w, x, y, z = self._data.xquat[self._tool].tolist()
        return Pose(self._tool_point(self._data), np.array([x, y, z, w]))

    def jacobian(self, joint_positions: Array) -> Array:
        """Return the Jacobian of the tool frame, base frame, linear part first, shape (6, n)."""
        data = self._at(joint_positions)
        return self._jacobian(data, self._tool, self._tool_point(data))

    def joints(self) -> tuple[Array, Array]:
        """Return joint positions, rad, and velocities, rad/s, both of shape (n,)."""
        return self._data.qpos[self._leaders], self._data.qvel[self._leaders]

    def separation_per_joint(
        self, link: int, points: Array, normals: Array, joint_positions: Array
    ) -> Array:
        """Return how points of `link` move along `normals`, m/rad, shape (n,) or (k, n)."""
        data = self._at(joint_positions)
        origin = data.xpos[link]
        jacobian = self._jacobian(data, link, origin)
        # n·(v + ω × r) = n·v + (r × n)·ω, r from the link's origin to the point.
        speeds: Array = normals @ jacobian[:3] + cross(points - origin, normals) @ jacobian[3:]
        return speeds

    def near_obstacles(self, within_m: float) -> Iterator[Near]:
        """Yield where links are so near to obstacles."""
        yield from self._grouped(self._to_obstacles.near(self._data, within_m), self._obstacles)

    def near_regions(self, within_m: float) -> Iterator[Near]:
        """Yield where moving links are so near to regions: each link and region once."""
        for name, pairs in self._to_regions.items():
            found = list(pairs.near(self._data, within_m))
            yield from self._grouped(found, {each.other: name for each in found})

    def links_touching(
        self, links: Collection[int], mesh: ForbiddenRegion, within_m: float
    ) -> frozenset[int]:
        """Return which of the links are so near to a mesh, asked triangle by triangle."""
        probe = Probe(self._model, self._data, corners_of(mesh))
        return frozenset(
            link
            for link in links
            if any(probe.touches(geom, within_m) for geom in self._geoms_of[link])
        )

    def near_itself(self, within_m: float) -> Iterator[Meeting]:
        """Yield where links that can meet are so near to each other."""
        for (one, other), each in self._own_pairs.near(self._data, within_m).items():
            yield Meeting(one, other, each.on_one, each.on_other, each.normal)

    def step(self, joint_velocities: Array) -> None:
        """Advance the physics by one period, with the motors at `joint_velocities`, rad/s, (n,)."""
        mujoco.mj_fullM(self._model, self._data, self._mass)
        self._data.qfrc_applied[:] = self._applied(joint_velocities)
        mujoco.mj_step2(self._model, self._data)
        mujoco.mj_step1(self._model, self._data)
        if self._window is not None:
            self._window.show()

    def close(self) -> None:
        """End the simulation."""
        if self._window is not None:
            self._window.close()

    def _applied(self, joint_velocities: Array) -> Array:
        """Return the torques on all joints, m of them, that the arm's motors have, (m,).

        Joints that follow others move with them as if gears joined them: the motors carry both.
        """
        data, per_joint = self._data, self._per_joint
        acceleration = (joint_velocities - data.qvel[self._leaders]) / self._period_s
        behind = CAUGHT_UP_PER_S * (self._all_moved(data.qpos[self._leaders]) - data.qpos)
        drawn = (per_joint @ data.qvel[self._leaders] + behind - data.qvel) / self._period_s
        mass = per_joint.T @ self._mass @ per_joint
        bias = per_joint.T @ (self._mass @ drawn + data.qfrc_bias)
        torques = torques_for(acceleration, mass, bias, self._torques)
        reached = per_joint @ np.linalg.solve(mass, torques - bias) + drawn
        applied: Array = self._mass @ reached + data.qfrc_bias
        return applied

    def _tool_point(self, data: mujoco.MjData) -> Array:
        turn = data.xmat[self._tool].reshape(3, 3)
        point: Array = data.xpos[self._tool] + turn @ self._tool_offset
        return point

    def _at(self, joint_positions: Array) -> mujoco.MjData:
        """Return MuJoCo's data of a posture."""
        positions = self._all_moved(joint_positions)
        if np.array_equal(positions, self._data.qpos):
            return self._data
        self._elsewhere.qpos[:] = positions
        mujoco.mj_kinematics(self._model, self._elsewhere)
        mujoco.mj_comPos(self._model, self._elsewhere)
        return self._elsewhere

    def _jacobian(self, data: mujoco.MjData, link: int, point: Array) -> Array:
        """Return the Jacobian of a point of a link, by the arm's joints, (6, n)."""
        jacobian = np.zeros((6, self._model.nv))
        mujoco.mj_jac(self._model, data, jacobian[:3], jacobian[3:], point, link)
        return np.asarray(jacobian @ self._per_joint)

    def _all_moved(self, joint_positions: Array) -> Array:
        """Return the positions of all joints that MuJoCo moves, for those of the arm, (n,)."""
        positions: Array = self._per_joint @ joint_positions + self._offsets
        return positions

    def _grouped(self, found: Iterable[Closest], names: dict[int, str]) -> Iterator[Near]:
        """Yield what is near, each link and name once."""

        def key(each: Closest) -> tuple[str, int]:
            return names[each.other], self._link_of[each.one]

        for (name, link), several in groupby(sorted(found, key=key), key):
            own = list(several)
            yield Near(
                link,
                name,
                np.array([each.distance_m for each in own]),
                np.array([each.on_one for each in own]),
                np.array([each.normal for each in own]),
            )

    def _pairs_of(self, links: Iterable[tuple[int, int]]) -> OwnPairs:
        """Return the geometries of pairs of links."""
        of = self._geoms_of
        return OwnPairs(
            self._model, [pair for one, other in links for pair in product(of[one], of[other])]
        )

    def _that_may_meet(self) -> OwnPairs:
        """Links with so many joints between them that they may meet but do not at home."""
        below = self._joints_below
        far = [
            (one, other)
            for one, other in combinations(range(1, self._model.nbody), 2)
            if abs(below[one] - below[other]) >= JOINTS_BETWEEN
        ]
        near = self._pairs_of(far).near(self._data, CLEAR_AT_HOME_M)
        return self._pairs_of(pair for pair in far if pair not in near)


def _joints_below(model: mujoco.MjModel) -> list[int]:
    """How many joints are between the base and each body."""
    below: list[int] = []
    for body in range(model.nbody):
        parent = int(model.body_parentid[body])
        below.append((below[parent] if body else 0) + int(model.body_jntnum[body]))
    return below


def _window(model: mujoco.MjModel, data: mujoco.MjData) -> Window:
    # Imported here: it looks for a display, and a robot rarely has a window.
    from hmcs_robot_mujoco.window import Window

    return Window(model, data)
