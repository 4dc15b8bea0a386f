"""A damaged recording is read around the damage, and what is missing is reported with times."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.records import Message
from mcap.writer import CompressionType

from hmcs.recordings.inspection import inspected
from hmcs.recordings.reading import RecordingContent, read
from support.mcap_files import chunks_of, rewritten, with_bytes
from support.recordings import BEGUN_NS, Maker, Said

Performed = Callable[..., list[Said]]
FORMS = {
    "as HMCS writes it": {},
    "lz4": {"compression": CompressionType.LZ4},
    "not packed": {"compression": CompressionType.NONE},
    "without an index": {"indexed": False},
    "without chunks": {"chunked": False},
}


@pytest.fixture
def take(maker: Maker, performed: Performed) -> Path:
    return maker.write(performed(("go", "turn"), 120), flush_every=25)


@pytest.fixture(params=list(FORMS))
def form(request: pytest.FixtureRequest, take: Path, tmp_path: Path) -> Path:
    """The same recording in the ways the field writes it."""
    how = FORMS[request.param]
    return rewritten(take, tmp_path / "form.mcap", **how) if how else take


def texts(content: RecordingContent) -> Counter[bytes]:
    return Counter(message.text for message in content.messages)


def heard(content: RecordingContent) -> str:
    return "\n".join(inspected(content).problems)


def test_every_form_of_the_field_is_read_whole(form: Path, take: Path) -> None:
    content = read(form)
    assert texts(content) == texts(read(take))
    assert (content.whole, content.damage, content.lost) == (True, "", 0)
    assert content.duration_s == read(take).duration_s


def test_a_bit_turned_anywhere_loses_one_chunk_at_most_and_that_is_reported(
    form: Path, tmp_path: Path
) -> None:
    data, sent = form.read_bytes(), texts(read(form))
    most = max((end - at for at, end in chunks_of(form)), default=0) and sent.total() // 3
    losses = 0
    random = np.random.default_rng(5)
    for at, bit in zip(
        random.integers(8, len(data), 60).tolist(), random.integers(0, 8, 60), strict=True
    ):
        damaged = with_bytes(form, tmp_path / "bad.mcap", at, bytes([data[at] ^ 1 << int(bit)]), 1)
        content = read(damaged)
        found = texts(content)
        assert found.total() == len(content.messages)
        lost = (sent - found).total()
        assert lost <= max(most, 3), at
        if lost and chunks_of(form):
            assert found <= sent
            assert content.gaps or not content.whole or content.passed_over, at
            losses += 1
    assert losses > 8 or not chunks_of(form)


@pytest.mark.parametrize("changed", [b"\0" * 700, b"", b"\xff" * 50], ids=["zeros", "gone", "more"])
def test_a_block_of_the_disk_that_was_lost_is_read_around(
    form: Path, tmp_path: Path, changed: bytes
) -> None:
    """Its place is full of zeros, or empty, or something else stands there besides."""
    sent, last_ns = texts(read(form)), read(form).last_ns
    instead_of = 0 if changed.startswith(b"\xff") else 700
    chunks = chunks_of(form)
    # The last chunk is left as it is.
    end = chunks[-1][0] - 700 if chunks else form.stat().st_size // 2
    for at in np.linspace(100, end, 10).astype(int).tolist():
        content = read(with_bytes(form, tmp_path / "bad.mcap", at, changed, instead_of))
        found = texts(content)
        assert (sent - found).total() <= sent.total() // 2, at
        assert content.last_ns == last_ns, at


def test_what_is_missing_is_reported_with_its_times(take: Path, tmp_path: Path) -> None:
    begin, end = chunks_of(take)[4]
    bad = with_bytes(take, tmp_path / "bad.mcap", (begin + end) // 2, b"\0" * 8, 8)
    content, whole = read(bad), read(take)
    missing = texts(whole) - texts(content)
    times = [m.log_ns for m in whole.messages if m.text in missing]
    (gap,) = content.gaps
    assert (gap.begin_ns, gap.end_ns) == (min(times), max(times))
    assert content.lost == missing.total()
    found = re.search(r"between (\d+\.\d+) s and (\d+\.\d+) s something is missing", heard(content))
    assert found is not None
    assert [round(float(t) * 1e9) + BEGUN_NS for t in found.groups()] == [min(times), max(times)]
    assert "last moments" not in heard(content)


def test_the_beginning_stays_the_beginning_though_its_chunk_is_damaged(
    take: Path, tmp_path: Path
) -> None:
    begin, end = chunks_of(take)[0]
    bad = with_bytes(take, tmp_path / "bad.mcap", (begin + end) // 2, b"\0" * 8, 8)
    assert read(bad).first_ns == read(take).first_ns == BEGUN_NS


@pytest.mark.parametrize("bytes_off", [0, 20], ids=["at a record", "within one"])
def test_one_cut_off_whose_first_chunk_is_damaged_gives_all_other_chunks(
    take: Path, tmp_path: Path, bytes_off: int
) -> None:
    """Descriptions of the channels were in that chunk, and an index was never written."""
    chunks = chunks_of(take)
    begin, end = chunks[0]
    bad = with_bytes(take, tmp_path / "bad.mcap", (begin + end) // 2, b"\0" * 8, 8)
    bad.write_bytes(bad.read_bytes()[: chunks[-1][0] + bytes_off])
    content = read(bad)
    assert not content.whole
    sent = len(read(take).messages)
    assert len(content.messages) == sent - 25 - sent % 25
    assert {m.key for m in content.messages} == {m.key for m in read(take).messages}


def test_channels_that_nothing_describes_any_more_are_known_by_what_their_messages_say(
    take: Path, tmp_path: Path
) -> None:
    plain = rewritten(take, tmp_path / "plain.mcap", indexed=False)
    begin, end = chunks_of(plain)[0]
    content = read(with_bytes(plain, tmp_path / "bad.mcap", (begin + end) // 2, b"\0" * 8, 8))
    assert content.schemas.keys() == read(take).schemas.keys()
    assert {message.key.partition("/")[0] for message in content.messages} == {"unknown"}


def test_messages_of_which_nothing_is_known_are_reported(take: Path, tmp_path: Path) -> None:
    other = rewritten(take, tmp_path / "plain.mcap", indexed=False, order=without_schema)
    begin, end = chunks_of(other)[0]
    bad = with_bytes(other, tmp_path / "bad.mcap", (begin + end) // 2, b"\0" * 8, 8)
    assert re.search(r"[1-9]\d* messages of channels that nothing describes", heard(read(bad)))


def without_schema(rows: list[Message]) -> Iterator[Message]:
    for row in rows:
        yield replace(row, data=b"{}")


def test_an_end_that_is_damaged_loses_nothing(take: Path, tmp_path: Path) -> None:
    data, sent = take.read_bytes(), texts(read(take))
    for at in range(chunks_of(take)[-1][1] + 200, len(data) - 8, 97):
        bad = with_bytes(take, tmp_path / "bad.mcap", at, bytes([data[at] ^ 0xFF]), 1)
        assert texts(read(bad)) == sent, at


def test_a_beginning_that_is_damaged_loses_nothing_of_a_file_that_was_ended(
    take: Path, tmp_path: Path
) -> None:
    bad = with_bytes(take, tmp_path / "bad.mcap", 0, b"\0" * 8, 8)
    assert texts(read(bad)) == texts(read(take))


def test_a_chunk_that_is_gone_as_if_it_had_never_been_is_reported(
    take: Path, tmp_path: Path
) -> None:
    begin, end = chunks_of(take)[4]
    content = read(with_bytes(take, tmp_path / "bad.mcap", begin, b"", end - begin))
    assert len(content.messages) == len(read(take).messages) - 25
    assert "its index is damaged" in heard(content)
    # One whose opcode became one that may be passed over.
    content = read(with_bytes(take, tmp_path / "bad.mcap", begin, b"\x90", 1))
    assert content.lost == 25
    assert "a record of a kind that is unknown here (144)" in heard(content)
