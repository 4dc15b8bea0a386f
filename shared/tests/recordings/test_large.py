"""However large a recording is, a small part of it is in memory at once."""

from __future__ import annotations

import json
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer

from hmcs.bus.messages import Belief, Motion
from hmcs.bus.wire import schema_of
from hmcs.recordings.beliefs import Beliefs, Packer
from support.mcap_files import Rows, rewritten
from support.peak_memory import grown_mb
from support.recordings import BEGUN_NS

SAMPLES = 15_000
PADDING = 80
"""Numbers in each message that nobody here knows: a newer sender's."""
MOST_MB = 20.0
"""The texts alone have more; what is made of them has ten times as much."""

READ = "from hmcs.recordings.reading import read"
WORK = {
    "outline": (
        "from hmcs.recordings.outlining import outlined",
        "assert len(outlined(read(sys.argv[1])).time_s) == 1000",
    ),
    "inspect": (
        "from hmcs.recordings.inspection import inspected",
        f"assert inspected(read(sys.argv[1])).channels[0].messages == {SAMPLES}",
    ),
    "export CSV": (
        "from pathlib import Path; from hmcs.recordings.exporting import export",
        "export(read(sys.argv[1]), Path(sys.argv[2]), 'csv')",
    ),
    "export NumPy": (
        "from pathlib import Path; from hmcs.recordings.exporting import export",
        "export(read(sys.argv[1]), Path(sys.argv[2]), 'npz')",
    ),
    "learn from": (
        "from hmcs.recordings.demonstrations import demonstrations_of, performances_of",
        f"assert len(demonstrations_of(read(sys.argv[1]))[0].time_s) == {SAMPLES}\n"
        f"assert len(performances_of(read(sys.argv[1]))[0].time_s) == {SAMPLES}",
    ),
}


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of a hand at 100 Hz for two and a half minutes, 27 MB of text."""
    path = tmp_path_factory.mktemp("large") / "large.mcap"
    rng = np.random.default_rng(0)
    fields = {
        "source": {"service": "input_device", "instance": "hand", "boot": "b"},
        "velocity": [0.0, 0.0, 0.0],
        "dead_man": True,
    }
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=256 * 1024)
        writer.start("hmcs", "hmcs test")
        schema = writer.register_schema(f"hmcs.{schema_of(Motion)}", "jsonschema", b"{}")
        channel = writer.register_channel("hmcs/@v1/test/input/motion", "json", schema)
        noise = rng.random(PADDING * 4).tolist()
        for number in range(SAMPLES):
            at = number % len(noise) // 2
            text = json.dumps(
                {"schema": schema_of(Motion), **fields, "seq": number}
                | {"position": [number * 1e-4, 0.0, 0.0], "newer": noise[at : at + PADDING]}
            )
            log_ns = BEGUN_NS + number * 10_000_000
            writer.add_message(channel, log_ns, text.encode(), log_ns)
        writer.finish()
    return path


@pytest.mark.long
@pytest.mark.parametrize("what", list(WORK))
def test_a_large_recording_takes_little_memory(large: Path, tmp_path: Path, what: str) -> None:
    prepared, work = WORK[what]
    assert grown_mb(f"{READ}\n{prepared}", work, large, tmp_path) < MOST_MB


def test_steps_and_beliefs_of_a_replay_are_kept_small() -> None:
    rng, packer, beliefs = np.random.default_rng(0), Packer(), Beliefs()
    grown = []
    tracemalloc.start()
    for step in range(2000):
        belief = Belief.model_validate_json(
            json.dumps(
                {
                    "model_hash": "h",
                    "clock": "c",
                    "step": step,
                    "states": ["one", "two", "three"],
                    "probabilities": rng.random(3).tolist(),
                    "likely_gesteme": "up",
                    "segment_start": 0,
                }
            )
        )
        beliefs.add(step, "c", step, step, packer.pack(belief), packer.pack(belief), "one")
        grown.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    assert (grown[-1] - grown[1000]) / 1000 < 1500
    assert beliefs[1999].replayed.step == 1999
    assert beliefs[7].replayed.states == ("one", "two", "three")


def test_messages_in_the_order_of_time_take_little_memory_however_they_were_written(
    large: Path, tmp_path: Path
) -> None:
    def mixed(rows: Rows) -> Rows:
        # Two sources, each in order, a second apart, as a program writes that merges them.
        pairs = [(rows[k : k + 100], rows[k + 100 : k + 200]) for k in range(0, len(rows), 200)]
        return [row for one, other in pairs for row in other + one]

    other = rewritten(large, tmp_path / "mixed.mcap", order=mixed, chunk_bytes=50_000)
    work = (
        "times = [m.log_ns for m in read(sys.argv[1]).messages]\n"
        f"assert times == sorted(times) and len(times) == {SAMPLES}"
    )
    assert grown_mb(READ, work, other) < MOST_MB
