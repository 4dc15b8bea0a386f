"""Who was let in, and who tried to be: sessions, and wrong tokens by where they came from.

Functions of time; both keep a bounded number of things whatever anybody sends.
"""

from __future__ import annotations

import hmac
import secrets
from collections import OrderedDict
from hashlib import sha256
from ipaddress import IPv6Network
from typing import NamedTuple

from hmcs_console.serving.places import address_of

LASTS_S = 12 * 3600.0
"""A session; a page that is open goes on."""
MOST_SESSIONS = 64
MOST_SOURCES = 1024
"""Addresses whose wrong tokens are remembered."""
FREE_TRIES = 3
"""Wrong tokens of one address that cost no time."""
LONGEST_WAIT_S = 300.0
_MOST_DOUBLED = 10
_FORGIVEN_S = 3600.0
_SITE_BITS = 64
"""Of an IPv6 address; who has one of a network has all of it."""


class Sessions:
    """Secrets of those who brought the token, each known for a while."""

    def __init__(self) -> None:
        self._until_s: OrderedDict[bytes, float] = OrderedDict()
        """By what is made of the secret, so that comparing tells nothing of it."""

    def begin(self, now_s: float) -> str:
        """Return the secret of a new session; of too many the oldest ends."""
        secret = secrets.token_urlsafe(32)
        if len(self._until_s) >= MOST_SESSIONS:
            self._until_s.popitem(last=False)
        self._until_s[_digest(secret)] = now_s + LASTS_S
        return secret

    def known(self, secret: str, now_s: float) -> bool:
        """Whether a secret is that of a session which has not ended."""
        return now_s < self._until_s.get(_digest(secret), now_s)


class _Tries(NamedTuple):
    wrong: int
    at_s: float
    wait_until_s: float


class Tries:
    """Wrong tokens by the address they came from: each one more costs twice the time."""

    def __init__(self) -> None:
        self._of: OrderedDict[str, _Tries] = OrderedDict()
        """The one that tried longest ago first."""

    def wait_s(self, address: str, now_s: float) -> float:
        """Return how long an address has to wait before its next token is looked at."""
        tries = self._of.get(source_of(address))
        return 0.0 if tries is None else max(0.0, tries.wait_until_s - now_s)

    def failed(self, address: str, now_s: float) -> int:
        """Take in a wrong token; return how many there were of its address."""
        source = source_of(address)
        before = self._of.pop(source, None)
        wrong = 1
        if before is not None and now_s - before.at_s < _FORGIVEN_S:
            wrong += before.wrong
        doubled = min(wrong - FREE_TRIES, _MOST_DOUBLED)
        wait_s = 0.0 if doubled < 0 else min(2.0**doubled, LONGEST_WAIT_S)
        if len(self._of) >= MOST_SOURCES:
            self._of.popitem(last=False)
        self._of[source] = _Tries(wrong, now_s, now_s + wait_s)
        return wrong

    def succeeded(self, address: str) -> None:
        """Take in the right token."""
        self._of.pop(source_of(address), None)


def source_of(address: str) -> str:
    """Return what the tries of an address are counted by: itself, or its IPv6 network."""
    found = address_of(address.partition("%")[0])
    if found is None or found.version == 4:
        return str(found or address)
    return str(IPv6Network((int(found) >> _SITE_BITS << _SITE_BITS, _SITE_BITS)))


def same(given: str, token: str) -> bool:
    """Whether two texts are the same, in a time that tells nothing of either."""
    return hmac.compare_digest(_digest(given), _digest(token))


def _digest(text: str) -> bytes:
    return sha256(text.encode("utf-8", "surrogateescape")).digest()
