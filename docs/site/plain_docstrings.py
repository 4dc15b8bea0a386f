"""Docstrings here are plain prose: backticks, `*emphasis*`, lists and paragraphs mean something.

Autodoc reads reStructuredText, in which `*`, `|` and a trailing `_` mean something as well; all of
them stand in formulas. They are escaped, and `q_1` is set with a subscript.
"""

from __future__ import annotations

import re

_LITERAL = re.compile(r"(``.+?``|`[^`]+`|(?<![\w*])\*[A-Za-z][A-Za-z -]*\*(?![\w*]))")
"""What keeps its meaning: literals and emphasis."""
_NAME = re.compile(r"`[A-Za-z_][\w.]*`")
_MARKUP = re.compile(r"([\\*|]|(?<=\w)_(?![\w{]))")
_SUBSCRIPT = re.compile(r"(?<![^\W\d_])([^\W\d_][\u0300-\u036f]?)_(?:\{([^}]+)\}|(\w+))")


def as_restructured_text(lines: list[str]) -> list[str]:
    """Return the lines of a docstring as reStructuredText that looks the same."""
    return _outside_literals("\n".join(lines)).split("\n")


def _outside_literals(text: str) -> str:
    # Splitting by a pattern with a group leaves the literals at the odd places.
    pieces = _LITERAL.split(text)
    pieces[::2] = [_SUBSCRIPT.sub(_subscript, _MARKUP.sub(r"\\\1", each)) for each in pieces[::2]]
    pieces[1::2] = [each if _NAME.fullmatch(each) else _literal(each) for each in pieces[1::2]]
    return "".join(pieces)


def _subscript(found: re.Match[str]) -> str:
    base, braced, plain = found.groups()
    return rf"{base}\ :sub:`{braced or plain}`\ "


def _literal(piece: str) -> str:
    return piece if piece.startswith("*") else f"``{piece.strip('`')}``"
