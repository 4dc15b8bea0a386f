"""A new model takes over while the hand moves, and the one before comes back."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from hmcs.bus.session import Bus
from hmcs_local.deploying import Agreement, DeployError, active_model, back, deploy, read_history
from support.takeovers import TICK_S, Running, brought_up


@pytest.fixture
def running(
    tmp_path: Path, performance_file: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Running]:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with brought_up(tmp_path, performance_file) as running:
        yield running


def test_models_take_over_one_after_another_without_a_gap_and_come_back(
    running: Running, model_file: Path, shadow_model_file: Path
) -> None:
    folder = running.stack.folder

    def first(bus: Bus) -> str:
        deploy(bus, running.control, folder, model_file, watch_s=1.0)
        return active_model(bus)

    assert running.watched(first) == "human-shapes"
    with pytest.raises(DeployError, match="nothing to return to"):
        running.watched(lambda bus: back(bus, running.control, folder))

    def second(bus: Bus) -> Agreement:
        agreement = deploy(bus, running.control, folder, shadow_model_file, watch_s=4.0)
        assert active_model(bus) == "shadow"
        return agreement

    running.commands.clear()
    running.fixtures.clear()
    running.beliefs.clear()
    steps, alike = running.watched(second)
    assert steps > 10
    assert alike > 0.8 * steps
    # The old one has left, and no step went without a belief of the active one.
    assert [d.model for d in read_history(folder).deployed] == ["human-shapes", "shadow"]
    recognizers = [p for p in running.stack.instances("recognizer") if p.running]
    assert len(recognizers) == 2
    reported = {received.body.step for received in running.beliefs}
    assert reported == set(range(min(reported), max(reported) + 1))
    gaps = np.diff([received.received_ns for received in running.commands]) / 1e9
    # A recognizer takes longer to start than that: the commands do not wait for it. How long they
    # may wait on an idle machine is for the bench.
    assert gaps.max() < 1.0
    assert np.median(gaps) < 2 * TICK_S
    factors = np.array([received.body.factor for received in running.fixtures])
    times_s = np.array([received.received_ns for received in running.fixtures]) / 1e9
    # A message that is late on its way follows the one before it by too much, or is followed too
    # soon: the times of those around count as well.
    changes, spans_s = np.abs(np.diff(factors))[1:-1], times_s[3:] - times_s[:-3]
    assert (changes <= 16.0 * np.maximum(spans_s, 3 * TICK_S) + 0.05).all()

    assert running.watched(lambda bus: back(bus, running.control, folder)) == "human-shapes"
    assert running.watched(active_model) == "human-shapes"
    assert [d.model for d in read_history(folder).deployed] == ["human-shapes"]


def test_a_model_of_the_name_of_the_active_one_is_refused(
    running: Running, model_file: Path, other_model_file: Path
) -> None:
    folder = running.stack.folder
    running.watched(lambda bus: deploy(bus, running.control, folder, model_file, watch_s=0.0))
    with pytest.raises(DeployError, match="train it under another name"):
        running.watched(
            lambda bus: deploy(bus, running.control, folder, other_model_file, watch_s=0.0)
        )
