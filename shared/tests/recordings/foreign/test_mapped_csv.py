"""CSV files with columns of other names, units and times."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs.motion.demonstrations import Demonstration
from hmcs.recordings.csv_labels import LabeledCsv, read_labeled_csv
from hmcs.recordings.foreign.choices import AS_IT_IS, Choices, choices_of

EXPECTED = [(0.1, 0.2, 0.3), (0.11, 0.22, 0.33)]


def read(tmp_path: Path, text: str, choices: Choices = AS_IT_IS) -> LabeledCsv:
    file = tmp_path / "take.csv"
    file.write_text(text, encoding="utf-8")
    return read_labeled_csv(file, choices)


def is_expected(shown: Demonstration) -> bool:
    return np.allclose(shown.positions, EXPECTED, rtol=1e-12, atol=0) and bool(
        np.isclose(shown.time_s[1] - shown.time_s[0], 0.25, rtol=0, atol=1e-9)
    )


@pytest.mark.parametrize(
    "text",
    [
        "time_ms,x_mm,y_mm,z_mm\n500,100,200,300\n750,110,220,330\n",
        "timestamp [ns],tcp.x [mm],tcp.y [mm],tcp.z [mm]\n1790000000000000000,100,200,300\n"
        "1790000000250000000,110,220,330\n",
        "Time (s),TCP X (cm),TCP Y (cm),TCP Z (cm)\n0,10,20,30\n0.25,11,22,33\n",
        "timestamp;ee_x_m;ee_y_m;ee_z_m\n2026-03-01T12:00:00.5;0,1;0,2;0,3\n"
        "2026-03-01T12:00:00.75;0,11;0,22;0,33\n",
        "joint_1,time_ms,target_x_mm,tcp_x_mm,tcp_y_mm,tcp_z_mm\n0,0,9,100,200,300\n"
        "0,250,9,110,220,330\n",
    ],
)
def test_a_header_that_tells_is_enough(text: str, tmp_path: Path) -> None:
    labeled = read(tmp_path, text)
    assert is_expected(labeled.demonstration)
    assert "columns time=" in labeled.notes[0]


def test_what_the_header_does_not_tell_is_said(tmp_path: Path) -> None:
    text = "stamp,a,b,c,mood\n0,100,200,300,happy\n250,110,220,330,happy\n"
    choices = choices_of(columns="time=stamp,x=a,y=b,z=c,state=mood", units=["mm"], time="ms")
    shown = read(tmp_path, text, choices).demonstration
    assert is_expected(shown)
    assert shown.states == ("happy", "happy")
    bare = "t,x,y,z\n0,100,200,300\n250,110,220,330\n"
    assert is_expected(read(tmp_path, bare, choices_of(units=["mm"], time="ms")).demonstration)
    with pytest.raises(UserError, match=r"take.csv:1: t, x, y seem .* say them by --unit"):
        read(tmp_path, bare)


def test_orientation_and_force_of_other_names_are_read(tmp_path: Path) -> None:
    text = (
        "time_s,pos_x_m,pos_y_m,pos_z_m,quat_x,quat_y,quat_z,quat_w,"
        "force_x,force_y,force_z,torque_x,torque_y,torque_z\n"
        "0,0.1,0.2,0.3,0,0,0,1,1,2,3,4,5,6\n0.25,0.11,0.22,0.33,0,0,1,0,1,2,3,4,5,7\n"
    )
    shown = read(tmp_path, text).demonstration
    assert is_expected(shown)
    assert shown.orientations is not None
    assert shown.orientations.tolist() == [[0, 0, 0, 1], [0, 0, 1, 0]]
    assert shown.wrenches is not None
    assert shown.wrenches[1].tolist() == [1, 2, 3, 4, 5, 7]


def test_a_file_of_our_own_stays_what_it_is(tmp_path: Path) -> None:
    text = "time_s,x_m,y_m,z_m,velocity_mm\n5,0.1,0.2,0.3,9\n5.25,0.11,0.22,0.33,9\n"
    labeled = read(tmp_path, text)
    assert labeled.demonstration.time_s.tolist() == [5, 5.25]
    assert is_expected(labeled.demonstration)


@pytest.mark.parametrize(
    ("text", "choices", "said"),
    [
        ("time_s,x_m,y_mm\n0,1,2\n1,1,2\n", AS_IT_IS, "take.csv:1: "),
        ("time_ms,x_m,y_mm\n0,1,2\n1,1,2\n", AS_IT_IS, "in several units"),
        ("t,a,b\n0,1,2\n", choices_of(columns="x=a"), "which column is y?"),
        ("t,a,b\n0,1,2\n", choices_of(columns="x=tcp_x,y=b"), "has no column 'tcp_x' for x"),
        ("time_ms,x_mm,y_mm\n0,1,2\nnow,1,2\n", AS_IT_IS, "take.csv:3: "),
        ("time_ms,x_mm,y_mm\n0,1,2\n1,nan,2\n", AS_IT_IS, "take.csv:3: "),
        ("time,x_m,y_m\n2026-03-01,1,2\nlater,1,2\n", AS_IT_IS, "take.csv:3: time is 'later'"),
    ],
)
def test_what_cannot_be_read_is_refused_with_its_line(
    text: str, choices: Choices, said: str, tmp_path: Path
) -> None:
    with pytest.raises(UserError) as caught:
        read(tmp_path, text, choices)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"units": ["mm", "cm"]}, "one recording has one unit"),
        ({"units": ["furlong"]}, "expected one of m, cm"),
        ({"time": "min"}, "expected one of s, ms"),
        ({"columns": "x"}, "write ROLE=COLUMN"),
        ({"columns": "speed=v"}, "roles are time x"),
        ({"columns": "x=a,x=b"}, "is there twice"),
        ({"marks": "a=b"}, "write BUTTON=STATE"),
        ({"link": "tool0"}, "--urdf"),
    ],
)
def test_choices_that_are_none_are_refused(words: dict[str, object], said: str) -> None:
    with pytest.raises(UserError, match=said):
        choices_of(**words)  # type: ignore[arg-type]
