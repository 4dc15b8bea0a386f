"""A recording is read as far as it goes, wherever it was cut off."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader, breakup_chunk

from hmcs.bus.messages import Motion, Step
from hmcs.recordings import json_codec
from hmcs.recordings.inspection import inspected
from hmcs.recordings.reading import RecordingError, read
from support.recordings import KEYS, Maker, Said

CUTS = 1000


def test_what_was_written_is_read(maker: Maker, performed: Callable[..., list[Said]]) -> None:
    said = performed()
    content = read(maker.write(said, attachments={"m.hmcs": b"model"}))
    assert content.whole
    assert content.damage == ""
    assert content.metadata["hmcs"] == {"version": "1.2.3"}
    assert content.attachments == {"m.hmcs": b"model"}
    assert [message.key for message in content.messages] == [key for key, _ in said]
    steps = [body for _, body in said if isinstance(body, Step)]
    for (_, envelope, read_back), step in zip(content.of(Step), steps, strict=True):
        assert envelope.source.service == "input_device"
        np.testing.assert_array_equal(read_back.displacement, step.displacement)


def whole_chunks(data: bytes, cut: int) -> int:
    """How many messages of the contract are in chunks that end before the cut."""
    count = 0
    stream = io.BytesIO(data)
    reader = StreamReader(stream, emit_chunks=True)
    topics: dict[int, str] = {}
    for record in reader.records:
        if stream.tell() > cut:
            break
        if isinstance(record, Chunk):
            for part in breakup_chunk(record):
                if type(part).__name__ == "Channel":
                    topics[part.id] = part.topic
                elif type(part).__name__ == "Message":
                    count += topics[part.channel_id].startswith("hmcs/")
    return count


@pytest.mark.long
def test_a_recording_cut_at_any_byte_opens_and_gives_all_its_whole_chunks(
    maker: Maker, performed: Callable[..., list[Said]], tmp_path: Path
) -> None:
    data = maker.write(performed(samples=120), flush_every=25).read_bytes()
    cut_off = tmp_path / "cut.mcap"
    random = np.random.default_rng(7)
    for cut in random.integers(0, len(data), CUTS).tolist():
        cut_off.write_bytes(data[:cut])
        content = read(cut_off)
        assert len(content.messages) >= whole_chunks(data, cut), cut
        if not content.whole:
            assert any("cut off" in problem for problem in inspected(content).problems)


def test_it_opens_in_the_fields_own_reader_with_poses_in_its_own_schemas(
    maker: Maker, performed: Callable[..., list[Said]]
) -> None:
    with maker.write(performed()).open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert {channel.message_encoding for channel in summary.channels.values()} == {"json"}
    names = {schema.name for schema in summary.schemas.values()}
    assert {"foxglove.PoseInFrame", "hmcs.motion/1", "hmcs.step/1"} <= names
    assert {schema.encoding for schema in summary.schemas.values()} == {"jsonschema"}


def test_what_is_no_recording_is_reported(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="cannot be read"):
        read(tmp_path / "none.mcap")
    (tmp_path / "text.mcap").write_text("time_s,x_m\n0,1\n")
    with pytest.raises(RecordingError, match="does not begin as an MCAP file"):
        read(tmp_path / "text.mcap")


def test_a_recording_of_another_version_of_the_contract_is_reported(
    maker: Maker, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = maker.write(
        [(KEYS.motion, Motion(position=[0, 0, 0], velocity=[0, 0, 0], dead_man=True))]
    )
    content = read(path)
    monkeypatch.setattr(Motion, "VERSION", 9)
    monkeypatch.delitem(json_codec.BY_SCHEMA, "motion/1")
    with pytest.raises(RecordingError, match=r"has motion/1, expected motion/9.*version 1\.2\.3"):
        list(content.of(Motion))


def test_a_bit_that_was_turned_makes_no_message_that_was_never_sent(
    maker: Maker, performed: Callable[..., list[Said]], tmp_path: Path
) -> None:
    path = maker.write(performed(samples=120), flush_every=50)
    data, sent = path.read_bytes(), {message.text for message in read(path).messages}
    damaged, losses = tmp_path / "damaged.mcap", 0
    for at in np.random.default_rng(3).integers(8, len(data), 200).tolist():
        turned = bytearray(data)
        turned[at] ^= 0x10
        damaged.write_bytes(turned)
        content = read(damaged)
        assert {message.text for message in content.messages} <= sent
        losses += len(content.messages) < len(sent)
    assert losses > 20
