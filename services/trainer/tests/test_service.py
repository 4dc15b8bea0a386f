"""The trainer on the bus: trains when asked, in a process of its own."""

from __future__ import annotations

import contextlib
import logging
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from hmcs.bus.messages import Ask, Train, TrainingProgress
from hmcs.bus.session import RequestRefusedError
from hmcs.motion.demonstrations import Demonstration, read_csv, write_csv
from hmcs.recognition.model_file import load_model
from hmcs.task import find_task, load_task
from hmcs_trainer.service import Trainer
from hmcs_trainer.settings import TrainerSettings
from support.stack import Stack

DRAWINGS = tuple(f"lasa:{s}/1-2" for s in ("GShape", "NShape", "PShape", "JShape", "Snake"))
ASKED = Train(model="mine", task="human-shapes", demonstrations=DRAWINGS)


class Bench:
    """A trainer and somebody who watches, both in this thread."""

    def __init__(self, stack: Stack, folder: Path) -> None:
        self.stack, self.folder = stack, folder
        self.takes = folder.parent / "takes"
        self.takes.mkdir()
        self.reported: list[TrainingProgress] = []
        watcher = stack.open_bus("observer", "one")
        watcher.subscribe(
            TrainingProgress, watcher.keys.training, lambda got: self.reported.append(got.body)
        )
        bus = stack.open_bus("trainer", "here")
        settings = TrainerSettings(folder=folder, sources=(self.takes,))
        self.trainer = Trainer(settings, bus, logging.getLogger("test"))
        self.trainer.start()

    def until(self, stage: str) -> TrainingProgress:
        def reached() -> TrainingProgress | None:
            return next((reported for reported in self.reported if reported.stage == stage), None)

        found = self.stack.until(reached, within_s=120.0)
        assert isinstance(found, TrainingProgress)
        return found


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    with Stack(tmp_path) as stack:
        made = Bench(stack, tmp_path / "models")
        yield made
        made.trainer.close()


@pytest.mark.long
def test_a_model_and_its_page_are_made_and_progress_is_reported(bench: Bench) -> None:
    assert "training mine" in bench.trainer._train(ASKED).detail
    with pytest.raises(RequestRefusedError, match="mine is being trained: wait"):
        bench.trainer._train(ASKED)
    done = bench.until("done")
    assert load_model(done.path).name == "mine"
    assert Path(done.report).is_file()
    shares = [reported.share for reported in bench.reported]
    assert shares == sorted(shares)
    assert {"checking", "learning", "judging", "done"} == {
        reported.stage for reported in bench.reported
    }
    assert "steps right" in done.detail
    assert "mine" in bench.trainer.health()[1]


@pytest.mark.long
def test_a_training_that_cannot_succeed_says_why_and_the_next_one_may(bench: Bench) -> None:
    (bench.takes / "empty.csv").write_text("time_s,x_m,y_m,state\n0,0,0,secret\n")
    bench.trainer._train(ASKED.model_copy(update={"demonstrations": ("empty.csv",)}))
    failed = bench.until("failed")
    assert "empty.csv: cannot be read: `hmcs task check`" in failed.detail
    assert not any("secret" in reported.detail for reported in bench.reported)
    assert list(bench.folder.iterdir()) == []
    bench.trainer._train(ASKED)
    bench.until("learning")


@pytest.mark.long
def test_a_training_is_canceled_without_a_trace(bench: Bench) -> None:
    with pytest.raises(RequestRefusedError, match="nothing is being trained"):
        bench.trainer._cancel(Ask())
    bench.trainer._train(ASKED)
    bench.until("learning")
    assert "canceled mine" in bench.trainer._cancel(Ask()).detail
    bench.until("canceled")
    assert list(bench.folder.iterdir()) == []


@pytest.mark.long
def test_of_two_trainers_only_one_trains_a_model_of_a_name(bench: Bench) -> None:
    bus = bench.stack.open_bus("trainer", "there")
    with contextlib.closing(
        Trainer(TrainerSettings(folder=bench.folder), bus, logging.getLogger("test"))
    ) as other:
        other.start()
        other._train(ASKED)
        bench.until("learning")
        with pytest.raises(RequestRefusedError, match="mine is being trained by trainer there"):
            bench.trainer._train(ASKED)
        other._cancel(Ask())
        bench.until("canceled")
        assert "training mine" in bench.trainer._train(ASKED).detail


@pytest.mark.long
def test_states_are_found_when_asked_for(bench: Bench) -> None:
    corners = read_csv(find_task("lines-through-obstacles").with_suffix(".csv"))
    time_s = np.arange(0.0, corners.time_s[-1], 0.02)
    lines = np.stack([np.interp(time_s, corners.time_s, c) for c in corners.positions.T], axis=1)
    files = []
    for seed in (1, 2):
        wander = np.random.default_rng(seed).normal(scale=4e-4, size=lines.shape).cumsum(axis=0)
        files.append(str(bench.takes / f"take-{seed}.csv"))
        shown = Demonstration("shown", time_s, lines + wander, (None,) * len(time_s))
        write_csv(files[-1], shown)
    asked = Train(
        model="found",
        task="lines-through-obstacles",
        demonstrations=tuple(files),
        find_states=True,
    )
    bench.trainer._train(asked)
    done = bench.until("done")
    assert "4 states of 4 gestemes found in 2 demonstrations" in done.detail
    assert load_task(bench.folder / "found.yaml") == load_model(done.path).task


def test_a_hidden_file_is_neither_read_nor_asked_to_be_there(bench: Bench, tmp_path: Path) -> None:
    secret = tmp_path / "secret.csv"
    secret.write_text("root:x:0:0:root:/root:/bin/bash\n")
    (bench.takes / "link.csv").symlink_to(secret)
    reasons = []
    for name in (
        str(secret),
        "../secret.csv",
        "link.csv",
        str(bench.takes / ".." / "secret.csv"),
        str(tmp_path / "nowhere.csv"),
    ):
        with pytest.raises(RequestRefusedError) as caught:
            bench.trainer._train(ASKED.model_copy(update={"demonstrations": (name,)}))
        reasons.append(str(caught.value).replace(repr(name), "it"))
    assert len(set(reasons)) == 1
    assert "is no file in the trainer's folders" in reasons[0]
    assert bench.reported == []


@pytest.mark.long
def test_a_training_that_takes_too_long_is_given_up_and_the_next_one_may(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    hangs = (sys.executable, "-c", "import time; time.sleep(1000)")
    with monkeypatch.context() as patched:
        patched.setattr("hmcs_trainer.running._COMMAND", hangs)
        patched.setattr(
            bench.trainer, "settings", bench.trainer.settings.model_copy(update={"longest_s": 0.5})
        )
        bench.trainer._train(ASKED)
        assert "longer than 0.5 s" in bench.until("failed").detail
    bench.trainer._train(ASKED)
    bench.until("learning")


def test_a_training_whose_process_dies_is_reported_and_quotes_nothing(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    dies = (sys.executable, "-c", "raise SystemExit('root:x:0:0')")
    monkeypatch.setattr("hmcs_trainer.running._COMMAND", dies)
    bench.trainer._train(ASKED)
    detail = bench.until("failed").detail
    assert "ended with 1" in detail
    assert "root" not in detail


def test_what_strangers_tell_takes_no_memory_and_is_forgotten(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hmcs_trainer.service.MOST_ELSEWHERE", 2)
    for number in range(4):
        stranger = bench.stack.open_bus("trainer", f"stranger-{number}")
        stranger.publisher(TrainingProgress, stranger.keys.training).put(
            TrainingProgress(model="mine", stage="learning", detail="", share=0.0)
        )
    bench.stack.until(lambda: len(bench.reported) == 4)
    bench.stack.until(lambda: "stranger-3" in bench.trainer._elsewhere)
    assert len(bench.trainer._elsewhere) <= 2
    with pytest.raises(RequestRefusedError, match="by trainer stranger"):
        bench.trainer._train(ASKED)
    monkeypatch.setattr("hmcs_trainer.service.FORGOTTEN_AFTER_S", 0.0)
    assert "training mine" in bench.trainer._train(ASKED).detail
