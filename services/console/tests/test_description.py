"""A robot's description and its files, as anybody may send them over the wire."""

from __future__ import annotations

import io
import logging
import struct
import zipfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from hmcs.bus.messages import RobotDescription
from hmcs_console.drawing.description import MOST_LINKS, DescriptionError, tidy
from hmcs_console.drawing.drawn_robot import DrawnRobot
from hmcs_console.drawing.nodes import node, node_in
from hmcs_console.drawing.robot_model import MOST_BYTES, MOST_FILES, load_robot, written
from hmcs_console.serving.server import Server

LINKS = '<link name="a"/><link name="b"/>'
JOINT = '<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>'
BACK = '<joint name="k" type="fixed"><parent link="b"/><child link="a"/></joint>'


def robot(inner: str, head: str = "") -> str:
    return f'{head}<robot name="r">{inner}</robot>'


def mesh(filename: str) -> str:
    return robot(
        f'<link name="a"><visual><geometry><mesh filename="{filename}"/></geometry></visual></link>'
    )


@pytest.mark.parametrize(
    ("urdf", "reported"),
    [
        ("", "cannot be read as XML"),
        ("<robot>", "cannot be read as XML"),
        ("<sdf/>", "expected a robot"),
        (robot(LINKS, '<!DOCTYPE robot [<!ENTITY a "b">]>'), "document type"),
        (robot(LINKS, '<!DOCTYPE robot SYSTEM "file:///etc/passwd">'), "document type"),
        (robot(""), "no links"),
        (robot(LINKS + LINKS), "two of one name"),
        (robot("".join(f'<link name="{k}"/>' for k in range(MOST_LINKS + 1))), "more than"),
        (robot(LINKS + JOINT + JOINT), "hangs on two joints"),
        (robot(LINKS + JOINT.replace('"b"', '"c"')), "joins no two links"),
        (
            robot(
                LINKS
                + JOINT
                + JOINT.replace('"a"', '"x"').replace('"b"', '"a"').replace('"x"', '"b"')
            ),
            "circle",
        ),
        (robot(LINKS + JOINT.replace('"b"', '"a"')), "circle"),
        (robot(LINKS + JOINT.replace("fixed", "magic")), "no kind that is known"),
        (robot(LINKS + JOINT.replace("<parent", '<origin xyz="nan 0 0"/><parent')), "3 numbers"),
        (robot(LINKS + JOINT.replace("<parent", '<origin xyz="1e300 0 0"/><parent')), "3 numbers"),
        (robot(LINKS + JOINT.replace("<parent", '<axis xyz="0 1"/><parent')), "3 numbers"),
        (
            robot(LINKS + JOINT.replace("<parent", '<mimic joint="j" offset="x"/><parent')),
            "1 numbers",
        ),
        (robot("x" * 4_000_001), "more than"),
    ],
)
def test_a_description_that_cannot_be_drawn_is_refused(urdf: str, reported: str) -> None:
    with pytest.raises(DescriptionError, match=reported):
        tidy(urdf, {})


def test_entities_are_not_even_read() -> None:
    grows = "".join(f'<!ENTITY e{k} "{f"&e{k - 1};" * 10 if k else "x" * 10}">' for k in range(10))
    with pytest.raises(DescriptionError, match="document type"):
        tidy(robot('<link name="&e9;"/>', f"<!DOCTYPE robot [{grows}]>"), {})


def test_of_a_description_only_what_is_seen_is_kept() -> None:
    reported = tidy(
        robot(
            '<gazebo><plugin filename="evil.so"/></gazebo>'
            '<link name="../../x"><inertial/><collision><geometry><mesh filename="/etc/passwd"/>'
            '</geometry></collision><visual name="../y"><geometry><mesh filename="/dev/zero"/>'
            "</geometry></visual><visual><geometry><sphere radius='1' evil='2'/></geometry>"
            '<material name="m"><color rgba="1 1"/><texture filename="/etc/x.png"/></material>'
            "</visual></link>"
        ),
        {},
    )
    for word in (b"evil", b"etc", b"dev", b"..", b"texture", b"collision"):
        assert word not in reported
    visuals = ElementTree.fromstring(reported).findall("link/visual")
    assert [visual.find("geometry/sphere") is not None for visual in visuals] == [True]


@given(st.text(max_size=60))
def test_any_text_is_tidied_or_refused(text: str) -> None:
    for urdf in (text, robot(text), robot(f'<link name="{text}"/>')):
        try:
            reported = tidy(urdf, {})
        except DescriptionError:
            continue
        assert ElementTree.fromstring(reported).tag == "robot"


# --- files ----------------------------------------------------------------------------------------

TRIANGLE = b"""solid t
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 1 0 0
vertex 0 1 0
endloop
endfacet
endsolid t
"""
OBJ = b"mtllib %s\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n"


def robot_description(urdf: str, files: dict[str, bytes]) -> RobotDescription:
    return RobotDescription(robot="r", urdf=urdf, joints=(), files=files)


def picture(size: tuple[int, int], color: str = "red") -> bytes:
    stream = io.BytesIO()
    Image.new("RGB", size, color).save(stream, "PNG")
    return stream.getvalue()


def huge_picture() -> bytes:
    """The beginning of a picture that says it is huge."""
    data = picture((1, 1))
    return data[:16] + struct.pack(">II", 60_000, 60_000) + data[24:]


def zipped(data: bytes) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.dae", data)
    return stream.getvalue()


def collada(instances: int) -> bytes:
    inner = '<instance_node url="#n"/>' * instances
    return (
        f'<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema">{inner}</COLLADA>'.encode()
    )


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.exe", b"1"),
        ("a", b"1"),
        ("a.zip", b"1"),
        ("a.glb", b"1"),
        ("a.py", b"1"),
        ("..", b"1"),
        ("a/..", b"1"),
        ("", b"1"),
        ("a\x00.stl", b"1"),
        ("a\n.stl", b"1"),
        ("x" * 300 + ".stl", b"1"),
        ("a.dae", b'<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><a>&b;</a>'),
        ("a.dae", zipped(b"0" * 1_000_000)),
        ("a.dae", b"no xml"),
        ("a.dae", collada(60)),
        ("a.png", b"no picture"),
        ("a.png", huge_picture()),
    ],
)
def test_a_file_that_no_robot_is_drawn_by_is_left_out(
    tmp_path: Path, name: str, data: bytes
) -> None:
    assert written({name: data}, tmp_path) == {}
    assert not any(path.is_file() for path in tmp_path.rglob("*"))


def test_files_that_a_robot_is_drawn_by_are_kept(tmp_path: Path) -> None:
    files = {
        "package://r/A.STL": TRIANGLE,
        "m/b.obj": OBJ,
        "m/b.mtl": b"newmtl m",
        "m/größe 1.png": picture((2, 2)),
        "m/c.dae": collada(2),
    }
    assert set(written(files, tmp_path)) == set(files)


@pytest.mark.parametrize(
    "files",
    [
        {f"{k}.stl": b"" for k in range(MOST_FILES + 1)},
        {"a.stl": b"0" * (MOST_BYTES // 2), "b.stl": b"0" * (MOST_BYTES // 2 + 1)},
    ],
    ids=["many", "large"],
)
def test_more_files_than_a_robot_has_are_refused(tmp_path: Path, files: dict[str, bytes]) -> None:
    with pytest.raises(DescriptionError, match="more than"):
        written(files, tmp_path)


def test_a_mesh_is_no_file_but_one_that_came_along(tmp_path: Path) -> None:
    outside = tmp_path / "outside.stl"
    outside.write_bytes(TRIANGLE)
    for name in (str(outside), f"file://{outside}", "http://127.0.0.1:1/x.stl", "b.stl"):
        assert load_robot(robot_description(mesh(name), {"a.stl": TRIANGLE})).scene.is_empty
    assert (
        len(load_robot(robot_description(mesh("a.stl"), {"a.stl": TRIANGLE})).scene.geometry) == 1
    )


def test_a_mesh_reaches_nothing_beyond_what_came_with_it(tmp_path: Path) -> None:
    secret = tmp_path / "secret.png"
    secret.write_bytes(picture((4, 4), "blue"))
    for reached in (str(secret), f"../../../../../../..{secret}", f"file://{secret}"):
        files = {
            "a.obj": OBJ % b"a.mtl",
            "a.mtl": f"newmtl m\nmap_Kd {reached}\n".encode(),
            "a.png": picture((2, 2)),
        }
        (shape,) = load_robot(robot_description(mesh("a.obj"), files)).scene.geometry.values()
        image = getattr(getattr(shape.visual, "material", None), "image", None)
        assert image is None or image.size == (2, 2)
    # One without an end would be read for ever.
    endless = robot_description(mesh("a.obj"), {"a.obj": OBJ % b"/dev/zero"})
    assert len(load_robot(endless).scene.geometry) == 1


def test_its_own_picture_is_on_a_mesh() -> None:
    files = {
        "m/a.obj": OBJ % b"a.mtl",
        "m/a.mtl": b"newmtl m\nmap_Kd a.png\n",
        "m/a.png": picture((2, 2)),
    }
    (shape,) = load_robot(robot_description(mesh("m/a.obj"), files)).scene.geometry.values()
    assert isinstance(shape, trimesh.Trimesh)
    assert shape.visual.material.image.size == (2, 2)


# --- names in the scene ---------------------------------------------------------------------------


@given(st.lists(st.text(), min_size=1, max_size=3))
def test_a_name_is_one_part_of_a_path_whatever_it_is(names: list[str]) -> None:
    path = node(*names)
    assert path.count("/") == len(names)
    assert path.isascii()
    assert path.isprintable()
    assert not set(path.split("/")) & {".", ".."}
    assert len(path) < 1000 * len(names)


def test_a_harmless_name_is_itself() -> None:
    assert node("guides", "write-g_1.0") == "/guides/write-g_1.0"
    assert node("guides", "../x") == "/guides/..%2Fx"
    assert node("guides", "..") == "/guides/%2E%2E"
    assert node_in("/robot/visual/l1") == "/robot/visual/l1"


def test_a_robots_own_names_lead_nowhere_in_the_scene(monkeypatch: pytest.MonkeyPatch) -> None:
    server = Server(logging.getLogger("test"))
    named: list[str] = []
    for verb in ("add_frame", "add_mesh_trimesh"):
        inner = getattr(server.scene, verb)

        def add(name: str, *rest: Any, inner: Any = inner, **settings: Any) -> Any:
            named.append(name)
            return inner(name, *rest, **settings)

        monkeypatch.setattr(server.scene, verb, add)
    evil = b"o ../../handle\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\no <b>\nv 1 1 1\nf 1 2 4\n"
    shape = '<geometry><mesh filename="../a b.obj"/></geometry>'
    urdf = robot(
        f'<link name="../../x"><visual>{shape}</visual></link><link name="/handle"/>'
        '<joint name="&lt;j&gt;" type="revolute"><parent link="../../x"/><child link="/handle"/>'
        "</joint>"
    )
    DrawnRobot(server, load_robot(robot_description(urdf, {"../a b.obj": evil})), "/robot")
    server.stop()
    assert len(named) >= 3
    assert all(name.split("/")[1] == "robot" and ".." not in name.split("/") for name in named)
    assert not any(set(name) & set("<> ") for name in named)
