"""Tables at any width, on a terminal and through a pipe: nothing of them is cut off."""

from __future__ import annotations

import io
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console
from rich.text import Text

from hmcs.recognition.registry import kinds
from hmcs_local.command import main
from hmcs_local.tables import screen, show_table
from support.recordings import Maker, hand_of

LINES = "━┃│╇╈┡┩└┘┴┏┓┳─"
CELLS = st.text("abc[]:/é漢 ", max_size=30)
TABLES = st.integers(1, 6).flatmap(
    lambda columns: st.tuples(
        st.lists(CELLS, min_size=columns, max_size=columns, unique=True),
        st.lists(st.lists(CELLS, min_size=columns, max_size=columns), min_size=1, max_size=5),
    )
)


def letters(*texts: str) -> Counter[str]:
    return Counter("".join(texts).translate({ord(each): None for each in LINES + " \n"}))


@given(TABLES, st.integers(10, 250), st.booleans())
def test_every_letter_of_every_cell_is_shown_within_the_width(
    table: tuple[list[str], list[list[str]]], width: int, terminal: bool
) -> None:
    columns, rows = table
    out = io.StringIO()
    console = Console(file=out, width=width, force_terminal=terminal, color_system=None)
    show_table(console, "title", columns, rows, columns[1:2])
    shown = out.getvalue()
    assert letters(*(cell for row in rows for cell in row)) <= letters(shown)
    assert all(Text(line.rstrip()).cell_len <= width for line in shown.splitlines())
    assert "\x1b" not in shown


def test_cells_of_a_column_stand_below_each_other_where_there_is_room() -> None:
    out = io.StringIO()
    rows = [("first", "1", "yes"), ("a longer one", "100", "no")]
    show_table(Console(file=out, width=40), "", ("name", "count", "good"), rows, ("count",))
    assert [line.rstrip() for line in out.getvalue().splitlines()] == [
        "name          count  good",
        "first             1  yes",
        "a longer one    100  no",
    ]


def test_where_there_is_no_room_each_row_has_lines_of_its_own_without_what_is_empty() -> None:
    out = io.StringIO()
    rows = [("first", "1", "", "yes"), ("a much longer name", "100", "no", "no")]
    show_table(Console(file=out, width=20), "two", ("name", "count", "", "good"), rows)
    assert out.getvalue().splitlines() == [
        "two",
        "first",
        "  count: 1",
        "  good: yes",
        "a much longer name",
        "  count: 100  no",
        "  good: no",
    ]


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Return what a command prints into a pipe; COLUMNS says how wide, if any number is given."""

    def run(words: list[str], width: int | None) -> str:
        monkeypatch.setattr(sys, "argv", ["hmcs", *words])
        monkeypatch.delenv("COLUMNS", raising=False)
        if width is not None:
            monkeypatch.setenv("COLUMNS", str(width))
        with pytest.raises(SystemExit):
            main()
        said = capfd.readouterr()
        assert said.err == ""
        return said.out

    return run


@pytest.mark.parametrize(
    ("command", "first"),
    [
        ("recognizers", "recognizer"),
        ("devices", "device"),
        ("robot list", "robot"),
        ("label", "from,"),
        ("inspect", "key"),
    ],
)
def test_a_command_shows_the_same_words_at_any_width_and_nothing_a_terminal_obeys(
    shown: Callable[..., str], tmp_path: Path, command: str, first: str
) -> None:
    words = command.split()
    if command in ("label", "inspect"):
        take = Maker(tmp_path / "takes").write(list(hand_of(("lift", "carry"), 100)))
        words.append(str(take))
    through_a_pipe = shown(words, None)
    for width in (40, 80, 200):
        out = shown(words, width)
        together = "".join(out.split())
        # Rows in lines of their own begin with what they are, without the name of that column.
        assert {word for word in through_a_pipe.split() if word not in together} <= {first}
        assert out.replace("\n", "").isprintable()
        assert "…" not in out


def test_through_a_pipe_every_row_is_one_line(shown: Callable[..., str]) -> None:
    lines = shown(["recognizers"], None).splitlines()
    assert [line.split()[0] for line in lines[1:]] == [kind.name for kind in kinds()]
    begins = lines[0].index("what it does")
    assert all(line[begins - 1] == " " != line[begins] for line in lines)


def test_a_terminal_has_its_own_width(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "44")
    assert screen().width == 44
