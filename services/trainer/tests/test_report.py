"""The page beside a model shows names and texts as they read, whatever they are."""

from __future__ import annotations

import html.parser
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hmcs.shown import plain
from hmcs_trainer.report import write_report
from support.texts import HOSTILE

TEXTS = (*HOSTILE[::4], "$x_1^{$", "$a$", "</svg><script>top.ran=1</script>", '" onload="top.ran=1')


class Reader(html.parser.HTMLParser):
    """What stands on a page: its elements, and its words."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[str] = []
        self.words: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [f"{name}={value}" for name, value in attrs]

    def handle_data(self, data: str) -> None:
        self.words.append(data)


def read(path: Path) -> Reader:
    reader = Reader()
    reader.feed(path.read_text(encoding="utf-8"))
    reader.close()
    return reader


def written(path: Path, text: str) -> Reader:
    """The page of a model in which everything is called the same."""
    model: Any = SimpleNamespace(
        name=text,
        hash=text,
        recognizer=text,
        task=SimpleNamespace(name=text, states=()),
        demonstrations=(text, text),
        state_names=(text, "in"),
        gesteme_names=(text,),
        paths={text: SimpleNamespace(points=np.array([[0.0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0]]))},
        spreads={text: np.full(3, 0.005)},
    )
    judgment: Any = SimpleNamespace(left_out=0, confusion=np.array([[2, 1], [0, 3]]))
    found: Any = [SimpleNamespace(text=text)]
    write_report(path, model, judgment, [text], found)
    return read(path)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:Glyph")
def test_a_page_has_the_same_elements_whatever_things_are_called(tmp_path: Path) -> None:
    plainly = written(tmp_path / "plain.html", "name")
    inside = set(plainly.tags)
    for number, text in enumerate(TEXTS):
        page = written(tmp_path / f"{number}.html", text)
        assert set(page.tags) <= inside, text
        assert page.tags.count("li") == plainly.tags.count("li")
        assert not any("top.ran" in attribute for attribute in page.attributes)
        assert sum(plain(text) in word for word in page.words) >= 4, text


def test_a_name_that_is_no_formula_is_drawn(tmp_path: Path) -> None:
    written(tmp_path / "page.html", "$x_1^{$ costs 5 $")
