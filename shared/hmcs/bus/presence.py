"""Who is there, by the liveliness tokens that are there.

Anybody may show a token of any name; one with an impossible name is no process.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from hmcs.bus.keys import PREFIX, KeyNameError, Keys, Member, is_name


class Present(NamedTuple):
    """The processes that tokens stand for."""

    members: tuple[Member, ...]
    """Sorted, each once."""
    tokens: tuple[str, ...]
    """Their tokens, sorted."""
    strangers: tuple[str, ...]
    """Tokens that no process can show, sorted."""


def is_token(keys: Keys, token: str) -> bool:
    """Return whether a key is that of a presence or member token of the cell."""
    try:
        keys.member_of(token)
    except KeyNameError:
        return False
    return all(is_name(chunk) for chunk in token.removeprefix(f"{PREFIX}/").split("/"))


def present(keys: Keys, tokens: Iterable[str]) -> Present:
    """Return the processes that presence or member tokens stand for."""
    shown = set(tokens)
    possible = {token for token in shown if is_token(keys, token)}
    return Present(
        members=tuple(sorted({keys.member_of(token) for token in possible})),
        tokens=tuple(sorted(possible)),
        strangers=tuple(sorted(shown - possible)),
    )
