"""`hmcs segment`: segments shown, and written as labels that `hmcs train` accepts."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml

from hmcs.bus.messages import Motion
from hmcs.motion.demonstrations import read_csv, write_csv
from hmcs.recognition.learning import learn
from hmcs.recognition.model_file import save_model
from hmcs.recordings.csv_labels import read_labeled_csv
from hmcs.recordings.labels import how_labeled, labels_of
from hmcs.recordings.reading import read
from hmcs_local.command import main
from support.lessons import ROUND, lesson_task, performed
from support.recordings import KEYS, Maker

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("models") / "m.hmcs"
    save_model(learn(lesson_task(), [performed(seed) for seed in range(4)]), file)
    return file


@pytest.fixture
def hmcs(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Run:
    def run(*words: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["hmcs", *map(str, words)])
        monkeypatch.setenv("COLUMNS", "80")
        with pytest.raises(SystemExit) as ended:
            main()
        said = capfd.readouterr()
        return int(ended.value.code or 0), said.out, said.err

    return run


@pytest.fixture
def unlabeled(tmp_path: Path) -> Path:
    shown, file = performed(9), tmp_path / "new.csv"
    write_csv(file, shown._replace(states=(None,) * len(shown.states)))
    return file


@pytest.fixture
def take(tmp_path: Path) -> Path:
    samples = [
        (KEYS.motion, Motion(position=at, velocity=np.zeros(3), dead_man=True))
        for at in performed(9).positions
    ]
    return Maker(tmp_path / "takes").write(samples)


def task_file(folder: Path) -> Path:
    task, file = lesson_task(), folder / "task.yaml"
    fields = task.model_dump(mode="json", exclude_defaults=True) | {"format": task.format}
    file.write_text(yaml.safe_dump(fields))
    return file


def true_changes_s() -> list[float]:
    shown = performed(9)
    return shown.time_s[np.flatnonzero(shown.switches[1:]) + 1].tolist()


def test_the_table_has_state_times_and_probability(hmcs: Run, model: Path, unlabeled: Path) -> None:
    code, out, _ = hmcs("segment", unlabeled, "--model", model)
    assert code == 0
    title, header, *rows = (line.split() for line in out.splitlines())
    assert title == ["new.csv:", "4.0", "s"]
    assert " ".join(header) == "state from, s to, s probability"
    assert [row[0] for row in rows] == list(ROUND)
    assert [row[1] for row in rows[1:]] == [row[2] for row in rows[:-1]]
    np.testing.assert_allclose([float(row[1]) for row in rows[1:]], true_changes_s(), atol=0.15)
    assert all(0.8 < float(row[3]) <= 1.0 for row in rows)
    assert {len(line) for line in out.splitlines()[2:]} == {len(out.splitlines()[2])}


def test_its_labels_of_a_csv_file_are_trained_from(
    hmcs: Run, model: Path, unlabeled: Path, tmp_path: Path
) -> None:
    before, out = unlabeled.read_bytes(), tmp_path / "new.labels.csv"
    assert hmcs("segment", unlabeled, "--model", model, "--out", out)[0] == 0
    assert unlabeled.read_bytes() == before
    labeled = read_labeled_csv(unlabeled).demonstration
    assert [label for label, _ in labeled.stretches] == list(ROUND)
    assert None in read_csv(unlabeled).states
    words = ("train", task_file(tmp_path), unlabeled, "--output", tmp_path / "n.hmcs")
    code, _, err = hmcs(*words, "--no-report")
    assert code == 0, err


def test_its_labels_of_a_recording_are_trained_from(
    hmcs: Run, model: Path, take: Path, tmp_path: Path
) -> None:
    out = take.with_name("take.labels.csv")
    for _ in range(2):  # what was found may be found anew
        assert hmcs("segment", take, "--model", model, "--out", out)[0] == 0
    assert [label.state for label in labels_of(read(take))] == list(ROUND)
    assert how_labeled(read(take)) == "found"
    words = ("train", task_file(tmp_path), take, "--output", tmp_path / "n.hmcs")
    code, _, err = hmcs(*words, "--no-report")
    assert code == 0, err


def test_labels_of_several_files_go_into_a_folder(
    hmcs: Run, model: Path, take: Path, unlabeled: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "found" / "here"
    assert hmcs("segment", take, unlabeled, "--model", model, "--out", folder)[0] == 0
    assert sorted(file.name for file in folder.iterdir()) == ["new.labels.csv", "take.labels.csv"]


def test_labels_that_somebody_set_are_not_written_over(
    hmcs: Run, model: Path, unlabeled: Path, tmp_path: Path
) -> None:
    out = tmp_path / "new.labels.csv"
    out.write_text("begin_s,end_s,state\n0,1,reach\n")
    code, said, err = hmcs("segment", unlabeled, "--model", model, "--out", out)
    assert (code, said) == (2, "")
    assert "new.labels.csv: is there already" in err
    assert out.read_text() == "begin_s,end_s,state\n0,1,reach\n"


def test_where_labels_cannot_be_written_is_refused_before_anything_is_read(
    hmcs: Run, model: Path, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("")
    gone = tmp_path / "gone.csv"
    code, _, err = hmcs("segment", gone, "--model", model, "--out", tmp_path / "file" / "x.csv")
    assert code == 2
    assert f"--out: {tmp_path / 'file'}: is no folder" in err
    code, _, err = hmcs("segment", "lasa:Sine/1", "--model", model, "--out", tmp_path)
    assert code == 2
    assert "is a drawing" in err


def test_a_kind_without_offline_segmentation_is_refused_before_anything_is_read(
    hmcs: Run, tmp_path: Path
) -> None:
    file = tmp_path / "online.hmcs"
    shown = [performed(seed) for seed in range(2)]
    save_model(learn(lesson_task(), shown, recognizer="online-network"), file)
    code, _, err = hmcs("segment", tmp_path / "gone.csv", "--model", file)
    assert code == 2
    assert "no offline segmentation: train one of segment-filter" in err
