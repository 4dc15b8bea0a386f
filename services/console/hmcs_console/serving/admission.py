"""Who may open the page: decided from the head of an HTTP request and where it came from.

Who reaches the page can move the robot, so three things are kept out: people without the token,
pages of other sites in the operator's own browser, which could otherwise open a connection to a
loopback address, too, and names of other people's that lead to this machine.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from http.cookies import CookieError, SimpleCookie
from typing import NamedTuple
from urllib.parse import parse_qs, urlsplit

from hmcs_console.serving.places import Doors, is_of, place_of
from hmcs_console.serving.sessions import LASTS_S, Sessions, Tries, same

_REQUEST = re.compile(r"([A-Z]{1,20}) (/[!-~]*) HTTP/1\.[01]")
_FIELD = re.compile(r"([!#$%&'*+.^_`|~0-9A-Za-z-]+):[ \t]*([\t -~\x80-\xff]*)")
_ONCE = ("host", "origin", "cookie", "upgrade", "sec-websocket-key", "sec-websocket-version")
"""Headers that say too much to be believed where they are said twice."""


class Head(NamedTuple):
    """What an HTTP request says before its body."""

    method: str
    target: str
    """Path and query."""
    headers: Mapping[str, str]
    """By their names in lower case."""

    @property
    def path(self) -> str:
        """The target without its query."""
        return self.target.partition("?")[0]


class Verdict(NamedTuple):
    """What becomes of a request."""

    status: int | None
    """Of the HTTP answer; None hands the request on to the page."""
    reason: str = ""
    """In words, for the person at the browser."""
    headers: tuple[str, ...] = ()
    """Of the answer, `name: value`."""
    wrong_tokens: int = 0
    """How many its address has brought; 0 where it brought none this time."""


PASSED = Verdict(None)


def head_of(data: bytes) -> Head | None:
    """Return the head of an HTTP request up to its blank line; None where it is none."""
    request, *lines = data.removesuffix(b"\r\n\r\n").decode("latin-1").split("\r\n")
    found = _REQUEST.fullmatch(request)
    fields = [_FIELD.fullmatch(line) for line in lines]
    if found is None or None in fields:
        return None
    pairs = [(field[1].lower(), field[2].strip(" \t")) for field in fields if field is not None]
    names = [name for name, _ in pairs]
    if any(names.count(name) > 1 for name in _ONCE):
        return None
    return Head(found[1], found[2], dict(pairs))


class Admission:
    """Judges requests; called on one thread."""

    def __init__(self, doors: Doors, token: str | None, *, cookie: str, secure: bool) -> None:
        """Let in who brings a token; without one, who can only be on this machine.

        `cookie` is what a session is kept under, `secure` keeps it to encrypted connections.
        """
        self._doors = doors
        self._token = token
        self._cookie = cookie
        self._secure = secure
        self._sessions = Sessions()
        self._tries = Tries()

    def judge(self, head: Head | None, address: str, now_s: float) -> Verdict:
        """Judge a request that came from an address, by a monotonic clock.

        With a token, one that brings it in its query is sent on to the page with the secret of a
        session as a cookie, which all later requests show instead.
        """
        if head is None:
            return Verdict(400, "this is no HTTP request that a browser sends")
        wrong = self._wrong_with_place(head)
        if wrong is not None:
            return wrong
        if self._token is None or self._sessions.known(_cookie_of(head, self._cookie), now_s):
            return PASSED
        given = _token_of(head)
        if not given:
            return Verdict(401, "open the page with ?token=… once")
        return self._judge_token(self._token, given, address, now_s)

    def _wrong_with_place(self, head: Head) -> Verdict | None:
        place = place_of(head.headers.get("host", ""))
        if place is None:
            return Verdict(400, "the Host header names no host")
        origin = head.headers.get("origin")
        its_own = True if origin is None else is_of(origin, place)
        if its_own is None:
            return Verdict(400, "the Origin header names no origin")
        if not self._doors.admit(place.host):
            return Verdict(
                403,
                "this page is not known under that name: open it by its address, at localhost, or "
                "name it in the console's setting page_names",
            )
        if not its_own:
            return Verdict(403, "the page is not to be used from another site's page")
        return None

    def _judge_token(self, token: str, given: str, address: str, now_s: float) -> Verdict:
        wait_s = self._tries.wait_s(address, now_s)
        if wait_s > 0:
            seconds = math.ceil(wait_s)
            reason = f"too many wrong tokens came from your address: wait {seconds} s"
            return Verdict(429, reason, (f"Retry-After: {seconds}",))
        if not same(given, token):
            wrong = self._tries.failed(address, now_s)
            return Verdict(401, "that is not the token", wrong_tokens=wrong)
        self._tries.succeeded(address)
        cookie = self._cookie_for(self._sessions.begin(now_s))
        return Verdict(303, "", ("Location: /", cookie))

    def _cookie_for(self, secret: str) -> str:
        cookie = SimpleCookie({self._cookie: secret})
        morsel = cookie[self._cookie]
        morsel["path"], morsel["samesite"], morsel["httponly"] = "/", "Strict", True
        morsel["max-age"] = round(LASTS_S)
        if self._secure:
            morsel["secure"] = True
        return cookie.output()


def _token_of(head: Head) -> str:
    try:
        query = parse_qs(urlsplit(head.target).query, max_num_fields=20)
    except ValueError:
        return ""
    return query.get("token", [""])[0]


def _cookie_of(head: Head, name: str) -> str:
    try:
        cookie = SimpleCookie(head.headers.get("cookie", "")).get(name)
    except CookieError:
        return ""
    return "" if cookie is None else cookie.value
