"""Errors every part of the software may raise, whether it knows the wire or not."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pydantic import ValidationError


class UserError(Exception):
    """A mistake of the user; its message says what was wrong, where, what was expected, what to do.

    A program that ends with one prints the message alone and exits with code 2.
    """


class NothingToDoError(Exception):
    """What a process is for is not wanted as it was started; its message says why.

    A service that starts with one logs the message and exits with code 0.
    """


def first_problem(error: ValidationError) -> tuple[str, str]:
    """Return the first field that is wrong, names joined by dots where they nest, and why."""
    first = error.errors(include_url=False, include_input=False)[0]
    return ".".join(map(str, first["loc"])), first["msg"]
