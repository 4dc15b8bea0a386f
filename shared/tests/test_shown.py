from __future__ import annotations

import html.parser
import re
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.shown import (
    LONGEST,
    Markdown,
    as_figure,
    as_html,
    as_markdown,
    colored_dot,
    linked,
    plain,
)

TEXTS = st.text(st.characters(exclude_categories=()), max_size=40)
JOINER = "\u2060"


def read_back(markdown: str) -> str:
    """What a reader of markdown sees of a text that holds nothing but entities and letters."""
    return re.sub(r"&#(\d+);", lambda found: chr(int(found[1])), markdown).replace(JOINER, "")


@given(TEXTS)
def test_a_shown_text_is_one_line_of_what_can_be_seen(text: str) -> None:
    assert plain(text).isprintable()
    assert not set(plain(text)) & set("\u200b\u200f\u202e\u2066\ufeff\u00ad")


@given(st.text(st.characters(categories=("L", "N", "P")), max_size=60))
def test_a_harmless_text_is_shown_as_it_is(text: str) -> None:
    assert plain(text) == text
    assert read_back(as_markdown(text)) == text


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("\x1b[2Jx", r"\x1b[2Jx"),
        ("two\r\nlines\tand\u2028more", "two  lines and more"),
        ("in\u202eorder", r"in\u202eorder"),
        ("\ud800", r"\ud800"),
        ("a\u00a0b", "a b"),
        ("Grüße, 世界", "Grüße, 世界"),
    ],
)
def test_what_cannot_be_seen_is_shown_as_its_escape(text: str, shown: str) -> None:
    assert plain(text) == shown


def test_a_pile_of_marks_on_a_letter_is_cut() -> None:
    shown = plain("e" + "\u0301" * 100 + "f")
    assert sum(map(unicodedata.combining, shown)) == 3 * unicodedata.combining("\u0301")
    assert shown.endswith("f")


@given(st.text(st.characters(exclude_categories=())), st.integers(1, 60))
def test_a_text_is_never_longer_than_wanted(text: str, longest: int) -> None:
    assert len(plain(text, longest)) <= longest


def test_a_cut_text_says_so() -> None:
    assert plain("x" * 2000) == "x" * (LONGEST - 1) + "…"
    assert plain("\x00" * 2000).endswith("…")


@given(TEXTS)
def test_in_html_a_text_is_text_between_tags_and_in_attributes(text: str) -> None:
    found: list[object] = []

    class Reader(html.parser.HTMLParser):
        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            found.append((tag, attrs))

        def handle_data(self, data: str) -> None:
            found.append(data)

    reader = Reader()
    reader.feed(f'<p title="{as_html(text)}">{as_html(text)}</p>')
    reader.close()
    assert found[0] == ("p", [("title", plain(text))])
    assert "".join(map(str, found[1:])) == plain(text)


@given(TEXTS)
def test_in_markdown_a_text_holds_nothing_that_is_a_mark(text: str) -> None:
    written = as_markdown(text)
    assert read_back(written) == plain(text)
    without = re.sub(r"&#\d+;", "", written)
    assert not set(without) & set("*`~<>[]{}!#=|\\^&@$")


@pytest.mark.parametrize("text", ["- x", "+ x", "1. x", "12) x", "---", "-", "a -", " x", "x "])
def test_what_begins_something_in_a_line_of_markdown_does_not(text: str) -> None:
    assert re.sub(r"&#\d+;", "", as_markdown(text)) != text
    assert read_back(as_markdown(text)) == text


@pytest.mark.parametrize(
    "address",
    ["http://evil.example/x", "HTTPS://evil.example", "www.evil.example", "a.b@evil.example"],
)
def test_in_markdown_an_address_is_no_link(address: str) -> None:
    seen = re.sub(r"&#(\d+);", lambda found: chr(int(found[1])), as_markdown(f"see {address}"))
    # What remark-gfm looks for in text, after entities have become characters.
    assert not re.search(r"(https?://|www(?=\.))([-.\w]+)([^ \t\r\n]*)", seen, re.IGNORECASE)
    assert not re.search(r"([-.\w+]+)@([-\w]+(?:\.[-\w]+)+)", seen)
    assert address in seen.replace(JOINER, "")


def test_in_a_figure_dollar_signs_enclose_no_formula() -> None:
    from matplotlib import cbook

    for text in ("$x_1^{$", "a $ b", "$\\frac{1}$", "\\$x$", "$" * 7):
        assert not cbook.is_math_text(as_figure(text))


def test_only_the_author_of_markdown_sets_its_marks() -> None:
    reported = Markdown("**{}** {:.0%} {name}: {}").format(
        "<b>*", 0.5, Markdown("*so*"), name="{0}"
    )
    assert reported == "**&#60;b&#62;&#42;** 50% &#123;0&#125;: *so*"
    assert Markdown("  \n").join(["a*", Markdown("*b*")]) == "a&#42;  \n*b*"
    assert Markdown("*a*") + "*b*" == "*a*&#42;b&#42;"
    assert isinstance(Markdown("a") + "b", Markdown)


def test_a_template_looks_nothing_up_in_what_it_is_filled_with() -> None:
    with pytest.raises(KeyError):
        Markdown("{0.__class__}").format("x")
    with pytest.raises(TypeError):
        Markdown("%s") % "x"


@given(TEXTS, TEXTS)
def test_what_fills_a_template_comes_out_as_it_reads(one: str, other: str) -> None:
    reported = Markdown("{} and {other}").format(one, other=other)
    assert read_back(reported) == f"{plain(one)} and {plain(other)}"


def test_a_dot_has_a_color_and_nothing_else_gets_into_its_markup() -> None:
    assert colored_dot("#AA00ff") == '<span style="color:#aa00ff">●</span>'
    for color in ('#000000"><script>', "red", "#00000", "#0000000", ""):
        with pytest.raises(ValueError, match="expected a color as #rrggbb"):
            colored_dot(color)


def test_a_link_leads_to_an_own_address_alone_and_its_text_is_read() -> None:
    link = linked("a *b* www.x", "/reports/first_2.html")
    assert link.startswith('<a href="/reports/first_2.html" target="_blank" rel="noopener ')
    assert "&#42;b&#42;" in link
    assert Markdown("{}").format(link) == link
    for address in ("//evil.example", "https://x", "reports/x", "/a b", '/a"', "/a/", "/%2e", ""):
        with pytest.raises(ValueError, match="expected a path"):
            linked("x", address)
