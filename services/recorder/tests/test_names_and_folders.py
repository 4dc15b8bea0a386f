"""Names of recordings, their parts, and whatever becomes of their folder."""

from __future__ import annotations

import shutil
from datetime import UTC, datetime
from pathlib import Path

import pytest

from hmcs.bus.messages import Motion, Record
from hmcs.bus.session import RequestRefusedError
from hmcs.errors import UserError
from hmcs.recordings import labels
from hmcs.recordings.reading import read
from hmcs_recorder import service
from support.recorder import Bench, denied
from support.stack import Stack


def test_a_part_whose_name_is_taken_goes_on_under_the_next_one(
    stack: Stack, tmp_path: Path
) -> None:
    folder = tmp_path / "recordings"
    folder.mkdir()
    (folder / "take-002.mcap").write_bytes(b"an earlier recording")
    (folder / "take-003.mcap").symlink_to("nowhere")
    bench = Bench(stack, folder, autostart=False, part_s=0.05)
    bench.service._asked(Record(on=True, name="take"))
    sent = 0
    while not (folder / "take-005.mcap").exists():
        bench.sample(5)
        sent += 5
    assert bench.service.health()[0]
    assert bench.service.facts()["recording"].endswith(".mcap")
    bench.service.close()
    assert (folder / "take-002.mcap").read_bytes() == b"an earlier recording"
    parts = [
        file
        for file in folder.glob("take*.mcap")
        if file.name[4:] not in ("-002.mcap", "-003.mcap")
    ]
    assert sum(len(list(read(part).of(Motion))) for part in parts) == sent


def test_a_name_that_is_taken_is_refused_and_nothing_begins_later(
    stack: Stack, tmp_path: Path
) -> None:
    bench = Bench(stack, tmp_path / "recordings", autostart=False)
    bench.service._asked(Record(on=True, name="take"))
    bench.service._asked(Record(on=False))
    with pytest.raises(UserError, match="there is a recording already: choose another name"):
        bench.service._asked(Record(on=True, name="take"))
    bench.service._again_s = 0.0
    bench.service._on_flush()
    assert "waiting" in bench.service.health()[1]
    assert [file.name for file in bench.folder.iterdir()] == ["take.mcap"]


def test_a_recorder_that_begins_by_itself_takes_the_next_free_name(
    stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(service, "_now", lambda: datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC))
    benches = [Bench(stack, tmp_path / "recordings") for _ in range(2)]
    assert sorted(file.name for file in benches[0].folder.iterdir()) == [
        "20260102-030405-002.mcap",
        "20260102-030405.mcap",
    ]
    for bench in benches:
        bench.service.close()


def test_a_request_that_fails_is_refused_and_not_carried_out_later(
    stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(stack, tmp_path / "recordings", autostart=False)
    with monkeypatch.context() as patch:
        patch.setattr(Path, "mkdir", denied)
        with pytest.raises(RequestRefusedError, match="Permission denied"):
            bench.service._asked(Record(on=True, name="take"))
    assert bench.service.health() == (True, "waiting for a request to record")
    bench.service._again_s = 0.0
    bench.service._on_flush()
    bench.sample_unrecorded()
    assert bench.bus.counters.lost["recording"] == 0
    assert not bench.folder.exists()


@pytest.mark.parametrize("how", ["folder", "file", "other file", "denied"])
def test_recording_goes_on_whatever_becomes_of_its_folder(
    stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, how: str
) -> None:
    bench = Bench(stack, tmp_path / "recordings")
    (bench.folder / "other.mcap").write_bytes(b"x")
    bench.sample(5)
    if how == "folder":
        shutil.rmtree(bench.folder)
    elif how == "file":
        Path(bench.service.facts()["recording"]).unlink()
    elif how == "other file":
        # It vanishes just as the files are counted.
        (bench.folder / "gone-1.mcap").symlink_to("nowhere")
    else:
        with monkeypatch.context() as patch:
            patch.setattr(shutil, "disk_usage", denied)
            stack.until(lambda: not bench.service.health()[0])
            assert "Permission denied" in bench.service.health()[1]
    stack.until(lambda: Path(bench.service.facts()["recording"] or "-").exists() or _due(bench))
    bench.sample(4)
    bench.service.close()
    files = [file for file in bench.folder.glob("*-*.mcap") if file.exists()]
    assert sum(len(list(read(file).of(Motion))) for file in files) >= 4


def _due(bench: Bench) -> bool:
    bench.service._again_s = 0.0
    return False


@pytest.mark.long
def test_labels_that_lie_where_a_recording_begins_are_reported(
    stack: Stack, tmp_path: Path
) -> None:
    bench = Bench(stack, tmp_path / "recordings", autostart=False)
    said = bench.service._asked(Record(on=True, name="take")).detail
    assert said == f"recording to {bench.folder / 'take.mcap'}"
    bench.sample(3)
    bench.service._asked(Record(on=False))
    labels.write_labels(read(bench.folder / "take.mcap"), [])
    (bench.folder / "take.mcap").unlink()
    said = bench.service._asked(Record(on=True, name="take")).detail
    assert "take.labels.csv are of an earlier one and do not count for it" in said
    bench.service._asked(Record(on=False))
    (bench.folder / "take.mcap").unlink()
    (bench.folder / "take.labels.csv").write_text("begin_s,end_s,state\n")
    said = bench.service._asked(Record(on=True, name="take")).detail
    assert "do not say of which recording they are and will count for it" in said
    bench.service.close()
