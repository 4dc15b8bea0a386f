"""Numbers, and what stands between them, as people and programs write them in text files."""

from __future__ import annotations

import math
import re

LONGEST = 64
"""Characters; what is longer is no number that somebody measured."""
_SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "bars"}
_NO_NUMBER = re.compile(r"[+-]?(?:nan|inf|infinity)", re.IGNORECASE)
_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")


def number_in(text: str) -> float:
    """Return the number a text is, with blanks around it or not.

    Raises ValueError, saying what it is and what was expected, for anything but decimal digits with
    a point and an exponent, such as the `1_0`, `nan`, `infinity` and digits of other scripts that
    `float` reads as well, and for a number too large to be one.
    """
    written = text.strip(" \t")
    if _NO_NUMBER.fullmatch(written):
        raise ValueError(f"{written}, expected a finite number")
    if len(written) > LONGEST or not _NUMBER.fullmatch(written):
        raise ValueError(f"{written[:32]!r}, expected a number, e.g. 0.52 or -1.2e-3")
    number = float(written)
    if not math.isfinite(number):
        raise ValueError(f"{written}, expected a finite number")
    return number


def separator_in(header: str) -> str | None:
    """Return what separates the columns of a header instead of commas; None where nothing does."""
    return next((name for mark, name in _SEPARATORS.items() if mark in header), None)
