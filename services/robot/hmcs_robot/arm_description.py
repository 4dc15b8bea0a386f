"""How an arm looks: its description and the meshes it names, to be drawn."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from hmcs_robot.description.described import DescribedArm
from hmcs_robot.description.meshes import names_of


class ArmDescription(NamedTuple):
    """What is needed to draw an arm."""

    urdf: str
    joints: tuple[str, ...]
    """Names in the URDF of the joints that are reported, in their order."""
    files: dict[str, bytes]
    """Meshes, and the materials and textures beside them, by the name the URDF gives them."""


def arm_description(arm: DescribedArm) -> ArmDescription:
    """Return the looks of an arm; names that lead to no file are left out."""
    files: dict[str, bytes] = {}
    for name in names_of(arm.urdf):
        mesh = arm.files.find(name)
        if mesh is None:
            continue
        files[name] = mesh.read_bytes()
        material = mesh.with_suffix(".mtl")
        if material.is_file():
            files[str(Path(name).with_suffix(".mtl"))] = material.read_bytes()
    return ArmDescription(arm.to_draw(), arm.chain.joint_names, files)
