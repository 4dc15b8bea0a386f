"""`hmcs label`: labels shown and set; a mistake is one message, and nothing is written."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from hmcs.recordings.labels import labels_beside, labels_of
from hmcs.recordings.reading import read
from hmcs_local.command import main
from support.recordings import Maker, hand_of

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def take(tmp_path: Path) -> Path:
    return Maker(tmp_path / "takes").write(list(hand_of(("lift", "carry"), 100)))


@pytest.fixture
def hmcs(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Run:
    def run(*words: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["hmcs", *map(str, words)])
        monkeypatch.setenv("COLUMNS", "120")
        with pytest.raises(SystemExit) as ended:
            main()
        said = capfd.readouterr()
        return int(ended.value.code or 0), said.out, said.err

    return run


def states(take: Path) -> list[str]:
    return [label.state for label in labels_of(read(take))]


def rows(out: str) -> list[list[str]]:
    """The cells of a table that was printed."""
    lines = [re.split(r"  +", line.strip()) for line in out.splitlines()]
    head = next(number for number, cells in enumerate(lines) if "state" in cells)
    return [cells for cells in lines[head + 1 :] if len(cells) == len(lines[head])]


def test_labels_are_shown_with_how_they_were_set(hmcs: Run, take: Path) -> None:
    code, out, _ = hmcs("label", take)
    assert code == 0
    found = rows(out)
    assert [row[2:] for row in found] == [
        ["lift", "said meanwhile"],
        ["carry", "said meanwhile"],
    ]
    assert found[0][1] == found[1][0]
    assert not labels_beside(take).exists()


def test_a_label_is_set_over_what_there_is(hmcs: Run, take: Path) -> None:
    before = take.read_bytes()
    code, out, _ = hmcs("label", take, "--set", "0.5-0.8=carry", "--set", "0.6 - 0.7 = lift")
    assert code == 0
    assert "set afterwards" in out
    assert states(take) == ["lift", "carry", "lift", "carry", "lift", "carry"]
    assert "0.6,0.7,lift\n" in labels_beside(take).read_text()
    assert take.read_bytes() == before


def test_labels_are_cleared_before_new_ones_are_set(hmcs: Run, take: Path) -> None:
    assert hmcs("label", take, "--clear", "--set", "0.5-0.8=carry")[0] == 0
    written = labels_beside(take).read_text()
    assert written.startswith("begin_s,end_s,state\n0.5,0.8,carry\n# of the first ")
    code, out, _ = hmcs("label", take, "--clear")
    assert code == 0
    assert "no labels" in out
    assert states(take) == []


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--set", "carry"), "--set carry: write BEGIN-END=STATE in seconds"),
        (("--set", "1-=carry"), "write BEGIN-END=STATE"),
        (("--set", "0.8-0.5=carry"), "let it begin before it ends"),
        (("--set", "0.5-99=carry"), "outside of the recording, which lasts 2."),
        (("--set", "0.5-0.8="), "give it the name of a state"),
        (
            ("--set", "0.5-0.8=cary", "--task", "lines-through-obstacles"),
            "'cary' from 0.500 s to 0.800 s: unknown state of task lines-through-obstacles 'cary', "
            "did you mean carry?",
        ),
        (("--task", "no-such-task"), "no-such-task"),
    ],
)
def test_a_mistake_ends_with_code_2_and_nothing_is_written(
    hmcs: Run, take: Path, words: tuple[str, ...], says: str
) -> None:
    code, _, error = hmcs("label", take, *words)
    assert code == 2
    assert says in error
    assert "Traceback" not in error
    assert not labels_beside(take).exists()


def test_a_file_that_is_no_recording_is_reported(hmcs: Run, tmp_path: Path) -> None:
    (tmp_path / "no.mcap").write_text("nothing of the kind")
    code, _, error = hmcs("label", tmp_path / "no.mcap")
    assert code == 2
    assert "no.mcap: no recording" in error


def test_labels_there_are_already_are_held_to_the_task(hmcs: Run, take: Path) -> None:
    assert hmcs("label", take, "--task", "lines-through-obstacles")[0] == 0
    assert hmcs("label", take, "--set", "0.1-0.2=fly")[0] == 0
    code, _, error = hmcs("label", take, "--task", "lines-through-obstacles")
    assert code == 2
    assert "'fly' from 0.100 s to 0.200 s" in error


@pytest.mark.parametrize("name", ["[red]", "[/x]", "a\x1b[2Jb", "\u202egnp"])
def test_names_in_a_recording_are_text_and_nothing_a_terminal_obeys(
    hmcs: Run, tmp_path: Path, name: str
) -> None:
    take = Maker(tmp_path / "takes").write(list(hand_of((name, "carry"), 100)))
    shown = name.encode("unicode_escape").decode()
    for word in ("label", "inspect"):
        _, out, err = hmcs(word, take)
        assert not err
        assert out.replace("\n", "").isprintable()
        assert shown in out
    _, out, _ = hmcs("inspect", take, "--json")
    assert out.removesuffix("\n").isprintable()
    assert json.loads(out)["labels"] == [name, "carry"]


def test_an_error_that_quotes_a_file_is_text(hmcs: Run, tmp_path: Path) -> None:
    code, _, err = hmcs("inspect", tmp_path / "\x1b[2Jnone.mcap")
    assert code == 2
    assert "\\x1b[2Jnone.mcap" in err
    assert err.replace("\n", "").isprintable()


def test_labels_of_another_recording_are_reported_and_kept_aside(hmcs: Run, take: Path) -> None:
    assert hmcs("label", take, "--set", "0-1=old")[0] == 0
    take.unlink()
    Maker(take.parent).write(list(hand_of(("carry", "lift"), 100)))
    code, out, _ = hmcs("label", take)
    assert code == 0
    assert "note: the labels in take.labels.csv are of another recording" in out
    assert [row[2] for row in rows(out)] == ["carry", "lift"]
    assert "take.labels.csv are of another recording" in hmcs("inspect", take)[1]
    code, out, _ = hmcs("label", take, "--set", "0-1=lift")
    assert code == 0
    assert "the labels of another recording are in" in out
    assert "old" in (take.parent / "take.labels-of-another-1.csv").read_text()
    assert states(take)[0] == "lift"


def test_labels_in_milliseconds_are_reported_as_such(hmcs: Run, take: Path) -> None:
    labels_beside(take).write_text("begin_s,end_s,state\n0,1000,lift\n1000,2000,carry\n")
    code, _, error = hmcs("label", take)
    assert code == 2
    assert "read like milliseconds: divide them by 1000" in error


def test_a_label_beyond_the_end_is_reported(hmcs: Run, take: Path) -> None:
    labels_beside(take).write_text("begin_s,end_s,state\n0,2.9,lift\n")
    code, out, _ = hmcs("label", take)
    assert code == 0
    assert "note: take.labels.csv:2: label 'lift' from 0.000 s to 2.900 s ends after" in out
