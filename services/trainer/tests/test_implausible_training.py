"""What training and checking do with implausible files, and with one that comes twice."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs.motion.demonstrations import write_csv
from hmcs.recognition.segments import LearningError
from hmcs_trainer.training import checked, train
from support.carried import TASK, changed, shown


@pytest.fixture
def files(tmp_path: Path) -> list[str]:
    for folder, hand in (("one", shown(0)), ("two", shown(1)), ("three", shown(2))):
        (tmp_path / folder).mkdir()
        write_csv(tmp_path / folder / "take.csv", hand)
    (tmp_path / "task.yaml").write_text(TASK.model_dump_json())
    return [str(tmp_path / folder / "take.csv") for folder in ("one", "two", "three")]


def learned(files: list[str], tmp_path: Path, **more: bool) -> list[str]:
    said: list[str] = []
    train(str(tmp_path / "task.yaml"), files, tmp_path / "m.hmcs", progress=said.append, **more)
    return said


def test_files_of_one_name_are_distinguished_and_learned_from_each(
    files: list[str], tmp_path: Path
) -> None:
    write_csv(files[1], changed(shown(1), slice(10, 12), np.array([0, 0, 0.4])))
    with pytest.raises(LearningError) as caught:
        learned(files, tmp_path)
    assert str(caught.value).startswith(f"{files[1]}: at 0.100 s")
    assert not (tmp_path / "m.hmcs").exists()


def test_implausible_demonstrations_are_learned_from_on_request(
    files: list[str], tmp_path: Path
) -> None:
    write_csv(files[1], changed(shown(1), slice(10, 12), np.array([0, 0, 0.4])))
    with pytest.raises(LearningError, match="--accept-implausible"):
        learned(files, tmp_path)
    said = learned(files, tmp_path, accept_implausible=True)
    assert any("the hand jumps" in sentence for sentence in said)
    assert (tmp_path / "m.hmcs").exists()


@pytest.mark.parametrize("copied", [False, True])
def test_the_same_file_twice_counts_once_and_is_reported(
    files: list[str], tmp_path: Path, copied: bool
) -> None:
    again = files[0]
    if copied:
        again = str(tmp_path / "copy.csv")
        Path(again).write_bytes(Path(files[0]).read_bytes())
    said = learned([*files, again], tmp_path)
    (sentence,) = (s for s in said if "the same samples as" in s)
    assert "left out" in sentence
    assert "up: 3 demonstrations" in said


def test_states_are_not_found_in_what_no_hand_made(files: list[str], tmp_path: Path) -> None:
    write_csv(files[1], changed(shown(1), slice(10, 12), np.array([0, 0, 0.4])))
    with pytest.raises(LearningError, match="jumps"):
        learned(files, tmp_path, find_states=True)


def test_checking_tells_what_training_would_tell(files: list[str]) -> None:
    said: list[str] = []
    assert checked(TASK, files, said.append) == (3, 0)
    assert said == []
    write_csv(files[1], changed(shown(1), slice(10, 12), np.array([0, 0, 0.4])))
    with pytest.raises(UserError, match=r"two.take.csv: at 0.100 s the hand jumps"):
        checked(TASK, files, said.append)
