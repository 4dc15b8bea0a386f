"""Files of labels as people write them, and whose labels they are."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.errors import UserError
from hmcs.recordings.fingerprints import Fingerprint
from hmcs.recordings.label_files import has_fingerprint, labels_text, read_labels
from hmcs.recordings.labels import (
    how_labeled,
    label_notes,
    labels_beside,
    labels_of,
    write_labels,
)
from hmcs.recordings.reading import RecordingError, read
from hmcs.recordings.stretches import Stretch
from support.mcap_files import chunks_of, rewritten, with_bytes
from support.recordings import BEGUN_NS, ROOMY, Maker, Said, hand_of

Performed = Callable[..., list[Said]]
HEAD = "begin_s,end_s,state\n"


@pytest.fixture
def take(maker: Maker, performed: Performed) -> Path:
    """A recording of 2.4 s."""
    return maker.write(performed(("go", "turn"), 100))


def states(path: Path) -> list[str]:
    return [label.state for label in labels_of(read(path))]


# --- what people write ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (HEAD + "0,1e300,go\n", ":2: expected begin_s below end_s"),
        (HEAD + "0,1e400,go\n", ":2: expected begin_s,end_s,state, not"),
        (HEAD + '0,2,"go\n' + "2,4,turn\n" * 30_000, "not a CSV file: .* each quote is closed"),
        (HEAD + '0,2,"go\n', "not a CSV file"),
        (HEAD + '0,2,go"\n"x\n', "not a CSV file|expected"),
        (HEAD + '0,1,"two\nlines"\n', ":3: expected begin_s below end_s, and a state"),
        (HEAD + "0,1,\x1b[31mgo\n", ":2: expected begin_s below end_s, and a state"),
        (HEAD + "0,1_0,go\n", ":2: expected begin_s,end_s,state, not"),
        (HEAD + "0,１,go\n", ":2: expected begin_s,end_s,state, not"),
        (HEAD + "0,nan,go\n", ":2: expected begin_s,end_s,state, not"),
        (HEAD + "0x0,0x1,go\n", ":2: expected begin_s,end_s,state, not"),
        (HEAD + "0,5,1,5,go\n", ":2: expected begin_s,end_s,state, not"),
        (HEAD + "0,1\n", ":2: expected begin_s,end_s,state, not"),
        (HEAD + "0\n", ":2: expected"),
        (HEAD + "-1,1,go\n", "outside of the recording, which lasts 2.4"),
        (HEAD + "0,100,go\n", ":2: label 'go' from 0.000 s to 100.000 s is outside"),
        (HEAD + "0,1,go\n2.5,2.6,turn\n", ":3: label 'turn' from 2.500 s to 2.600 s is outside"),
        (HEAD + "0,1,\0\n", ":2: binary data"),
        ("begin_s;end_s;state\n0;1;go\n", ":1: expected the header .* instead of semicolons"),
        ("begin_s\tend_s\tstate\n0\t1\tgo\n", "instead of tabs"),
        ("", ":1: expected the header"),
        ("\n\n\n", ":1: expected the header"),
        ("x" * 200_000, ":1: expected the header|not a CSV"),
        ("0,1,go\n", ":1: expected the header"),
    ],
)
def test_what_is_no_file_of_labels_is_reported_with_its_line(
    take: Path, text: str, says: str
) -> None:
    labels_beside(take).write_text(text, encoding="utf-8", newline="")
    with pytest.raises(RecordingError, match=f"take.labels.csv.*({says})"):
        labels_of(read(take))


@pytest.mark.parametrize("encoding", ["utf-16", "latin-1"])
def test_a_file_in_another_encoding_is_reported(take: Path, encoding: str) -> None:
    labels_beside(take).write_bytes((HEAD + "0,1,gö\n").encode(encoding))
    with pytest.raises(RecordingError, match="not UTF-8 text: save it as CSV in UTF-8"):
        labels_of(read(take))


@pytest.mark.parametrize(
    "text",
    [
        "\ufeff" + HEAD + "0,1,go\n",
        HEAD.upper() + "0,1,go\n",
        "begin_s , end_s , state\r\n 0 , 1 , go \r\n\r\n",
        '"begin_s","end_s","state"\n"0","1","go"\n',
        HEAD + "# said by Ann\n0,1,go\n,,\n",
        HEAD + "+0,1e0,go",
    ],
)
def test_what_programs_make_of_a_file_of_labels_is_read(take: Path, text: str) -> None:
    labels_beside(take).write_text(text, encoding="utf-8", newline="")
    (label,) = labels_of(read(take))
    assert label == Stretch(BEGUN_NS, BEGUN_NS + 10**9, "go")
    assert label_notes(read(take)) == ()


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=400) | st.text(max_size=200).map(lambda text: (HEAD + text).encode()))
def test_whatever_stands_there_is_labels_or_a_mistake_of_the_user(
    tmp_path_factory: pytest.TempPathFactory, data: bytes
) -> None:
    file = tmp_path_factory.mktemp("labels") / "any.labels.csv"
    file.write_bytes(data)
    with suppress(UserError):
        read_labels(file, BEGUN_NS)


@pytest.mark.parametrize(
    ("rows", "unit"),
    [
        ("0,1000,go\n1000,2000,turn\n", "milliseconds: divide them by 1000"),
        ("0,2000,go\n", "milliseconds: divide them by 1000"),
        ("0,1000000,go\n1000000,2000000,turn\n", "microseconds: divide them by 1000000"),
        ("0,2000000000,go\n", "seconds since 1970"),
        ("1790000000,1790000001.5,go\n", "seconds since 1970: write seconds since the recording"),
        ("1790000000000,1790000001500,go\n", "milliseconds since 1970"),
        ("1790000000000000000,1790000001500000000,go\n", "nanoseconds since 1970"),
    ],
)
def test_times_in_another_unit_are_reported_as_such(take: Path, rows: str, unit: str) -> None:
    labels_beside(take).write_text(HEAD + rows)
    with pytest.raises(RecordingError, match=f"lasts 2.4.* read like {unit}"):
        labels_of(read(take))


def test_a_label_that_ends_a_little_late_counts_and_is_reported(take: Path) -> None:
    labels_beside(take).write_text(HEAD + "0,1,go\n1,2.9,turn\n")
    assert states(take) == ["go", "turn"]
    (note,) = label_notes(read(take))
    assert "take.labels.csv:3: label 'turn' from 1.000 s to 2.900 s ends after" in note


def test_labels_of_what_is_missing_in_a_recording_that_was_cut_off_count_on(take: Path) -> None:
    write_labels(read(take), [Stretch(BEGUN_NS, BEGUN_NS + 2 * 10**9, "go")])
    labels = labels_beside(take)
    labels.write_text("".join(labels.read_text().splitlines(keepends=True)[:-1]))
    take.write_bytes(take.read_bytes()[: chunks_of(take)[0][1]])
    assert states(take) == ["go"]


# --- whose labels they are ------------------------------------------------------------------------


def test_labels_are_written_with_the_fingerprint_of_their_recording(take: Path) -> None:
    assert write_labels(read(take), [Stretch(BEGUN_NS, BEGUN_NS + 10**9, "go")]) is None
    assert has_fingerprint(labels_beside(take))
    assert (states(take), how_labeled(read(take))) == (["go"], "set afterwards")
    assert label_notes(read(take)) == ()


@pytest.mark.parametrize(
    "again",
    [("turn", "go"), ("go", "turn", "go"), ("go",), (None,)],
    ids=["other labels", "longer", "shorter", "without labels"],
)
def test_labels_of_a_deleted_recording_do_not_count_for_a_new_one_of_its_name(
    maker: Maker, take: Path, performed: Performed, again: tuple[str | None, ...]
) -> None:
    write_labels(read(take), [Stretch(BEGUN_NS, BEGUN_NS + 10**9, "old")])
    take.unlink()
    new = maker.write(performed(again, 100), flush_every=20)
    assert states(new) == [label for label in again if label]
    assert how_labeled(read(new)) == "said meanwhile"
    (note,) = label_notes(read(new))
    assert "take.labels.csv are of another recording that had this name: they do not count" in note


def test_a_recording_that_begins_as_another_did_and_goes_on_otherwise_is_another(
    maker: Maker, performed: Performed
) -> None:
    path = maker.write(performed(("go", "turn"), 100), flush_every=20)
    write_labels(read(path), [Stretch(BEGUN_NS, BEGUN_NS + 10**9, "old")])
    path.unlink()
    maker.write(performed(("go", "go"), 100), flush_every=20)
    assert "old" not in states(path)


def test_labels_set_while_it_is_recorded_count_when_it_is_whole(
    maker: Maker, performed: Performed
) -> None:
    said = performed(("go", "turn"), 100)
    recording = maker.begin()
    for number, (key, body) in enumerate(said):
        recording.write(key, maker.fields(body, number), BEGUN_NS + number * 10**7, None)
        if number == 80:
            recording.flush()
            write_labels(read(recording.path), [Stretch(BEGUN_NS, BEGUN_NS + 10**8, "early")])
    recording.finish()
    assert states(recording.path) == ["early"]


def test_labels_count_on_though_their_recording_is_damaged_or_moved(
    take: Path, tmp_path: Path
) -> None:
    write_labels(read(take), [Stretch(BEGUN_NS, BEGUN_NS + 10**9, "go")])
    _, end = chunks_of(take)[0]
    moved = with_bytes(take, tmp_path / "moved.mcap", end - 9, b"\0", 1)
    labels_beside(take).rename(labels_beside(moved))
    assert read(moved).damage
    assert states(moved) == ["go"]


@pytest.mark.parametrize("how", [{"chunked": False}, {"checksums": False, "chunk_bytes": 10**9}])
def test_labels_of_files_without_chunks_or_checksums_know_their_recording(
    take: Path, tmp_path: Path, maker: Maker, performed: Performed, how: dict[str, Any]
) -> None:
    other = rewritten(take, tmp_path / "other.mcap", **how)
    write_labels(read(other), [Stretch(BEGUN_NS, BEGUN_NS + 10**9, "old")])
    assert states(other) == ["old"]
    take.unlink()
    # As long, at the same times.
    rewritten(maker.write(performed(("gO", "turn"), 100)), other, **how)
    assert states(other) == ["gO", "turn"]


def test_labels_that_were_taken_from_an_empty_recording_are_of_no_other(
    maker: Maker, performed: Performed
) -> None:
    path = maker.write([])
    write_labels(read(path), [])
    assert how_labeled(read(path)) == "set afterwards"
    path.unlink()
    maker.write(performed(("go",), 50))
    assert states(path) == ["go"]


def test_a_file_without_a_fingerprint_counts_as_it_is(take: Path) -> None:
    labels_beside(take).write_text(HEAD + "0,1,old\n")
    assert (states(take), label_notes(read(take))) == (["old"], ())
    assert not has_fingerprint(labels_beside(take))


def test_labels_of_another_recording_are_moved_aside_and_not_lost(
    maker: Maker, take: Path, performed: Performed
) -> None:
    write_labels(read(take), [Stretch(BEGUN_NS, BEGUN_NS + 10**9, "old")])
    old = labels_beside(take).read_text()
    take.unlink()
    maker.write(performed(("turn",), 50))
    aside = write_labels(read(take), [Stretch(BEGUN_NS, BEGUN_NS + 10**8, "new")])
    assert aside is not None
    assert aside.read_text() == old
    assert states(take) == ["new"]
    assert write_labels(read(take), []) is None


def test_where_labels_cannot_be_written_it_is_reported(take: Path) -> None:
    labels_beside(take).mkdir()
    with pytest.raises(RecordingError, match=r"take\.labels\.csv: cannot be written"):
        write_labels(read(take), [])
    assert [file.name for file in take.parent.iterdir() if file.name.startswith(".")] == []


def test_a_file_that_cannot_be_read_is_reported(
    take: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    labels_beside(take).write_text(HEAD)

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    content = read(take)
    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(RecordingError, match=r"labels\.csv: cannot be read: Permission denied"):
        labels_of(content)


def test_a_pipe_is_no_file_of_labels(take: Path) -> None:
    os.mkfifo(labels_beside(take))
    assert states(take) == ["go", "turn"]


@given(st.lists(st.integers(0, 10**16), min_size=2, max_size=12, unique=True))
def test_times_are_written_to_the_nanosecond(times: list[int]) -> None:
    ordered = sorted(times)
    stretches = [
        Stretch(begin, end, f"s{k}")
        for k, (begin, end) in enumerate(zip(ordered[::2], ordered[1::2], strict=False))
    ]
    text = labels_text(stretches, 0, Fingerprint(3, "0" * 16))
    for line, stretch in zip(text.splitlines()[1:], stretches, strict=False):
        whole, _, rest = line.partition(",")[0].partition(".")
        assert int(whole) * 10**9 + int(rest.ljust(9, "0") or 0) == stretch.begin_ns


def test_labels_said_meanwhile_are_found_however_many_steps_there_are(
    maker: Maker, performed: Performed
) -> None:
    path = maker.write(performed(("go", "turn"), 400))
    assert states(path) == ["go", "turn"]
    parts = maker.write(list(hand_of(("go", None, "turn"), 50)), "parts", ROOMY)
    assert states(parts) == ["go", "turn"]
