from __future__ import annotations

import re

import pytest

from hmcs.bus.service import UserError
from hmcs.bus.settings import as_yaml, load_settings
from hmcs_console.serving.admission import Head, admit, head_of, is_loopback
from hmcs_console.settings import ConsoleSettings

TOKEN = "a secret; of 8"


def asking(target: str = "/", **headers: str) -> Head:
    return Head(target, {"host": "127.0.0.1:8080"} | headers)


def status(head: Head | None, token: str | None) -> str:
    answer = admit(head, token).answer
    return "passed" if answer is None else answer.split(b" ")[1].decode()


def test_the_head_of_a_request_is_read() -> None:
    head = head_of(b"GET /x?y=1 HTTP/1.1\r\nHost: here:1\r\nORIGIN: http://a\r\n\r\n")
    assert head == Head("/x?y=1", {"host": "here:1", "origin": "http://a"})


@pytest.mark.parametrize("data", [b"\r\n\r\n", b"\x16\x03\x01\r\n\r\n", b"SSH-2.0-x\r\n\r\n"])
def test_what_is_no_request_is_refused(data: bytes) -> None:
    assert status(head_of(data), None) == "400"


def test_without_a_token_only_loopback_names_are_served() -> None:
    for host in ("127.0.0.1:8080", "localhost:1", "[::1]:8080"):
        assert status(asking(host=host), None) == "passed"
    for host in ("elsewhere.example:8080", "", "[:"):
        assert status(asking(host=host), None) == "403"


@pytest.mark.parametrize("token", [None, TOKEN])
def test_pages_of_other_sites_are_kept_out(token: str | None) -> None:
    assert status(asking(origin="http://elsewhere.example", upgrade="websocket"), token) == "403"
    assert status(asking(origin="null"), token) == "403"
    assert status(asking(origin="http://127.0.0.1:8080"), None) == "passed"


def test_a_token_is_exchanged_for_a_cookie_that_lets_in() -> None:
    answer = admit(asking("/?token=a+secret%3B+of+8"), TOKEN).answer
    assert answer is not None
    assert answer.startswith(b"HTTP/1.1 303")
    found = re.search(rb"Set-Cookie: ([^\r]*)\r\n", answer)
    assert found is not None
    assert b"HttpOnly" in found[1]
    assert b"SameSite=Strict" in found[1]
    pair = re.match(r'[^=]+=(?:"[^"]*"|[^;]*)', found[1].decode())
    assert pair is not None
    assert status(asking(cookie=f"other=1; {pair[0]}"), TOKEN) == "passed"


def test_who_brings_no_token_or_a_wrong_one_stays_outside() -> None:
    for head in (
        asking(),
        asking("/?token=wrong"),
        asking(cookie="hmcs_console=wrong"),
        asking(cookie="hmcs_console="),
        asking("/?token=é"),
    ):
        assert status(head, TOKEN) == "401"


def test_loopback_is_what_only_this_machine_reaches() -> None:
    assert all(map(is_loopback, ("127.0.0.1", "127.1.2.3", "localhost", "::1")))
    assert not any(map(is_loopback, ("0.0.0.0", "192.168.0.1", "::", "example.com")))


def load(*arguments: str) -> ConsoleSettings:
    settings = load_settings(ConsoleSettings, "console", arguments).settings
    assert isinstance(settings, ConsoleSettings)
    return settings


def test_a_host_that_others_can_reach_needs_a_token() -> None:
    with pytest.raises(UserError, match=r"host 0\.0\.0\.0 can be reached.*give a token"):
        load("--host", "0.0.0.0")
    assert load("--host", "0.0.0.0", "--token", TOKEN).host == "0.0.0.0"
    assert load().token is None


def test_a_token_is_not_shown_with_the_settings() -> None:
    assert TOKEN not in as_yaml(load("--token", TOKEN))


def test_a_token_that_is_guessed_soon_is_refused() -> None:
    with pytest.raises(UserError, match="token"):
        load("--token", "short")
