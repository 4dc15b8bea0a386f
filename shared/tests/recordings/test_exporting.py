"""Recordings as tables, and what they tell of themselves."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np

from hmcs.bus.messages import Motion
from hmcs.recordings.exporting import export
from hmcs.recordings.inspection import inspected
from hmcs.recordings.reading import read
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
