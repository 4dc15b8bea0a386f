"""Errors every part of the software may raise, whether it knows the wire or not."""

from __future__ import annotations


class UserError(Exception):
    """A mistake of the user; its message says what was wrong, where, what was expected, what to do.

    A program that ends with one prints the message alone and exits with code 2.
    """
