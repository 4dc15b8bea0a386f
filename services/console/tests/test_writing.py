"""Texts come onto the page by one module, and markdown is written by hand."""

from __future__ import annotations

import ast
import logging
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import hmcs_console
from hmcs.shown import Markdown
from hmcs_console.serving.server import Server
from hmcs_console.serving.writing import (
    MOST_CHOICES,
    NOTHING,
    Choice,
    add_words,
    shown_names,
    write,
)

PACKAGE = Path(hmcs_console.__file__).parent
SINKS = {
    *("add_markdown", "add_html", "add_dropdown", "add_notification", "add_label", "add_modal"),
    *("add_plotly", "add_image", "add_3d_gui_container", "set_panel_label"),
}
SET = {"content", "options", "label", "title", "body", "hint"}
ALLOWED = {
    "serving/writing.py": SINKS | SET,
    # What a handle is kept to, which is written by hand.
    "serving/page.py": {"add_dropdown"},
    # A sound of its own, without a word.
    "telling/sounds.py": {"add_html", "content"},
}


def sources() -> Iterator[tuple[str, ast.Module]]:
    for path in sorted(PACKAGE.rglob("*.py")):
        yield str(path.relative_to(PACKAGE)), ast.parse(path.read_bytes())


def test_one_module_alone_puts_texts_onto_the_page() -> None:
    found = []
    for name, module in sources():
        for node in ast.walk(module):
            used = set()
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                used = {node.func.attr} & SINKS
            elif isinstance(node, ast.Assign):
                targets = (target for target in node.targets if isinstance(target, ast.Attribute))
                used = {target.attr for target in targets} & SET
            found += [f"{name}: {what}" for what in used - ALLOWED.get(name, set())]
    assert found == []


def is_written_by_hand(node: ast.expr) -> bool:
    if isinstance(node, ast.IfExp):
        return is_written_by_hand(node.body) and is_written_by_hand(node.orelse)
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def test_markdown_is_made_of_what_stands_in_the_program_and_nothing_else() -> None:
    found = []
    for name, module in sources():
        for node in ast.walk(module):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Markdown":
                (text,) = node.args
                if not is_written_by_hand(text):
                    found.append(f"{name}:{node.lineno}")
    assert found == []


@pytest.fixture
def server() -> Iterator[Server]:
    made = Server(logging.getLogger("test"))
    yield made
    made.stop()


def test_a_text_is_written_as_it_reads_and_markdown_as_it_is_laid_out(server: Server) -> None:
    place = add_words(server.gui, "*a*")
    assert place.content == "&#42;a&#42;"
    write(place, Markdown("*a*"))
    assert place.content == "*a*"


@given(st.lists(st.text(min_size=1), max_size=8))
def test_names_in_a_list_are_distinguished_and_lead_to_what_they_are_of(names: list[str]) -> None:
    named = shown_names(names)
    assert list(named.values()) == list(dict.fromkeys(names))
    assert all(shown.isprintable() and shown not in ("", NOTHING) for shown in named)


def test_of_too_many_names_the_first_are_in_the_list() -> None:
    assert len(shown_names([f"name {number}" for number in range(100_000)])) == MOST_CHOICES


def test_a_choice_is_of_the_name_itself(server: Server) -> None:
    choice = Choice(server.gui, "State")
    assert (choice.chosen, choice.offered) == ("", (NOTHING,))
    evil = "a\u202eb"
    choice.offer([evil, "a\\u202eb", NOTHING], none_too=False)
    assert choice.offered == ("a\\u202eb", "a\\u202eb (2)", f"{NOTHING} (2)")
    assert choice.chosen == evil
    choice.choose(NOTHING)
    assert choice.chosen == NOTHING
    choice.offer([], none_too=False)
    assert (choice.chosen, choice.offered) == ("", (NOTHING,))
    choice.choose("not offered")
    assert choice.chosen == ""
