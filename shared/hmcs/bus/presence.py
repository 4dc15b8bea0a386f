"""Who is there, by the liveliness tokens that are there.

Anybody may declare a token of any name. Who reads tokens takes the processes they can stand for
from here; what bears an impossible name is no process, and is nobody's reason to end.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from hmcs.bus.keys import PREFIX, KeyNameError, Keys, Member, check_name

TOKEN = "token"
"""What tokens of impossible names are counted under, beside the schemas of refused messages."""


class Present(NamedTuple):
    """The processes that tokens stand for."""

    members: tuple[Member, ...]
    """Sorted, each once."""
    strangers: tuple[str, ...]
    """Keys of tokens that no process can have declared."""


def member_named(keys: Keys, token: str) -> Member | None:
    """Return the process a presence or member token stands for; None if its name is impossible."""
    try:
        for chunk in token.removeprefix(f"{PREFIX}/{keys.cell}/").split("/"):
            check_name("token", chunk)
        return keys.member_of(token)
    except KeyNameError:
        return None


def possible(member: Member) -> bool:
    """Return whether a process can be called so: an answer may say anything of its sender."""
    try:
        check_name("service", member.service)
        check_name("instance", member.instance)
    except KeyNameError:
        return False
    return True


def model_named(keys: Keys, token: str) -> str:
    """Return the model of a member token whose name is possible; empty for a presence token."""
    chunks = token.removeprefix(f"{PREFIX}/{keys.cell}/").split("/")
    return chunks[1] if chunks[0] == "model" else ""


def present(keys: Keys, tokens: Iterable[str]) -> Present:
    """Return the processes that presence or member tokens stand for."""
    named = {token: member_named(keys, token) for token in tokens}
    return Present(
        members=tuple(sorted({member for member in named.values() if member is not None})),
        strangers=tuple(sorted(token for token, member in named.items() if member is None)),
    )
