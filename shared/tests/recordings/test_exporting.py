"""Recordings as tables, and what they tell of themselves."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hmcs.bus.examples import ENVELOPE, EXAMPLES
from hmcs.bus.messages import Motion, RobotState
from hmcs.bus.wire import encode
from hmcs.recordings import exporting
from hmcs.recordings.exporting import Format, export
from hmcs.recordings.file_rotation import Preface
from hmcs.recordings.foxglove import FoxgloveConverter
from hmcs.recordings.foxglove_layout import LAYOUT_NAME, foxglove_layout
from hmcs.recordings.inspection import inspected
from hmcs.recordings.json_codec import fields_of
from hmcs.recordings.reading import RecordingError, read
from support.recordings import KEYS, Maker, Said


def test_tables_and_arrays_hold_every_message(
    maker: Maker, performed: Callable[..., list[Said]], tmp_path: Path
) -> None:
    said = performed()
    motions = [body for _, body in said if isinstance(body, Motion)]
    content = read(maker.write(said))
    for form in ("csv", "npz"):
        written = export(content, tmp_path / form, form)  # type: ignore[arg-type]
        assert {file.name for file in written} == {
            f"input_{what}.{form}" for what in ("motion", "step", "label")
        }
    with (tmp_path / "csv" / "input_motion.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row["position_0"]) for row in rows] == [m.position[0] for m in motions]
    with np.load(tmp_path / "npz" / "input_motion.npz", allow_pickle=False) as arrays:
        np.testing.assert_array_equal(arrays["position_1"], [m.position[1] for m in motions])
        np.testing.assert_array_equal(arrays["dead_man"], [m.dead_man for m in motions])
        assert arrays["source_service"][0] == "input_device"


def test_what_is_attached_for_viewers_is_written_beside_the_tables_and_nowhere_else(
    maker: Maker, tmp_path: Path
) -> None:
    recording = maker.begin()
    attached = {"../arm.urdf": b"<robot/>", LAYOUT_NAME: foxglove_layout(), "mine.hmcs": b"model"}
    recording.add(Preface({}, attached), 10**18)
    recording.finish()
    folder = tmp_path / "tables"
    written = export(read(recording.path), folder, "csv")
    assert {file.name for file in written} == {".._arm.urdf", LAYOUT_NAME}
    assert set(written) == set(folder.iterdir())
    assert (folder / ".._arm.urdf").read_bytes() == b"<robot/>"


def test_the_layout_shows_only_topics_that_recordings_have() -> None:
    shown = json.loads(foxglove_layout())
    panels = shown["configById"]
    assert {shown["layout"]["first"], shown["layout"]["second"]} == set(panels)
    (plotted,) = (path["value"] for path in panels[shown["layout"]["second"]]["paths"])
    topics = {*panels[shown["layout"]["first"]]["topics"], plotted.partition(".")[0]}
    robot, motion = (
        fields_of(encode(body, ENVELOPE))
        for body in EXAMPLES
        if isinstance(body, RobotState | Motion)
    )
    converter = FoxgloveConverter()
    told = {each.topic for fields in (robot, motion) for each in converter.of(fields, 10**18)}
    assert topics == told


@pytest.mark.parametrize("form", ["csv", "npz"])
@pytest.mark.parametrize(
    ("keys", "names"),
    [
        (
            ["hmcs/@v1/a/input/motion", "hmcs/@v1/b/input/motion"],
            ["input_motion", "input_motion-2"],
        ),
        (["hmcs/@v1/a/x/y_z", "hmcs/@v1/a/x_y/z"], ["x_y_z", "x_y_z-2"]),
        (["a/b/c/IN", "a/b/c/In", "a/b/c/in"], ["IN", "In-2", "in-3"]),
        (["k", ""], ["k", "unnamed"]),
        (["a/b/c/..", "a/b/c/../../../up"], ["unnamed", "_.._.._up"]),
        (["/etc/passwd", "C:\\x", "a/b/c/d\0e"], ["_etc_passwd", "C__x", "d_e"]),
        (["a/b/c/" + "n" * 300, "a/b/c/" + "n" * 301], ["n" * 100, "n" * 100 + "-2"]),
        (["a/b/c/\x1b[31m", "a/b/c/-rf"], ["__31m", "-rf"]),
    ],
)
def test_a_key_is_never_a_path_and_each_has_a_file_of_its_own(
    maker: Maker,
    performed: Callable[..., list[Said]],
    tmp_path: Path,
    form: Format,
    keys: list[str],
    names: list[str],
) -> None:
    body = performed()[0][1]
    recording = maker.begin()
    for number, key in enumerate(keys):
        recording.write(key, maker.fields(body, number), 10**18, None)
    recording.finish()
    folder = tmp_path / "in" / "tables"
    written = export(read(recording.path), folder, form)
    assert {file.parent for file in written} == {folder}
    assert sorted(file.name for file in written) == sorted(f"{name}.{form}" for name in names)
    assert sorted(folder.iterdir()) == sorted(written)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["in", "recordings"]


def test_arrays_hold_what_tables_hold_however_few_columns_are_held(
    maker: Maker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = maker.begin()
    mixed: list[dict[str, object]] = [
        {"note": "first", "list": [1, 2], "big": 10**400, "none": None},
        {"note": None, "list": [3], "flag": True, "deep": [{"a": [0.5]}]},
        {"list": [], "../x": 7, "note": 5},
    ]
    body = Motion(position=np.zeros(3), velocity=np.zeros(3), dead_man=True)
    for number, more in enumerate(mixed):
        fields = maker.fields(body, number) | more
        recording.write(KEYS.motion, fields, 10**18 + number, None)
    recording.finish()
    content = read(recording.path)
    (whole,) = export(content, tmp_path / "whole", "npz")
    monkeypatch.setattr(exporting, "MOST_HELD_BYTES", 50)
    (parts,) = export(content, tmp_path / "parts", "npz")
    with (
        np.load(whole, allow_pickle=False) as one,
        np.load(parts, allow_pickle=False) as other,
    ):
        assert one.files == other.files
        for name in one.files:
            np.testing.assert_array_equal(one[name], other[name])
        assert one["note"].tolist() == ["first", "", "5"]
        np.testing.assert_array_equal(one["list_0"], [1.0, 3.0, np.nan])
        np.testing.assert_array_equal(one["deep_0_a_0"], [np.nan, 0.5, np.nan])
        assert one["big"].tolist() == [str(10**400), "", ""]
        assert "_x" in one.files


def test_tables_that_would_be_too_large_are_reported_and_nothing_is_left(
    maker: Maker,
    performed: Callable[..., list[Said]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    content = read(maker.write(performed()))
    for bound in ("MOST_COLUMNS", "LARGEST_COLUMN_BYTES"):
        with monkeypatch.context() as patch:
            patch.setattr(exporting, bound, 3)
            with pytest.raises(RecordingError, match=r"more than 3 columns|export it as CSV"):
                export(content, tmp_path / "tables", "npz")
    assert list(tmp_path.glob("tables/*")) == []


def test_more_channels_than_files_are_open_at_once_are_written(
    maker: Maker,
    performed: Callable[..., list[Said]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(exporting, "MOST_FILES", 2)
    body = performed()[0][1]
    recording = maker.begin()
    for number in range(7):
        recording.write(f"a/b/c/k{number}", maker.fields(body, number), 10**18, None)
    recording.finish()
    written = export(read(recording.path), tmp_path / "tables", "csv")
    assert [len(file.read_text().splitlines()) for file in written] == [2] * 7


def test_an_inspection_counts_messages_rates_and_gaps(
    maker: Maker, performed: Callable[..., list[Said]]
) -> None:
    recording = maker.begin()
    body = performed()[0][1]
    for seq in (0, 1, 2, 5, 6):
        recording.write(KEYS.motion, maker.fields(body, seq), 10**18 + seq * 10**9, None)
    recording.finish()
    inspection = inspected(read(recording.path))
    (channel,) = inspection.channels
    assert (channel.messages, channel.lost) == (5, 2)
    assert channel.rate_hz == 4 / 6
    assert channel.longest_gap_s == 3.0
    assert inspection.duration_s == 6.0
    assert any("2 messages are missing" in problem for problem in inspection.problems)
    assert any("no steps" in problem for problem in inspection.problems)
