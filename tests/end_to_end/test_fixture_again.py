"""What the fixture would have done with the model it had is what it did.

Not to the last bit: the recorder hears samples, beliefs and the robot at moments of its own, so
that a belief may come some ticks earlier or later than it came to the fixture controller. Filters
against tremor mind how far apart samples came, which is why velocities are not compared here.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from hmcs.recordings.comparing import CLOSE, compared, fixtures_compared
from hmcs.recordings.fixture_replay import FixtureReplay, replay_fixture
from hmcs.recordings.reading import read
from hmcs.recordings.replaying import kept_model, replayed
from support.hand import PERIOD_S, Watcher
from support.stack import PATIENT_FIXTURE, PATIENT_ROBOT, Stack

SPAN_S = 10.0
"""Two shapes and a switch between them."""
ALIKE = 0.9
TICKS = 5
"""So much later or earlier than the recorder heard of it may the fixture controller have heard of
something: then k, on its way up or down, is what it was at a neighboring tick."""


def alike_within_ticks(fixture: FixtureReplay) -> float:
    """The share of ticks with the same k as at that tick, or one of its neighbors."""
    pairs = [(tick.now.factor, tick.then.factor) for tick in fixture.ticks if tick.then]
    now, then = np.array(pairs).T
    around = np.lib.stride_tricks.sliding_window_view(np.pad(then, TICKS, "edge"), 2 * TICKS + 1)
    return float(np.mean((now >= around.min(1) - CLOSE) & (now <= around.max(1) + CLOSE)))


def test_with_the_same_model_the_fixture_would_have_done_what_it_did(
    stack: Stack, tmp_path: Path, performance_file: Path, model_file: Path
) -> None:
    bus = stack.open_bus("observer", "o")
    stack.watch(bus)
    watcher = Watcher(bus, evidence=False)
    models = ("--models", json.dumps([str(model_file)]))
    stack.until_ready(
        stack.start("robot", "r", *PATIENT_ROBOT),
        stack.start("fixture_controller", "f", *models, *PATIENT_FIXTURE),
        stack.start("recognizer", "r", "--model", model_file),
    )
    folder = tmp_path / "recordings"
    recorder = stack.bring_up("recorder", "rec", "--folder", folder, *models, "--free-mb", 0)
    stack.bring_up(
        "input_device",
        "i",
        *("--source", "recorded", "--demonstration", performance_file, "--rate-hz", 100),
        *("--lead-in-s", 0.5, "--wait-for", '["robot", "fixture_controller"]'),
    )
    stack.until(lambda: watcher.motions and watcher.motions[-1].body.dead_man)
    stack.elapse(SPAN_S)
    assert recorder.stop() == 0
    (file,) = folder.glob("*.mcap")
    content = read(file)
    replay = replayed(content, kept_model(content))
    fixture = replay_fixture(content, replay)
    beliefs = compared(replay)
    assert beliefs.same_bits == beliefs.compared > 60
    # The recording may end between the last step and the belief after it.
    assert len(replay.beliefs) - beliefs.compared <= 1
    assert fixture.notes == ()
    figures = fixtures_compared(fixture)
    assert figures.compared > 0.7 * figures.ticks > 600
    assert figures.guides_both > 0.5
    assert alike_within_ticks(fixture) >= ALIKE
    assert figures.same_state >= ALIKE
    assert figures.directions_apart_deg < 1.0
    assert abs(figures.lets_go_later_ms) <= 1e3 * TICKS * PERIOD_S
