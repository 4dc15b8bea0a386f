"""Files made to do harm: none is believed, none takes memory or time without bounds."""

from __future__ import annotations

import json
import os
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import lz4.frame
import pytest
import zstandard
from mcap.writer import Writer

from hmcs.recordings import in_order, labels, mcap_channels, reading, replaying, scan
from hmcs.recordings.demonstrations import demonstrations_of
from hmcs.recordings.exporting import export
from hmcs.recordings.inspection import inspected
from hmcs.recordings.mcap_records import MAGIC
from hmcs.recordings.outlining import outlined
from hmcs.recordings.reading import RecordingError, read
from support.mcap_files import chunks_of, rewritten, with_bytes
from support.peak_memory import grown_mb
from support.recordings import BEGUN_NS, Maker, Said

HEADER = struct.pack("<BQ", 1, 8) + bytes(8)


def record(opcode: int, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


def text(word: str) -> bytes:
    return struct.pack("<I", len(word.encode())) + word.encode()


def chunk(packed: bytes, size: int, compression: str, crc: int = 0) -> bytes:
    head = struct.pack("<QQQI", BEGUN_NS, BEGUN_NS + 1, size, crc) + text(compression)
    return record(6, head + struct.pack("<Q", len(packed)) + packed)


def file_of(path: Path, *records: bytes) -> Path:
    path.write_bytes(MAGIC + HEADER + b"".join(records))
    return path


def used(path: Path) -> None:
    """Do with a file whatever is done with recordings."""
    content = read(path)
    outlined(content)
    inspected(content)
    labels.labels_of(content)
    demonstrations_of(content)
    export(content, path.parent / "tables", "npz")


@pytest.fixture
def take(maker: Maker, performed: Callable[..., list[Said]]) -> Path:
    return maker.write(performed(("go",), 60), flush_every=25, attachments={"m.hmcs": b"model"})


# --- sizes that lie -------------------------------------------------------------------------------

ZEROS = bytes(60 * 1024 * 1024)
BOMB = zstandard.compress(ZEROS)


@pytest.mark.long
@pytest.mark.parametrize(
    ("made", "says"),
    [
        (lambda: chunk(BOMB, 2**40, "zstd"), "more than 67 MB"),
        (lambda: chunk(BOMB, 1000, "zstd"), "checksum is another"),
        (lambda: chunk(b"", 2**63, ""), "more than 67 MB"),
        (lambda: chunk(lz4.frame.compress(ZEROS), 1000, "lz4"), "checksum is another"),
        (lambda: chunk(b"x" * 99, 99, "zstd"), "a damaged chunk"),
        (lambda: chunk(b"x" * 99, 99, "lz4"), "a damaged chunk"),
        (lambda: chunk(b"x" * 99, 99, "brotli"), "packed by 'brotli', which nobody here can"),
        (lambda: chunk(_far_window(), 10, "zstd"), "a damaged chunk"),
        (lambda: chunk(BOMB, len(ZEROS), "zstd") * 40, "more than 200 times what the file has"),
        (lambda: chunk(b"\5" + b"\xff" * 8, 9, ""), "a chunk that ends within a record"),
        (lambda: chunk(struct.pack("<BQ", 5, 3) + b"abc", 12, ""), "a message without its times"),
        (lambda: record(9, bytes(16) + text("n" * 9999) + text("") + bytes(12)), "9999 bytes"),
        (lambda: record(12, text("n") + text("")), "it was cut off"),
        (lambda: record(3, bytes([1, 0, 2, 0, 0, 0, 0xFF, 0xFE]) + bytes(8)), "a damaged descript"),
        (lambda: b"\x06" + b"\xff" * 200, "cut off"),
        (lambda: b"\x0c" + struct.pack("<Q", 2**62) + bytes(100), "cut off"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_is_no_part_of_a_recording_is_reported(
    tmp_path: Path, made: Callable[[], bytes], says: str
) -> None:
    path = file_of(tmp_path / "made.mcap", made())
    assert says in "\n".join(inspected(read(path)).problems)
    used(path)


def _far_window() -> bytes:
    """A frame that asks for two gigabytes to look back on."""
    parameters = zstandard.ZstdCompressionParameters(window_log=31)
    packer = zstandard.ZstdCompressor(compression_params=parameters)
    with_size = packer.compressobj(size=-1)
    return with_size.compress(b"0123456789") + with_size.flush()


@pytest.mark.long
def test_bombs_take_little_memory_and_an_end(tmp_path: Path) -> None:
    path = file_of(tmp_path / "bombs.mcap", chunk(BOMB, len(ZEROS), "zstd") * 200)
    grown = grown_mb("from hmcs.recordings.reading import read", "read(sys.argv[1])", path)
    assert grown < 150


def test_chunks_that_lie_about_their_size_cost_no_other(take: Path, tmp_path: Path) -> None:
    liar = chunk(zstandard.compress(bytes(1000)), 60 * 1024 * 1024, "zstd")
    data, at = take.read_bytes(), chunks_of(take)[0][0]
    path = tmp_path / "lies.mcap"
    path.write_bytes(data[:at] + liar * 5 + data[at:])
    assert len(read(path).messages) == len(read(take).messages)


def test_a_sender_of_many_words_is_cut_short(tmp_path: Path) -> None:
    words = record(12, text("n" * 1000) + text("")[:4])
    path = file_of(tmp_path / "words.mcap", words * 30_000)
    content = read(path)
    assert sum(map(len, content.metadata)) < mcap_channels.LARGEST_TEXT_BYTES


# --- files that are none --------------------------------------------------------------------------


def test_what_is_no_file_is_refused_at_once(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.mcap"
    os.mkfifo(pipe)
    for path in (pipe, tmp_path, Path("/dev/zero")):
        with pytest.raises(RecordingError, match=r"is no file|cannot be read"):
            read(path)


@pytest.mark.parametrize("size", [0, 1, 7, 8, 9, 17, 20])
def test_a_file_that_just_begins_is_one_that_was_cut_off(tmp_path: Path, size: int) -> None:
    path = file_of(tmp_path / "begun.mcap")
    path.write_bytes(path.read_bytes()[:size])
    content = read(path)
    assert (len(content.messages), content.whole, content.duration_s) == (0, False, 0.0)
    used(path)


@pytest.mark.parametrize("error", [MemoryError(), OSError(5, "Input/output error")])
def test_what_the_machine_lacks_is_reported(
    take: Path, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    content = read(take)

    def fail(*_: object) -> Iterator[Any]:
        raise error

    monkeypatch.setattr(reading, "found_in", fail)
    with pytest.raises(RecordingError, match=r"too little memory|Input/output error"):
        list(content.messages)
    monkeypatch.setattr(reading, "scanned", fail)
    with pytest.raises(RecordingError, match=r"too little memory|Input/output error"):
        read(take)


def test_a_file_that_changes_while_it_is_read_is_reported(take: Path, tmp_path: Path) -> None:
    content = read(take)
    begin, end = chunks_of(take)[1]
    take.write_bytes(
        with_bytes(take, tmp_path / "x", (begin + end) // 2, b"\0" * 9, 9).read_bytes()
    )
    with pytest.raises(RecordingError, match="changed while it was read"):
        list(content.messages)


def test_what_is_written_meanwhile_is_not_looked_at(
    maker: Maker, performed: Callable[..., list[Said]]
) -> None:
    said = performed(("go",), 40)
    recording = maker.begin()
    for seq, (key, body) in enumerate(said[:20]):
        recording.write(key, maker.fields(body, seq), BEGUN_NS + seq, None)
    recording.flush()
    content = read(recording.path)
    for seq, (key, body) in enumerate(said[20:], start=20):
        recording.write(key, maker.fields(body, seq), BEGUN_NS + seq, None)
    recording.finish()
    assert len(list(content.messages)) == len(content.messages) == 20


# --- messages that are none -----------------------------------------------------------------------


def with_texts(
    *texts: bytes, encoding: str = "json", log_ns: int = BEGUN_NS
) -> Callable[[Writer], None]:
    def begin(writer: Writer) -> None:
        schema = writer.register_schema("hmcs.motion/1", "jsonschema", b"{}")
        channel = writer.register_channel("hmcs/@v1/test/input/motion", encoding, schema)
        for each in texts:
            writer.add_message(channel, log_ns, each, log_ns)

    return begin


@pytest.mark.parametrize(
    "junk",
    [
        b"{}",
        b"[]",
        b"",
        b"{",
        b"null",
        b"{" * 100_000 + b"}" * 100_000,
        b'{"schema":"motion/1","source":' + b"[" * 50_000 + b"]" * 50_000 + b"}",
        b'{"position":[1,2]}',
        b'{"seq":' + b"9" * 10_000 + b"}",
        b'{"a":NaN,"b":Infinity,"c":1e999}',
        b'{"' + b"k" * 1000 + b'":"\\ud800"}',
        b"{\xff\xfe}",
        b'{"a":"' + b"x" * (scan.LARGEST_MESSAGE_BYTES + 1) + b'"}',
    ],
    ids=lambda junk: repr(junk[:20]),
)
def test_messages_that_are_none_are_passed_over_and_reported(
    take: Path, tmp_path: Path, junk: bytes
) -> None:
    path = rewritten(take, tmp_path / "junk.mcap", begin=with_texts(junk))
    content = read(path)
    assert "1 message on hmcs/@v1/test/input/motion cannot be read" in "\n".join(
        inspected(content).problems
    )
    used(path)
    assert len(demonstrations_of(content)[0].time_s) == 60


def test_messages_in_another_encoding_are_reported(take: Path, tmp_path: Path) -> None:
    path = rewritten(take, tmp_path / "cbor.mcap", begin=with_texts(b"\xa0", encoding="cbor"))
    assert "encoded as 'cbor', not as JSON" in "\n".join(inspected(read(path)).problems)
    used(path)


def test_times_beyond_all_reason_are_passed_over(take: Path, tmp_path: Path) -> None:
    begin = with_texts(json.dumps({"schema": "motion/1"}).encode(), log_ns=2**64 - 1)
    path = rewritten(take, tmp_path / "late.mcap", begin=begin)
    content = read(path)
    assert content.duration_s == read(take).duration_s
    assert "after the year 2262" in "\n".join(inspected(content).problems)
    used(path)


def test_channels_without_a_schema_and_schemas_of_others_are_passed_over(
    take: Path, tmp_path: Path
) -> None:
    def begin(writer: Writer) -> None:
        bare = writer.register_channel("/note", "json", 0)
        other = writer.register_channel("/p", "cdr", writer.register_schema("P", "ros2msg", b"x"))
        for channel in (bare, other):
            writer.add_message(channel, 5, b"{}", 5)

    content = read(rewritten(take, tmp_path / "merged.mcap", begin=begin))
    assert [m.text for m in content.messages] == [m.text for m in read(take).messages]
    assert (content.first_ns, content.damage) == (BEGUN_NS, "")


# --- bounds ---------------------------------------------------------------------------------------


def test_attachments_are_read_when_they_are_asked_for(
    take: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = read(take)
    assert dict(content.attachments) == {"m.hmcs": b"model"}
    data = take.read_bytes()
    bad = with_bytes(take, tmp_path / "bad.mcap", data.index(b"model"), b"MODEL", 5)
    assert list(read(bad).attachments) == ["m.hmcs"]
    with pytest.raises(RecordingError, match=r"'m\.hmcs', which is kept with it, is damaged"):
        read(bad).attachments["m.hmcs"]
    monkeypatch.setattr(reading, "LARGEST_ATTACHMENT_BYTES", 4)
    with pytest.raises(RecordingError, match="more than the"):
        content.attachments["m.hmcs"]
    monkeypatch.undo()


def test_more_overlapping_messages_than_are_held_are_reported(
    take: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mixed = rewritten(take, tmp_path / "mixed.mcap", order=lambda rows: rows[::-1])
    monkeypatch.setattr(in_order, "MOST_OVERLAPPING_BYTES", 100)
    with pytest.raises(RecordingError, match=r"mixed\.mcap: more than .* sort the file"):
        list(read(mixed).messages)


def test_more_labels_than_are_used_are_reported(
    take: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(labels, "MOST_LABELS", 0)
    with pytest.raises(RecordingError, match="more than 0 labels"):
        labels.labels_of(read(take))


def test_more_steps_than_are_replayed_are_reported(
    take: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(replaying, "MOST_STEPS", 3)
    with pytest.raises(RecordingError, match="steps, more than 3: replay a part of it"):
        replaying.replayed(read(take), None)  # type: ignore[arg-type]


def test_more_parts_than_are_noted_are_reported(
    take: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scan, "MOST_BLOCKS", 2)
    content = read(take)
    assert len(content.messages) > len(list(content.messages)) or "more than 2" in content.damage
    assert "more than 2 chunks" in content.damage


def test_a_checksum_is_minded(tmp_path: Path) -> None:
    packed = zstandard.compress(b"\7" + bytes(8))
    good = chunk(packed, 9, "zstd", zlib.crc32(b"\7" + bytes(8)))
    assert read(file_of(tmp_path / "good.mcap", good)).damage == ""
    bad = chunk(packed, 9, "zstd", 1)
    assert "checksum" in read(file_of(tmp_path / "bad.mcap", bad)).damage
