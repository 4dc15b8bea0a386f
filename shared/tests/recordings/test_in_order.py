"""In which order messages are read that another program wrote, or the recorder itself."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType

from hmcs.bus.messages import Motion, Step
from hmcs.recordings.reading import read
from support.mcap_files import Rows, rewritten
from support.recordings import BEGUN_NS, KEYS, Maker, Said, hand_of


@pytest.fixture
def take(maker: Maker, performed: Callable[..., list[Said]]) -> Path:
    return maker.write(performed(("go", "turn"), 60))


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10**6), chunk_bytes=st.sampled_from([500, 4000, 10**6]))
def test_what_others_wrote_is_read_by_log_time(
    tmp_path_factory: pytest.TempPathFactory, seed: int, chunk_bytes: int
) -> None:
    folder = tmp_path_factory.mktemp("takes")
    take = Maker(folder).write(list(hand_of(("go", "turn"), 20)))

    def shuffled(rows: Rows) -> Rows:
        Random(seed).shuffle(rows)
        return rows

    mixed = rewritten(take, folder / "mixed.mcap", order=shuffled, chunk_bytes=chunk_bytes)
    content = read(mixed)
    assert [m.text for m in content.messages] == [m.text for m in read(take).messages]
    assert (content.duration_s, content.whole) == (read(take).duration_s, True)
    assert [m.position[0] for _, _, m in content.of(Motion)] == [
        m.position[0] for _, _, m in read(take).of(Motion)
    ]


@pytest.mark.parametrize("chunked", [True, False])
def test_messages_of_one_time_stay_as_they_stand_in_the_file(
    take: Path, tmp_path: Path, chunked: bool
) -> None:
    def late_first(rows: Rows) -> Rows:
        for row in rows[5:]:
            row.log_time = row.publish_time = BEGUN_NS + 10**9
        return rows[5:] + rows[:5]

    other = rewritten(
        take,
        tmp_path / "other.mcap",
        order=late_first,
        chunked=chunked,
        compression=CompressionType.NONE,
    )
    expected = [m.text for m in read(take).messages]
    assert [m.text for m in read(other).messages] == expected


def test_what_the_recorder_wrote_is_read_as_it_came(
    maker: Maker, performed: Callable[..., list[Said]], tmp_path: Path
) -> None:
    """Steps made before stand first in it; what came while it asked for them was logged before."""
    recording = maker.begin()
    said = performed(("go",), 40)
    steps = [maker.fields(body, body.index) for _, body in said if isinstance(body, Step)]
    for fields in steps[:4]:
        recording.write(KEYS.step, fields, BEGUN_NS + 500, None)
    for number, fields in enumerate(steps[4:]):
        recording.write(KEYS.step, fields, BEGUN_NS + number, None)
    recording.finish()
    own = rewritten(recording.path, tmp_path / "own.mcap", library="hmcs 0.1.0")
    other = rewritten(recording.path, tmp_path / "other.mcap", library="mcap go v1.2")
    count = len(steps)
    assert [step.index for _, _, step in read(own).of(Step)] == list(range(count))
    assert read(own).first_ns == BEGUN_NS + 500
    assert [step.index for _, _, step in read(other).of(Step)] == [*range(4, count), 0, 1, 2, 3]


def test_one_message_is_found_by_its_number(take: Path) -> None:
    content = read(take)
    every = list(content.messages)
    assert (content.messages[0], content.messages[-1]) == (every[0], every[-1])
    assert every[3] in content.messages
    with pytest.raises(IndexError):
        content.messages[len(every)]
