"""`hmcs import` and recordings of other programs where demonstrations are named."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs.motion.demonstrations import read_csv
from hmcs.recordings.foreign.choices import choices_of
from hmcs_local.demonstration_files import expanded
from hmcs_local.importing import import_as_csv
from support import foreign_files as made


def hmcs(*words: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "hmcs_local.command", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def imported(sources: list[str], to: Path) -> tuple[list[str], list[str]]:
    files = list[str]()
    notes = list(
        import_as_csv(expanded(sources, Path("out/up"), print), to, choices_of(), files.append)
    )
    return notes, files


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A bag of each kind and a data set of two episodes."""
    folder = tmp_path / "theirs"
    folder.mkdir()
    made.write_bag1(folder / "a.bag", made.poses_sent(made.ROS1))
    made.write_bag2(folder / "b", made.poses_sent())
    made.write_bag2(folder / "c", made.poses_sent(), "mcap")
    made.write_lerobot(folder / "d", [made.way(30), made.way(40)], "xyz")
    return folder


def test_a_folder_of_all_formats_becomes_csv_files(folder: Path, tmp_path: Path) -> None:
    notes, files = imported([str(folder)], tmp_path / "ours")
    names = ("a.csv", "b.csv", "c.csv", "d-0.csv", "d-1.csv")
    assert [Path(each.partition(": ")[0]).name for each in files] == list(names)
    assert len(notes) == 4
    for name in names[:3]:
        shown = read_csv(tmp_path / "ours" / name)
        np.testing.assert_array_equal(shown.positions, made.way())


def test_what_was_taken_stands_on_stderr_and_a_mistake_ends_with_2(
    folder: Path, tmp_path: Path
) -> None:
    done = hmcs("import", folder / "b", "--to", tmp_path / "one.csv")
    assert (done.returncode, done.stdout.count("\n")) == (0, 1)
    assert "motion of /tool_pose (geometry_msgs/msg/PoseStamped)" in done.stderr
    again = hmcs("import", folder / "b", "--to", tmp_path / "one.csv")
    assert (again.returncode, again.stdout) == (2, "")
    assert "is there already" in again.stderr
    cut = folder / "a.bag"
    cut.write_bytes(cut.read_bytes()[:2000])
    damaged = hmcs("import", cut, "--to", tmp_path / "two.csv")
    assert damaged.returncode == 2
    assert "rosbag reindex" in damaged.stderr
    assert "Traceback" not in damaged.stderr
    assert not (tmp_path / "two.csv").exists()


def test_several_demonstrations_need_a_folder(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="there are 2 demonstrations: name a folder"):
        imported([str(folder / "d")], tmp_path / "one.csv")
    assert not (tmp_path / "one.csv").exists()


def test_recordings_of_other_programs_are_checked_and_trained_from_as_they_are(
    folder: Path,
) -> None:
    done = hmcs("check", folder / "b")
    assert done.returncode == 0
    assert "0.30 × 0.10 × 0.05" in done.stdout


@pytest.mark.parametrize(
    ("library", "name", "extra"),
    [("rosbags", "b", "ros"), ("rosbags", "a.bag", "ros"), ("pyarrow", "d", "lerobot")],
)
def test_a_library_that_is_missing_is_named_with_its_extra(
    library: str, name: str, extra: str, folder: Path, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    for module in [each for each in sys.modules if each.partition(".")[0] == library]:
        monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(UserError, match=rf"pip install 'hmcs\[{extra}\]'"):
        imported([str(folder / name)], tmp_path / "ours")


@pytest.mark.parametrize("form", ["lerobot", "rosbag2"])
def test_what_is_exported_for_others_is_never_written_over(form: str, tmp_path: Path) -> None:
    from support.recordings import Maker, hand_of

    take = Maker(tmp_path / "r").write(list(hand_of(("go", "turn"), 60)))
    done = hmcs("export", take, "--to", tmp_path / "out", "--format", form)
    assert (done.returncode, done.stderr) == (0, "")
    again = hmcs("export", take, "--to", tmp_path / "out", "--format", form)
    assert again.returncode == 2
    assert "is there already" in again.stderr
