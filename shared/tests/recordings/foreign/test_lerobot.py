"""Data sets of LeRobot as demonstrations; the tables are written by pyarrow."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs.motion.demonstrations import Demonstration
from hmcs.recordings.foreign import lerobot_tables
from hmcs.recordings.foreign.choices import AS_IT_IS, Choices, choices_of
from hmcs.recordings.foreign.registry import format_of, take
from support import foreign_files as made


def taken(folder: Path, choices: Choices = AS_IT_IS) -> tuple[Demonstration, ...]:
    form = format_of(folder)
    assert form is not None
    assert form.name == "LeRobot"
    return take(form, folder, choices).demonstrations


def refused(folder: Path, choices: Choices = AS_IT_IS) -> str:
    with pytest.raises(UserError) as caught:
        taken(folder, choices)
    assert str(folder) in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
@pytest.mark.parametrize(
    "names", [("x", "y", "z"), ("ee.x", "ee.y", "ee.z"), ("tcp_pos_x", "tcp_pos_y", "tcp_pos_z")]
)
def test_each_episode_is_a_demonstration(
    version: str, names: tuple[str, ...], tmp_path: Path
) -> None:
    episodes = [made.way(30), 2 * made.way(40)]
    folder = made.write_lerobot(tmp_path / "set", episodes, names, version=version)
    shown = taken(folder)
    assert [each.name for each in shown] == ["set#0", "set#1"]
    for each, way in zip(shown, episodes, strict=True):
        np.testing.assert_allclose(each.positions, way, atol=1e-6)
        np.testing.assert_allclose(each.time_s, np.arange(len(way)) / 50, atol=1e-6)


def test_numbers_are_mapped_by_name_and_unit(tmp_path: Path) -> None:
    values = np.hstack([1000 * made.way(30), np.ones((30, 1))])
    names = ("m0", "m1", "m2", "gripper")
    folder = made.write_lerobot(tmp_path / "set", [values], names, feature="action")
    assert "x=NAME" in refused(folder)
    (shown,) = taken(folder, choices_of(columns="x=m0,y=m1,z=m2", units=["mm"]))
    np.testing.assert_allclose(shown.positions, made.way(30), atol=1e-6)
    assert "'m9'" in refused(folder, choices_of(columns="x=m9,y=m1"))
    assert "action" in refused(folder, choices_of(topics=["observation.images"]))


def test_joint_positions_become_poses_by_the_urdf(tmp_path: Path) -> None:
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(made.ARM)
    degrees = np.linspace(0, 60, 30)
    values = np.stack([degrees, 0 * degrees, 0 * degrees, degrees], axis=1)
    names = ("shoulder.pos", "elbow.pos", "rail.pos", "gripper.pos")
    folder = made.write_lerobot(tmp_path / "set", [values], names)
    (shown,) = taken(folder, choices_of(urdf=urdf, units=["deg"]))
    angle = np.radians(degrees)
    np.testing.assert_allclose(shown.positions[:, 0], 0.7 * np.cos(angle), atol=1e-6)
    np.testing.assert_allclose(shown.positions[:, 1], 0.7 * np.sin(angle), atol=1e-6)
    bare = made.write_lerobot(tmp_path / "bare", [values[:, :2]], names[:2])
    assert "rail" in refused(bare, choices_of(urdf=urdf))


def test_what_is_no_data_set_is_refused_with_its_place(tmp_path: Path) -> None:
    folder = made.write_lerobot(tmp_path / "set", [made.way(30)], ("x", "y", "z"))
    info_file, table = folder / "meta" / "info.json", next(folder.glob("data/*/*.parquet"))
    info: dict[str, Any] = json.loads(info_file.read_text())
    whole = table.read_bytes()
    table.write_bytes(whole[: len(whole) // 2])
    assert "copied whole" in refused(folder)
    table.unlink()
    assert "no frame" in refused(folder)
    table.write_bytes(whole)
    for wrong, said in (
        ("{", "does not describe"),
        ("[]", "does not describe"),
        (json.dumps({**info, "codebase_version": "v1.6"}), "expected v2.1 or v3.0"),
        (json.dumps({**info, "features": {}}), "has no feature"),
        (json.dumps({**info, "features": {"action": 3}}), "does not describe"),
    ):
        info_file.write_text(wrong)
        assert said in refused(folder)


def test_frames_that_are_none_are_refused(tmp_path: Path) -> None:
    values = made.way(30)
    values[7, 1] = np.nan
    folder = made.write_lerobot(tmp_path / "set", [values], ("x", "y", "z"))
    assert "episode 0: frame 7 has a number that is not finite" in refused(folder)


def test_a_table_that_unpacks_to_too_much_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = made.write_lerobot(tmp_path / "set", [made.way(30)], ("x", "y", "z"))
    monkeypatch.setattr(lerobot_tables, "LARGEST_TABLE_BYTES", 100)
    assert "unpack to" in refused(folder)
