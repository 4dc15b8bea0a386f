"""A robot in Rerun: drawn from the URDF kept with a recording, moved by its recorded joints."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from hmcs.errors import UserError
from hmcs.motion.urdf_xml import urdf_element
from hmcs.recordings.rerun_view.rows import Rows, entity

BASE = "base"
"""Of the entities in the robot's base frame."""
BONE_RADIUS_M = 0.01
_BONE_COLOR = 0x888888FF


class DrawnRobot:
    """One robot, at zero until it is moved.

    Raises UserError for a description that is no URDF. A recording holds no meshes: links made of
    them are drawn as lines from joint to joint.
    """

    def __init__(self, stream: Any, robot: str, urdf: bytes) -> None:
        from rerun.urdf import UrdfTree

        element = urdf_element(urdf, f"{robot}.urdf")
        element.set("name", robot)
        has_meshes = _remove_meshes(element)
        with tempfile.TemporaryDirectory(prefix="hmcs-robot-") as folder:
            file = Path(folder) / "robot.urdf"
            file.write_bytes(ElementTree.tostring(element))
            try:
                tree = UrdfTree.from_file_path(
                    file,
                    BASE,
                    frame_prefix=f"{robot}/",
                    static_transform_entity_path=entity(BASE, robot, "fixed_joints"),
                )
            except RuntimeError as error:
                raise UserError(f"{robot}.urdf: {error}") from error
            tree.log_urdf_to_recording(stream)
        self._robot = robot
        self._joints = [joint for joint in tree.joints() if joint.joint_type != "fixed"]
        self._hang_at_base(stream, tree.root_link().name)
        if has_meshes:
            self._draw_bones(stream, tree)

    def move(self, rows: Rows, log_ns: int, positions: Mapping[str, float]) -> None:
        """Put its joints, by name, at these positions, rad or m; the others stay.

        A joint that mimics one of them follows it.
        """
        import rerun as rr

        for joint, position in self._moved(positions):
            place = joint.compute_transform(position, clamp=False)
            rows.add(
                entity(BASE, self._robot, "joints", joint.name),
                rr.Transform3D,
                log_ns,
                translation=place.translation.as_arrow_array().to_pylist()[0],
                quaternion=place.quaternion.as_arrow_array().to_pylist()[0],
                parent_frame=f"{self._robot}/{joint.parent_link}",
                child_frame=f"{self._robot}/{joint.child_link}",
            )

    def _moved(self, positions: Mapping[str, float]) -> Iterator[tuple[Any, float]]:
        for joint in self._joints:
            mimic = joint.mimic
            if mimic is not None and mimic.joint in positions:
                yield joint, mimic.multiplier * positions[mimic.joint] + mimic.offset
            elif joint.name in positions:
                yield joint, positions[joint.name]

    def _hang_at_base(self, stream: Any, root: str) -> None:
        """Put its root at the frame of the entity it is drawn below."""
        import rerun as rr

        hung = rr.Transform3D(parent_frame=f"tf#/{BASE}", child_frame=f"{self._robot}/{root}")
        stream.log(entity(BASE, self._robot, "root"), hung, static=True)

    def _draw_bones(self, stream: Any, tree: Any) -> None:
        import rerun as rr

        for joint in tree.joints():
            bone = rr.LineStrips3D(
                [[[0.0, 0.0, 0.0], list(joint.origin_xyz)]],
                colors=_BONE_COLOR,
                radii=BONE_RADIUS_M,
            )
            frame = rr.CoordinateFrame(f"{self._robot}/{joint.parent_link}")
            stream.log(entity(BASE, self._robot, "bones", joint.name), bone, frame, static=True)


def _remove_meshes(robot: ElementTree.Element) -> bool:
    """Leave out collision shapes and what is in files; return whether a link is made of any."""
    found = False
    for link in robot.iter("link"):
        for shape in link.findall("collision"):
            link.remove(shape)
        for shape in link.findall("visual"):
            if next(shape.iter("mesh"), None) is not None:
                link.remove(shape)
                found = True
    for material in robot.iter("material"):
        for texture in material.findall("texture"):
            material.remove(texture)
    return found
