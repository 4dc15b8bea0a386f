"""Commands find recordings where the recorder puts them, and say which file they took."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from hmcs.motion.demonstrations import read_csv, write_csv
from hmcs.recognition.learning import learn
from hmcs.recognition.model_file import save_model
from support.lessons import lesson_task, performed
from support.recordings import Maker, hand_of

Run = Callable[..., subprocess.CompletedProcess[str]]
STATES = ("lift", "carry")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What `hmcs up` leaves behind: two recordings, and labels of one."""
    folder = tmp_path_factory.mktemp("made")
    for name in ("take-1", "take-2"):
        Maker(folder / name).write(list(hand_of(STATES, 100)))
        (folder / name / "take.mcap").rename(folder / f"{name}.mcap")
        (folder / name).rmdir()
    return folder


@pytest.fixture
def recordings(made: Path, tmp_path: Path) -> Path:
    return shutil.copytree(made, tmp_path / "out/up/recordings")


@pytest.fixture
def model(tmp_path: Path) -> str:
    save_model(learn(lesson_task(), [performed(seed) for seed in (1, 2)]), tmp_path / "m.hmcs")
    return "m.hmcs"


@pytest.mark.usefixtures("recordings")
@pytest.mark.parametrize("name", ["take-1", "take-1.mcap"])
@pytest.mark.parametrize("command", ["inspect", "label", "check", "export --to tables"])
def test_a_bare_name_is_a_recording_of_the_recorder(hmcs: Run, command: str, name: str) -> None:
    word, *options = command.split()
    done = hmcs(word, name, *options)
    assert done.returncode in (0, 1)
    assert done.stderr == f"{name}: out/up/recordings/take-1.mcap\n"
    assert done.stdout


@pytest.mark.usefixtures("recordings")
def test_other_commands_find_it_as_well(hmcs: Run, model: str, tmp_path: Path) -> None:
    said = "take-2: out/up/recordings/take-2.mcap\n"
    for words in (
        ("segment", "take-2", "--model", model),
        ("import", "take-2", "--to", "csv"),
        ("task", "check", "lines-through-obstacles", "take-2"),
        ("train", "lines-through-obstacles", "take-2", "--output", "n.hmcs"),
        ("replay", "take-2", "--model", model),
    ):
        assert said in hmcs(*words).stderr, words
    (file,) = (tmp_path / "csv").iterdir()
    assert len(read_csv(file).time_s) > 100


def test_a_file_here_goes_before_and_its_ending_may_be_left_out(
    hmcs: Run, recordings: Path, tmp_path: Path
) -> None:
    shutil.copy(recordings / "take-1.mcap", tmp_path / "take-2.mcap")
    assert hmcs("inspect", "take-2.mcap").stderr == ""
    assert hmcs("inspect", "take-2").stderr == "take-2: take-2.mcap\n"
    assert hmcs("inspect", "out/up/recordings/take-1").stderr.endswith("recordings/take-1.mcap\n")


def test_another_folder_of_the_stack_is_searched_where_it_is_named(
    hmcs: Run, recordings: Path, tmp_path: Path
) -> None:
    recordings.parent.rename(tmp_path / "mine")
    assert hmcs("inspect", "take-1").returncode == 2
    done = hmcs("inspect", "take-1", "--folder", "mine")
    assert done.stderr == "take-1: mine/recordings/take-1.mcap\n"


@pytest.mark.usefixtures("recordings")
@pytest.mark.parametrize("command", ["inspect", "label", "check", "export --to tables"])
@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("tak-1", "no such file here or in out/up/recordings, did you mean take-1 or take-2?"),
        ("tkae-2.mcap", "no such file here or in out/up/recordings, did you mean take-2"),
        ("other", "no such file here or in out/up/recordings (there are take-1, take-2)"),
        ("out/up/recordings/tke-2.mcap", "no such file, did you mean take-2"),
        ("nowhere/take-1", "no such file"),
    ],
)
def test_an_unknown_name_is_refused_with_those_that_are_near(
    hmcs: Run, command: str, name: str, says: str
) -> None:
    word, *options = command.split()
    done = hmcs(word, name, *options)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"hmcs: {name}: {says}")
    assert done.stderr.count("\n") == 1


def test_nothing_is_offered_where_there_is_nothing(hmcs: Run) -> None:
    assert (
        hmcs("inspect", "take").stderr == "hmcs: take: no such file here or in out/up/recordings\n"
    )


def test_demonstrations_of_every_kind_are_offered(hmcs: Run, tmp_path: Path) -> None:
    write_csv(tmp_path / "reach.csv", performed(1))
    assert "did you mean reach.csv?" in hmcs("check", "raech.csv").stderr


def test_every_command_that_takes_a_recording_can_be_given_the_folder(hmcs: Run) -> None:
    for words in (
        "inspect",
        "label",
        "export",
        "replay",
        "check",
        "segment",
        "import",
        "train",
        "task check",
        "up",
    ):
        assert "--folder" in hmcs(*words.split(), "--help").stdout
