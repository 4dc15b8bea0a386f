"""A recording again, in process, times as fast as it happened; and how soon one is learned from."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np

from bench.figures import Figure, tell
from bench.whole_stack import SHAPES
from hmcs.motion.demonstrations import Demonstration, read_csv
from hmcs.recognition.model_file import load_model
from hmcs.recordings.comparing import compared, fixtures_compared
from hmcs.recordings.fixture_replay import replay_fixture
from hmcs.recordings.reading import read
from hmcs.recordings.replaying import replayed
from hmcs.task import load_task
from hmcs_trainer.performance import perform
from hmcs_trainer.training import train
from support.cells import performance, write_cell

TIMES_REAL = 50.0
LEARNING_S = 10.0
RATE_HZ = 100.0


def measure(repeats: int) -> list[Figure]:
    """Learn five states from three demonstrations, perform them at 100 Hz, and replay that."""
    task = load_task("human-shapes")
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        model_file = folder / "human-shapes.hmcs"
        shown = [str(folder / f"shown-{number}.csv") for number in (1, 2, 3)]
        for number, file in enumerate(shown, start=1):
            perform(task, [f"lasa:{shape}/{number}" for shape in SHAPES], file)
        learning_s = []
        for _ in range(repeats):
            began_s = time.monotonic()
            train("human-shapes", shown, model_file, report=folder / "human-shapes.html")
            learning_s.append(time.monotonic() - began_s)
        model = load_model(model_file)
        perform(task, [f"lasa:{shape}/6" for shape in SHAPES], folder / "operator.csv")
        content = read(write_cell(folder, performance(model, _sampled(folder / "operator.csv"))))
        beliefs, fixtures = [], []
        for _ in range(repeats):
            replay = replayed(content, model)
            beliefs.append(compared(replay))
            fixtures.append(fixtures_compared(replay_fixture(content, replay)))
    same = beliefs[0].same_bits / beliefs[0].steps
    return [
        Figure("learning five states from three demonstrations, with the report",
               float(np.median(learning_s)), "s", at_most=LEARNING_S),
        Figure("steps replayed with the very same belief", same, at_least=1.0),
        Figure("ticks of the fixture replayed with the same factor", fixtures[0].factor_close,
               at_least=1.0),
        Figure("recognition replayed, times as fast as it happened",
               float(np.median([each.times_real for each in beliefs])), at_least=TIMES_REAL),
        Figure("the fixture at 100 Hz replayed, times as fast as it happened",
               float(np.median([each.times_real for each in fixtures]))),
    ]  # fmt: skip


def _sampled(file: Path) -> Demonstration:
    """A demonstration in a file, sampled at an even rate."""
    given = read_csv(file)
    times = np.arange(given.time_s[0], given.time_s[-1], 1.0 / RATE_HZ)
    path = [np.interp(times, given.time_s, column) for column in given.positions.T]
    return Demonstration(given.name, times, np.stack(path, axis=1), (None,) * len(times))


if __name__ == "__main__":
    raise SystemExit(not tell(__doc__, measure(5)))
