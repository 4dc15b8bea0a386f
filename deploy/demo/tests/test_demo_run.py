from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import psutil
import pytest
from rich.console import Console

from hmcs.errors import UserError
from hmcs.motion.demonstrations import Demonstration, write_csv
from hmcs.recognition.model_file import load_model
from hmcs.task import load_task
from hmcs_demo import run as demo
from hmcs_demo.measure import measure
from hmcs_demo.play import Plan, play
from hmcs_demo.progress import Progress, ProgressLine
from hmcs_demo.recording import load_recording
from hmcs_demo.truth import RunError
from hmcs_local.command import main
from hmcs_trainer.performance import perform
from hmcs_trainer.training import train

FEW_S = 6.0


@pytest.mark.parametrize("held_out", [(), (1,), (1, 1), (0, 5), (1, 8), (1, 2, 3)])
def test_numbers_that_cannot_be_held_out_are_reported(
    tmp_path: Path, held_out: tuple[int, ...]
) -> None:
    with pytest.raises(UserError, match="two different numbers from 1 to 7"):
        demo.run(output=tmp_path / "report", seed=1, held_out=held_out)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("numbers", ["1,9", "1;5"])
def test_mistake_on_the_command_line_is_exit_code_2(
    numbers: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = ["hmcs", "demo", "--output", str(tmp_path / "report"), "--held-out", numbers]
    monkeypatch.setattr("sys.argv", words)
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert f"--held-out {numbers}: " in capsys.readouterr().err


def test_folder_that_cannot_be_written_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    with pytest.raises(UserError, match="is no folder"):
        demo.run(output=tmp_path / "file" / "report", seed=1, held_out=(1, 5))


def replace_run(monkeypatch: pytest.MonkeyPatch, error: BaseException | None) -> None:
    def run(folder: Path, *_: object) -> None:
        for name in ("report", "stack/logs"):
            (folder / name).mkdir(parents=True)
        (folder / "report" / "index.html").write_text("new", encoding="utf-8")
        (folder / "stack" / "logs" / "robot-1.log").write_text("said", encoding="utf-8")
        if error is not None:
            raise error

    monkeypatch.setattr(demo, "_run", run)


def test_interrupted_run_leaves_the_report_of_the_last_one_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    output = tmp_path / "report"
    output.mkdir()
    (output / "index.html").write_text("old", encoding="utf-8")
    replace_run(monkeypatch, KeyboardInterrupt())
    assert demo.run(output=output, seed=1, held_out=(1, 5)) == 130
    assert [path.name for path in tmp_path.iterdir()] == ["report"]
    assert (output / "index.html").read_text(encoding="utf-8") == "old"


def test_report_takes_the_place_of_the_last_one_and_spares_what_is_no_part_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    output = tmp_path / "report"
    output.mkdir()
    for name in ("index.html", "my-notes.txt"):
        (output / name).write_text("old", encoding="utf-8")
    replace_run(monkeypatch, None)
    assert demo.run(output=output, seed=1, held_out=(1, 5)) == 0
    assert (output / "index.html").read_text(encoding="utf-8") == "new"
    assert (output / "my-notes.txt").read_text(encoding="utf-8") == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["report"]


def test_run_that_does_not_come_about_leaves_its_logs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    replace_run(monkeypatch, RunError("robot-1 ended by itself"))
    assert demo.run(output=tmp_path / "report", seed=1, held_out=(1, 5)) == 1
    assert "robot-1 ended by itself" in capsys.readouterr().out
    assert [path.name for path in tmp_path.iterdir()] == ["report-failed"]
    assert (tmp_path / "report-failed" / "robot-1.log").read_text(encoding="utf-8") == "said"


def test_progress_is_plain_lines_where_there_is_no_terminal() -> None:
    stream = io.StringIO()
    progress = Progress("moving", 3.2, "write-g", 0.97, 0.78, 31, 0, 0)
    with ProgressLine(Console(file=stream, width=80), 52.0) as line:
        for _ in range(3):
            line.show(progress)
    (text,) = stream.getvalue().splitlines()
    for part in ("3/52 s", "write-g", "p 0.97", "k 0.78", "steps 31", "missing 0", "lost 0"):
        assert part in text


def test_progress_fits_a_narrow_terminal() -> None:
    stream = io.StringIO()
    progress = Progress("moving", 33.2, "write-snake", 0.97, 0.78, 431, 0, 0)
    console = Console(file=stream, width=80, force_terminal=True, color_system=None)
    with ProgressLine(console, 52.0) as line:
        line.show(progress)
    assert "lost 0" in stream.getvalue()
    assert stream.getvalue().count("\n") <= 1


@pytest.fixture
def short_run(tmp_path: Path) -> tuple[Plan, Demonstration]:
    """The first seconds of a performance, and a model in the folder of the stack."""
    task = load_task("human-shapes")
    shapes = ("GShape", "NShape", "PShape", "JShape", "Snake")
    train(task.name, [f"lasa:{s}/1-5" for s in shapes], tmp_path / "stack/models/human-shapes.hmcs")
    file = tmp_path / "performance.csv"
    whole = perform(task, ["lasa:GShape/6", "lasa:NShape/6"], file)
    kept = int((whole.time_s <= FEW_S).sum())
    short = Demonstration(
        file.name, whole.time_s[:kept], whole.positions[:kept], whole.states[:kept]
    )
    write_csv(file, short)
    return Plan(file, kill_at_s=2.0, victim=1), short


def running_below() -> set[psutil.Process]:
    """Every process that descends from this one, those of other tests' pools among them."""
    return set(psutil.Process().children(recursive=True))


def test_run_survives_the_killing_of_a_classifier_and_leaves_no_process(
    short_run: tuple[Plan, Demonstration], tmp_path: Path
) -> None:
    plan, performance = short_run
    before = running_below()
    stream = io.StringIO()
    with ProgressLine(Console(file=stream, width=80), FEW_S) as line:
        played = play(plan, tmp_path / "stack", tmp_path / "recording.npz", line)
    assert played.killed == "gesteme-classifier-2"
    assert played.lost_messages == played.refused_messages == 0
    assert 0 < played.cpu_cores < 2
    recording = load_recording(tmp_path / "recording.npz")
    model = load_model(tmp_path / "stack/models/human-shapes.hmcs")
    measured = measure(recording, performance, model, 100.0)
    assert measured.scores.steps > 30
    assert measured.scores.missing_steps == 0
    gone = recording.members.instance[~recording.members.alive]
    assert "gesteme-classifier-2" in gone
    assert running_below() <= before


def test_run_ends_with_what_a_process_said_when_it_ends_by_itself(
    short_run: tuple[Plan, Demonstration], tmp_path: Path
) -> None:
    plan, _ = short_run
    before = running_below()
    still = Demonstration("still", np.array([0.0, 1.0]), np.zeros((2, 3)), (None, None))
    write_csv(plan.performance, still)
    with (
        ProgressLine(Console(file=io.StringIO()), FEW_S) as line,
        pytest.raises(RunError, match=r"input-device-1 ended by itself(.|\n)*no step"),
    ):
        play(plan, tmp_path / "stack", tmp_path / "recording.npz", line)
    assert running_below() <= before
