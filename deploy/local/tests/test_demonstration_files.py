from __future__ import annotations

from pathlib import Path

import pytest

from hmcs.errors import UserError
from hmcs_local import demonstration_files


def expanded(references: list[str]) -> list[str]:
    return list(demonstration_files.expanded(references, Path("out/up"), print))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("b.csv", "a.mcap", "a.labels.csv", "notes.txt", "c.csv"):
        (tmp_path / name).touch()
    (tmp_path / "more.csv").mkdir()
    return tmp_path


def test_a_folder_stands_for_its_demonstrations_and_not_for_labels(folder: Path) -> None:
    assert expanded([str(folder)]) == [str(folder / name) for name in ("a.mcap", "b.csv", "c.csv")]


def test_a_pattern_stands_for_the_files_named_like_it(folder: Path) -> None:
    assert expanded([str(folder / "[bc].csv")]) == [str(folder / "b.csv"), str(folder / "c.csv")]
    assert expanded([str(folder / "a*")]) == [str(folder / "a.mcap")]


def test_files_and_drawings_stay_as_they_are_in_their_order(folder: Path) -> None:
    named = [str(folder / "c.csv"), "lasa:GShape/1-5", str(folder / "b.csv")]
    assert expanded(named) == named


def test_a_file_whose_name_looks_like_a_pattern_is_that_file(folder: Path) -> None:
    odd = folder / "take [1].csv"
    odd.touch()
    assert expanded([str(odd)]) == [str(odd)]


@pytest.mark.parametrize("name", ["more.csv", "x*.csv"])
def test_nothing_found_is_an_error(folder: Path, name: str) -> None:
    with pytest.raises(UserError, match=r"no demonstration|no file is named like this"):
        expanded([str(folder / name)])
