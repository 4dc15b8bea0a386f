"""Text from elsewhere, made fit to be shown: on a page, in a report, a figure, a log line.

A name, a reason or a path that a message or a file brings may hold anything: markup that runs a
program in a browser, marks that turn the direction of reading around, control characters that a
terminal obeys, a million letters. Whatever shows such text takes it from a function of this module.
"""

from __future__ import annotations

import html
import re
import string
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Self, SupportsIndex

LONGEST, LONGEST_IN_REPORT = 500, 10_000
"""Characters of a text that are shown, and of one in a report, which may be a paragraph."""

_CUT = "…"
_MOST_MARKS = 3
"""Marks that one letter may bear: a pile of them covers the lines above and below."""
_COLOR = re.compile("#[0-9a-fA-F]{6}")
_ADDRESS = re.compile("(/[A-Za-z0-9._-]{1,80}){1,8}")
_WORD_JOINER = "\u2060"
# Markdown makes a link of each of them in running text, even where it was written as entities.
_LINK = re.compile(r"https?(?=://)|www(?=\.)|@", re.IGNORECASE)
# What begins, ends or divides something in markdown; a few characters only in certain places.
_ACTIVE = re.compile(
    r"[!#$&*<=>@[\\\]^`{|}~]|(?<![^\W_])_|_(?![^\W_])|[-+](?![^\W_])|^\d+[.)](?![^\W_])|^ | $"
)


def plain(text: str, longest: int = LONGEST) -> str:
    """Return a text as one line of characters that can be seen, cut after `longest`.

    Blanks of all kinds, line ends among them, become spaces. What else has no shape of its own,
    such as control characters and marks for the direction of reading, is written as its escape,
    e.g. `\\x1b`; of marks on one letter the first three stay.
    """
    shown = text[: longest + 1]
    if not (shown.isascii() and shown.isprintable()):
        shown = "".join(_visible(shown))
    return shown if len(shown) <= longest else shown[: longest - len(_CUT)] + _CUT


def as_html(text: str, longest: int = LONGEST_IN_REPORT) -> str:
    """Return a text to stand in HTML, between tags or in a quoted attribute."""
    return html.escape(plain(text, longest))


def as_figure(text: str, longest: int = LONGEST) -> str:
    """Return a text to stand in a figure of matplotlib, where dollar signs enclose formulas."""
    return plain(text, longest).replace("$", r"\$")


def as_markdown(text: str, longest: int = LONGEST) -> str:
    """Return a text to stand in markdown, HTML and expressions in braces among it, as it reads.

    No address in it becomes a link: an invisible joiner stands within.
    """
    unlinked = _LINK.sub(lambda found: found[0] + _WORD_JOINER, plain(text, longest))
    return _ACTIVE.sub(lambda found: f"{found[0][:-1]}&#{ord(found[0][-1])};", unlinked)


class Markdown(str):
    """Markdown whose marks are its author's own: `format` and `join` escape what is put into it."""

    __slots__ = ()

    def format(self, *args: object, **kwargs: object) -> Self:
        """Return it with its fields filled; only Markdown goes in as it is."""
        return type(self)(_ESCAPING.vformat(self, args, kwargs))

    def join(self, parts: Iterable[str], /) -> Self:
        """Return parts with it between them; only Markdown goes in as it is."""
        return type(self)(super().join(map(_escaped, parts)))

    def __add__(self, other: str, /) -> Self:
        return type(self)(super().__add__(_escaped(other)))

    def __mod__(self, value: Any, /) -> Self:
        raise TypeError("Markdown is filled with `format`")

    def __mul__(self, count: SupportsIndex, /) -> Self:
        return type(self)(super().__mul__(count))


def colored_dot(color: str) -> Markdown:
    """Return a dot in a color, `#rrggbb` in hexadecimal; ValueError for anything else."""
    if not _COLOR.fullmatch(color):
        raise ValueError(f"{color!r}: expected a color as #rrggbb")
    return Markdown(f'<span style="color:{color.lower()}">●</span>')


def linked(text: str, address: str) -> Markdown:
    """Return a text that leads to an address of the same server, in a window of its own.

    ValueError for anything but a path of letters, digits, `/`, `.`, `_` and `-`.
    """
    if not _ADDRESS.fullmatch(address):
        raise ValueError(f"{address!r}: expected a path, e.g. /reports/first.html")
    return Markdown(
        f'<a href="{address}" target="_blank" rel="noopener noreferrer">{as_markdown(text)}</a>'
    )


class _Escaping(string.Formatter):
    def get_field(
        self, field_name: str, args: Sequence[Any], kwargs: Mapping[str, Any]
    ) -> tuple[Any, Any]:
        """Take arguments alone: nothing is looked up in them."""
        key = int(field_name) if field_name.isdigit() else field_name
        return self.get_value(key, args, kwargs), key

    def format_field(self, value: Any, format_spec: str) -> str:
        """Escape whatever is no number and no Markdown."""
        if isinstance(value, Markdown):
            return value
        formatted = str(super().format_field(value, format_spec))
        return formatted if isinstance(value, int | float) else as_markdown(formatted)


_ESCAPING = _Escaping()


def _escaped(text: str) -> str:
    return text if isinstance(text, Markdown) else as_markdown(text)


def _visible(text: str) -> Iterable[str]:
    marks = 0
    for character in text:
        marks = marks + 1 if unicodedata.category(character) in ("Mn", "Me") else 0
        if marks > _MOST_MARKS:
            continue
        if character.isspace():
            yield " "
        elif character.isprintable():
            yield character
        else:
            yield character.encode("unicode_escape").decode()
