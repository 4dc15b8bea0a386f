"""MuJoCo's model of a cell: the arm of a URDF, obstacles, and forbidden regions."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import mujoco
import numpy as np

from hmcs.errors import UserError
from hmcs_robot.description.described import DescribedArm, describe
from hmcs_robot.description.meshes import READ
from hmcs_robot.engine import Cell
from hmcs_robot.solids import Solid, solid_of, solids_of
from hmcs_robot_mujoco.triangles import PROBE

_GRAVITY_M_S2 = 9.81
_COMPILER = {
    "fusestatic": "false",  # a tool without mass keeps its frame
    "strippath": "false",
    "discardvisual": "false",
    "balanceinertia": "true",
    "inertiafromgeom": "false",
    "boundmass": "1e-9",
    "boundinertia": "1e-12",
}
_KINDS = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
}
_READ_BY_MUJOCO = (".obj", ".stl")
_READ = (*READ, ".ply")
"""By MuJoCo, or by trimesh for it."""
_STIFF = ((0.01, 1.0), (0.99, 0.999, 0.0005, 0.5, 2.0))
"""Time constant, s, and damping of a contact, and its impedance: the arm enters an obstacle by
tenths of a millimeter."""
_SMALLEST = Solid("box", np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]), halves_m=np.full(3, 1e-3))


class Loaded(NamedTuple):
    """A cell in MuJoCo; geometries are numbered as in the model."""

    model: mujoco.MjModel
    arm: DescribedArm
    obstacles: dict[int, str]
    """Names by geometry."""
    regions: dict[str, tuple[int, ...]]
    """Geometries by name."""


def loaded(cell: Cell, period_s: float) -> Loaded:
    """Return a cell in MuJoCo; raises UserError for an arm that MuJoCo cannot load."""
    arm = describe(cell.model)
    spec = _spec(arm)
    for geom in spec.geoms:
        geom.contype, geom.conaffinity = 1, 0
        geom.solref, geom.solimp = _STIFF
    spec.option.timestep = period_s
    spec.option.gravity = [0.0, 0.0, -_GRAVITY_M_S2]
    spec.option.ccd_tolerance = 1e-9
    obstacles = {f"obstacle {k}": each for k, each in enumerate(cell.obstacles)}
    regions = {
        f"region {k} {part}": (region.name, solid)
        for k, region in enumerate(cell.forbidden)
        for part, solid in enumerate(solids_of(region))
    }
    for name, obstacle in obstacles.items():
        _add(spec, name, solid_of(obstacle), collides=True)
    for name, (_, solid) in regions.items():
        _add(spec, name, solid, collides=False)
    _add(spec, PROBE, _SMALLEST, collides=False)
    try:
        model = spec.compile()
    except ValueError as error:
        raise UserError(f"{cell.model.urdf}: MuJoCo cannot simulate it: {error}") from error
    # Its motors are ideal but for their strength.
    model.dof_damping[:] = 0.0
    model.dof_frictionloss[:] = 0.0
    numbers: dict[str, list[int]] = {region.name: [] for region in cell.forbidden}
    for name, (region_name, _) in regions.items():
        numbers[region_name].append(model.geom(name).id)
    return Loaded(
        model,
        arm,
        {model.geom(name).id: obstacle.name for name, obstacle in obstacles.items()},
        {name: tuple(geoms) for name, geoms in numbers.items()},
    )


def _spec(arm: DescribedArm) -> mujoco.MjSpec:
    """Return MuJoCo's description of an arm, its meshes read."""
    robot = ElementTree.fromstring(arm.to_simulate(_READ))
    options = ElementTree.SubElement(robot, "mujoco")
    ElementTree.SubElement(options, "compiler", _COMPILER)
    meshes: dict[str, bytes] = {}
    for number, mesh in enumerate(robot.findall("link/collision/geometry/mesh")):
        file = Path(mesh.get("filename", ""))
        unique = f"mesh_{number}{file.suffix.lower()}"
        if unique.endswith(_READ_BY_MUJOCO) and not _is_text_stl(file):
            meshes[unique] = file.read_bytes()
        else:
            unique = f"mesh_{number}.obj"
            meshes[unique] = _hull(file)
        mesh.set("filename", unique)
    for link in robot.findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    text = ElementTree.tostring(robot, encoding="unicode")
    try:
        return mujoco.MjSpec.from_string(text, assets=meshes)
    except ValueError as error:
        raise UserError(f"{arm.urdf.file}: MuJoCo cannot read it: {error}") from error


def _is_text_stl(file: Path) -> bool:
    with file.open("rb") as opened:
        begin = opened.read(1024)
    return file.suffix.lower() == ".stl" and begin.startswith(b"solid") and b"facet" in begin


def _hull(file: Path) -> bytes:
    """Return the convex hull of a mesh, which is what collides, as OBJ."""
    # Imported here: it takes longer than all the rest, and few arms need it.
    import trimesh

    try:
        hull = trimesh.load_mesh(file).convex_hull
    except Exception as error:
        # What trimesh raises depends on the format and on where in the file it stumbles.
        raise UserError(f"{file}: cannot be read as a mesh: {error}") from error
    lines = [
        *(f"v {x!r} {y!r} {z!r}" for x, y, z in hull.vertices.tolist()),
        *(f"f {a} {b} {c}" for a, b, c in (hull.faces + 1).tolist()),
    ]
    return "\n".join(lines).encode()


def _add(spec: mujoco.MjSpec, name: str, solid: Solid, *, collides: bool) -> None:
    size = (
        solid.halves_m.tolist()
        if solid.kind == "box"
        else [solid.radius_m, 0.5 * solid.length_m, 0.0]
    )
    x, y, z, w = solid.orientation.tolist()
    geom = spec.worldbody.add_geom(
        name=name,
        type=_KINDS[solid.kind],
        size=size,
        pos=solid.position.tolist(),
        quat=[w, x, y, z],
        contype=0,
        conaffinity=1 if collides else 0,
        rgba=[0.45, 0.55, 0.65, 1.0] if collides else [0.85, 0.25, 0.15, 0.2],
    )
    geom.solref, geom.solimp = _STIFF
