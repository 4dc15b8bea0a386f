"""Who may open the page: decided from the head of an HTTP request alone.

Whoever reaches the page can move the robot, so two things are kept out: people without the token,
and pages of other sites in the operator's own browser, which could otherwise open a connection to
a loopback address, too.
"""

from __future__ import annotations

import hmac
from http.cookies import CookieError, SimpleCookie
from typing import NamedTuple
from urllib.parse import parse_qs, urlsplit

COOKIE = "hmcs_console"
_LOOPBACK_NAMES = ("localhost", "::1")


class Head(NamedTuple):
    """What an HTTP request says before its body."""

    target: str
    """Path and query."""
    headers: dict[str, str]
    """By their names in lower case."""


class Verdict(NamedTuple):
    """What becomes of a request."""

    answer: bytes | None
    """A whole HTTP response; None hands the request on to the page."""


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach what is served at a host."""
    return host in _LOOPBACK_NAMES or host.startswith("127.")


def head_of(data: bytes) -> Head | None:
    """Return the head of an HTTP request up to its blank line; None where it is none."""
    request, *lines = data.decode("latin-1").split("\r\n")
    words = request.split(" ")
    if len(words) != 3 or not words[2].startswith("HTTP/1."):
        return None
    pairs = (line.partition(":") for line in lines if ":" in line)
    return Head(words[1], {name.strip().lower(): value.strip() for name, _, value in pairs})


def admit(head: Head | None, token: str | None) -> Verdict:
    """Judge a request.

    With a token, one that brings it in its query is sent on to the page with a cookie, which all
    later requests show instead; without one, only requests to a loopback name are let in.
    """
    if head is None:
        return _refusal("400 Bad Request", "this is no HTTP request")
    if _comes_from_elsewhere(head):
        return _refusal("403 Forbidden", "the page is not to be used from another site's page")
    if token is None:
        if not is_loopback(_name_of(head.headers.get("host", ""))):
            return _refusal("403 Forbidden", "open the page at a loopback address")
        return Verdict(None)
    if _same(_cookie_of(head), token):
        return Verdict(None)
    if _same(_token_of(head), token):
        return Verdict(_welcome(token))
    return _refusal("401 Unauthorized", "open the page with ?token=… once")


def _comes_from_elsewhere(head: Head) -> bool:
    origin = head.headers.get("origin")
    return origin is not None and urlsplit(origin).netloc != head.headers.get("host")


def _name_of(host: str) -> str:
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _same(given: str, token: str) -> bool:
    return hmac.compare_digest(given.encode(), token.encode())


def _token_of(head: Head) -> str:
    return parse_qs(urlsplit(head.target).query).get("token", [""])[0]


def _cookie_of(head: Head) -> str:
    try:
        cookie = SimpleCookie(head.headers.get("cookie", "")).get(COOKIE)
    except CookieError:
        return ""
    return "" if cookie is None else cookie.value


def _welcome(token: str) -> bytes:
    cookie = SimpleCookie({COOKIE: token})
    morsel = cookie[COOKIE]
    morsel["path"], morsel["samesite"], morsel["httponly"] = "/", "Strict", True
    return _response("303 See Other", f"Location: /\r\n{cookie.output()}\r\n", "")


def _refusal(status: str, reason: str) -> Verdict:
    return Verdict(_response(status, "", f"{reason}\n"))


def _response(status: str, headers: str, body: str) -> bytes:
    data = body.encode()
    return (
        f"HTTP/1.1 {status}\r\nContent-Type: text/plain; charset=utf-8\r\n{headers}"
        f"Content-Length: {len(data)}\r\nConnection: close\r\n\r\n"
    ).encode() + data
