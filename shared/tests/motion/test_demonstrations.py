"""Demonstration files: read back bit by bit, and every mistake reported with its line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hmcs.errors import UserError
from hmcs.motion.demonstrations import (
    Demonstration,
    DemonstrationError,
    read_csv,
    read_with_others,
    write_csv,
)

finite = st.floats(-1e6, 1e6, allow_nan=False)


def quaternions(count: int, seed: int) -> np.ndarray:
    made = np.random.default_rng(seed).normal(size=(count, 4))
    return np.asarray(made / np.linalg.norm(made, axis=1, keepdims=True))


@given(
    times=st.lists(finite, min_size=2, max_size=20, unique=True),
    data=st.data(),
)
def test_what_is_written_is_read_back_to_the_last_bit(
    tmp_path_factory: pytest.TempPathFactory, times: list[float], data: st.DataObject
) -> None:
    count = len(times)
    labels = st.sampled_from([None, "reach", "a-1", "with, comma"])
    demonstration = Demonstration(
        "d.csv",
        np.array(sorted(times)),
        data.draw(arrays(float, (count, 3), elements=finite)),
        tuple(data.draw(st.lists(labels, min_size=count, max_size=count))),
        data.draw(st.none() | st.integers(0, 99).map(lambda seed: quaternions(count, seed))),
        data.draw(st.none() | arrays(float, (count, 6), elements=finite)),
    )
    file = tmp_path_factory.mktemp("csv") / "d.csv"
    write_csv(file, demonstration)
    back = read_csv(file)
    assert back.name == demonstration.name
    np.testing.assert_array_equal(back.time_s, demonstration.time_s)
    np.testing.assert_array_equal(back.positions, demonstration.positions)
    assert back.states == demonstration.states
    for sense in ("orientations", "wrenches"):
        np.testing.assert_array_equal(getattr(back, sense), getattr(demonstration, sense))


SENSES = "qx,qy,qz,qw,fx_n,fy_n,fz_n,tx_nm,ty_nm,tz_nm"


def test_orientation_and_wrench_are_read_from_their_columns(tmp_path: Path) -> None:
    file = tmp_path / "felt.csv"
    file.write_text(
        f"time_s,x_m,y_m,{SENSES},state\n0,1,2,0,0,0,1,1,2,3,4,5,6,a\n1,3,4,0.6,0,0,-0.8,6,5,4,3,2,1,\n"
    )
    read = read_csv(file)
    np.testing.assert_array_equal(read.positions, [[1, 2, 0], [3, 4, 0]])
    np.testing.assert_array_equal(read.orientations, [[0, 0, 0, 1], [0.6, 0, 0, -0.8]])
    np.testing.assert_array_equal(read.wrenches, [[1, 2, 3, 4, 5, 6], [6, 5, 4, 3, 2, 1]])
    assert read.states == ("a", None)


def test_a_switch_is_where_another_label_begins() -> None:
    states = ("a", "a", None, "b", "a", "a")
    demonstration = Demonstration("d", np.arange(6.0), np.zeros((6, 3)), states)
    np.testing.assert_array_equal(demonstration.switches, [1, 0, 1, 1, 1, 0])
    assert not demonstration._replace(states=(None,) * 6).switches.any()


def test_a_cut_has_its_samples_of_everything() -> None:
    whole = Demonstration(
        "d",
        np.arange(6.0),
        np.arange(18.0).reshape(6, 3),
        tuple("aabbcc"),
        quaternions(6, 0),
        np.arange(36.0).reshape(6, 6),
    )
    part = whole.cut(2, 5)
    assert part.states == ("b", "b", "c")
    for name in ("time_s", "positions", "orientations", "wrenches"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[2:5])
    assert whole._replace(orientations=None, wrenches=None).cut(1, None)[4:] == (None, None)


def test_two_dimensions_lie_in_the_plane_z_0(tmp_path: Path) -> None:
    file = tmp_path / "flat.csv"
    file.write_text("time_s,x_m,y_m\n0,1,2\n1,3,4\n")
    np.testing.assert_array_equal(read_csv(file).positions, [[1, 2, 0], [3, 4, 0]])


def test_windows_files_with_a_mark_and_empty_lines_are_read(tmp_path: Path) -> None:
    file = tmp_path / "w.csv"
    text = "\ufefftime_s,x_m,y_m,state\r\n0,1,2,a\r\n\r\n1,3,4,\r\n"
    file.write_bytes(text.encode())
    assert read_csv(file).states == ("a", None)


READ_AS_ONE: dict[str, str] = {
    "semicolons": "time_s;x_m;y_m;z_m;state\n0;0.5;-1;2e-3;a\n1;1.5;0;0;\n",
    "decimal commas": "time_s;x_m;y_m;z_m;state\n0;0,5;-1;2e-3;a\n1;1,5;0;0;\n",
    "tabs": "time_s\tx_m\ty_m\tz_m\tstate\n0\t0,5\t-1\t2e-3\ta\n1\t1.5\t0\t0\t\n",
    "remarks": '# by hand\ntime_s,x_m,y_m,z_m,state\n0,0.5,-1,2e-3,a\n # "x\n1,1.5,0,0,\n# end\n',
    "capitals": "TIME_S, X_m ,Y_M,Z_M,State\n0,0.5,-1,2e-3,a\n1,1.5,0,0,\n",
    "another order": "state,z_m,y_m,x_m,time_s\na,2e-3,-1,0.5,0\n,0,0,1.5,1\n",
    "others": "frame,time_s,x_m,y_m,gripper,z_m,state,state_id\n"
    "one,0,0.5,-1,,2e-3,a,7\ntwo,1,1.5,0,x,0,,\n",
    "empty columns": "time_s;x_m;y_m;z_m;state;;\n0;0.5;-1;2e-3;a;;\n1;1.5;0;0;;;\n",
    "quotes": '"time_s","x_m","y_m","z_m","state"\n"0","0.5","-1","2e-3","a"\n1,1.5,0,0,\n',
}


@pytest.mark.parametrize("written", READ_AS_ONE.values(), ids=READ_AS_ONE)
def test_tables_as_people_have_them_are_read_alike(tmp_path: Path, written: str) -> None:
    file = tmp_path / "d.csv"
    for text in (written, "\ufeff" + written.replace("\n", "\r\n")):
        file.write_bytes(text.encode())
        found = read_csv(file)
        np.testing.assert_array_equal(found.time_s, [0, 1])
        np.testing.assert_array_equal(found.positions, [[0.5, -1, 2e-3], [1.5, 0, 0]])
        assert found.states == ("a", None)


def test_what_numpy_writes_is_read_with_its_header_in_a_remark(tmp_path: Path) -> None:
    file, rows = tmp_path / "d.csv", np.random.default_rng(1).normal(size=(20, 4)).cumsum(axis=0)
    rows[:, 0] = np.arange(20)
    for separator in (",", ";", "\t"):
        header = separator.join(("time_s", "x_m", "y_m", "z_m"))
        np.savetxt(file, rows, delimiter=separator, header=header)
        np.testing.assert_array_equal(read_csv(file).positions, rows[:, 1:])


def test_columns_that_are_not_read_are_named(tmp_path: Path) -> None:
    file = tmp_path / "d.csv"
    file.write_text("time_s,Frame,x_m,y_m,z_m,w_m\n0,a,1,2,3,4\n1,b,1,2,4,4\n")
    assert read_with_others(file).ignored == ("Frame", "w_m")


GOOD = "time_s,x_m,y_m,z_m\n0,0,0,0\n1,1,1,1\n"


@pytest.mark.parametrize(
    ("content", "line", "said"),
    [
        (b"", 1, "empty"),
        (b"\n  \n", 1, "empty"),
        (b"0,0,0\n1,1,1\n", 1, "header is missing"),
        (b"time_s,x_m,y_m,zz_m\n0,0,0,0\n", 1, "column 'zz_m' (did you mean 'z_m'?)"),
        (b"time_s,x_m\n0,0\n1,1\n", 1, "no column 'y_m' in 'time_s,x_m': add it, 0 in all rows"),
        (b"time_s,x_m,z_m\n0,0,0\n1,1,1\n", 1, "no column 'y_m' in 'time_s,x_m,z_m'"),
        (b"t,x,y\n0,0,0\n1,1,1\n", 1, "'x' (did you mean 'x_m'?)"),
        (b"Time,X_mm,Y_mm\n0,0,0\n", 1, "'X_mm' (did you mean 'x_m'?)"),
        (b"time_s,x_m,y_m,stat\n0,0,0,a\n", 1, "'stat' (did you mean 'state'?)"),
        (b"time_s,x_m,y_m,qx,qy,qw\n", 1, "no column 'qz'"),
        (b"time_s,x_m,y_m,fx_n,fy_n,fz_n,state\n", 1, "no column 'tx_nm', 'ty_nm', 'tz_nm'"),
        (b"time_s,x_m,y_m,qx,qy,qz,qw\n0,0,0,0,0,0,1\n1,0,0,0,0,0,2\n", 3, "length 1"),
        (b"time_s,x_m,y_m,qx,qy,qz,qw\n0,0,0,0,0,0,nan\n", 2, "qw is nan"),
        (b"time_s,x_m,y_m,y_m\n0,0,0,0\n1,0,0,0\n", 1, "header must be"),
        (GOOD.encode() + b"2,2,2\n", 4, "3 field(s), expected 4"),
        (GOOD.encode() + b"2,2,2,2,2\n", 4, "5 field(s), expected 4"),
        (GOOD.encode() + b"2,2,nan,2\n", 4, "y_m is nan"),
        (GOOD.encode() + b"2,2,2,-inf\n", 4, "z_m is -inf"),
        (GOOD.encode() + b"2,two,2,2\n", 4, "x_m is 'two'"),
        (GOOD.encode() + b"2,,2,2\n", 4, "x_m is ''"),
        (GOOD.encode() + b"2,0_52,2,2\n", 4, "x_m is '0_52', expected a number, e.g. 0.52"),
        (GOOD.encode() + b"2,0x1,2,2\n", 4, "x_m is '0x1'"),
        (GOOD.encode() + b"2,1e999,2,2\n", 4, "x_m is 1e999, expected a finite number"),
        (GOOD.encode() + "2,１,2,2\n".encode(), 4, "x_m is '１'"),
        (GOOD.encode() + b"2,2,infinity,2\n", 4, "y_m is infinity, expected a finite number"),
        (GOOD.encode() + b"1_0,2,2,2\n", 4, "time_s is '1_0'"),
        (b"time_s;x_m;y_m\n0;0;0\n1;1.000,5;0\n", 3, "x_m is '1.000,5'"),
        (b"time_s,x_m,y_m\n0,0,0\n0,5,1,0,2,0\n", 3, "decimal commas, which need semicolons"),
        (b"# a\n# b\ntime_s,x_m\n0,0\n", 3, "no column 'y_m'"),
        (GOOD.encode() + b"1,2,2,2\n", 4, "times must rise"),
        (GOOD.encode() + b"0.5,2,2,2\n", 4, "times must rise"),
        (b"time_s,x_m,y_m\n0,0,0\n", None, "one sample only"),
        (b"time_s,x_m,y_m\n", None, "no sample"),
        (GOOD.encode() + b"2,\xff\xfe,2,2\n", 4, "not UTF-8"),
        (b"\x89PNG\r\n\x1a\n\x00\x00", 1, "not UTF-8"),
        (GOOD.encode() + b"2,\x00,2,2\n", 4, "binary"),
        ("time_s,x_m,y_m\n0,½,0\n1,0,0\n".encode(), 2, "x_m is '½'"),
        (b'time_s,x_m,y_m\n0,"0,0\n1,0,0\n', 3, "not a CSV file"),
    ],
)
def test_a_mistake_is_reported_with_file_and_line(
    tmp_path: Path, content: bytes, line: int | None, said: str
) -> None:
    file = tmp_path / "bad.csv"
    file.write_bytes(content)
    with pytest.raises(DemonstrationError) as caught:
        read_csv(file)
    where = f"{file}:{line}: " if line else f"{file}: "
    assert str(caught.value).startswith(where), str(caught.value)
    assert said in str(caught.value)


@given(st.binary(max_size=200))
def test_no_bytes_make_anything_but_a_demonstration_or_its_error(
    tmp_path_factory: pytest.TempPathFactory, content: bytes
) -> None:
    file = tmp_path_factory.mktemp("fuzz") / "x.csv"
    file.write_bytes(content)
    with pytest.raises(DemonstrationError):
        read_csv(file)


@given(st.text(alphabet='0123456789.,-e\n nainf"state_xymz', max_size=80))
def test_no_rows_make_anything_but_finite_rising_samples_or_an_error(
    tmp_path_factory: pytest.TempPathFactory, rows: str
) -> None:
    file = tmp_path_factory.mktemp("fuzz") / "x.csv"
    file.write_text("time_s,x_m,y_m,state\n" + rows)
    try:
        demonstration = read_csv(file)
    except DemonstrationError:
        return
    assert (np.diff(demonstration.time_s) > 0).all()
    assert np.isfinite(demonstration.positions).all()


def test_a_file_that_is_not_there_or_a_folder_is_a_users_mistake(tmp_path: Path) -> None:
    for path in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(UserError, match="cannot be read"):
            read_csv(path)


def test_a_file_that_cannot_be_written_is_a_users_mistake(tmp_path: Path) -> None:
    demonstration = Demonstration("d", np.arange(2.0), np.zeros((2, 3)), (None, None))
    with pytest.raises(DemonstrationError, match="cannot be written"):
        write_csv(tmp_path / "none" / "d.csv", demonstration)
