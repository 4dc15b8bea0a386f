"""The figures there are. Adding one is a function that draws it and an entry in its chapter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hmcs.errors import UserError
from hmcs.task.values import unknown_name_message
from hmcs_laboratory.figures.catalog.beyond import BEYOND
from hmcs_laboratory.figures.catalog.chapter2 import CHAPTER_2
from hmcs_laboratory.figures.catalog.chapter3 import CHAPTER_3
from hmcs_laboratory.figures.catalog.chapter4 import CHAPTER_4
from hmcs_laboratory.figures.figure import Figure

FIGURES: tuple[Figure[Any], ...] = (*CHAPTER_2, *CHAPTER_3, *CHAPTER_4, *BEYOND)


def find_figures(numbers: Sequence[str]) -> tuple[Figure[Any], ...]:
    """Return the figures of those numbers, in the order of `FIGURES`; all for none.

    Raises UserError naming all there are for a number that is none.
    """
    known = [figure.number for figure in FIGURES]
    for number in numbers:
        if number not in known:
            raise UserError(unknown_name_message("figure", number, known))
    return tuple(figure for figure in FIGURES if not numbers or figure.number in numbers)
