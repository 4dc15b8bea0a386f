"""Who is let in: by the head of a request, where it came from, and when."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.bus.service import UserError
from hmcs.bus.settings import as_yaml, load_settings
from hmcs_console.serving.admission import PASSED, Admission, Head, Verdict, head_of
from hmcs_console.serving.places import doors
from hmcs_console.serving.sessions import LASTS_S, MOST_SESSIONS
from hmcs_console.settings import ConsoleSettings

TOKEN = "a secret; of 8"
HERE, ELSEWHERE = "127.0.0.1", "192.0.2.7"


def admission(
    token: str | None,
    host: str = HERE,
    names: tuple[str, ...] = (),
    *,
    secure: bool = False,
) -> Admission:
    return Admission(doors(host, [host], names), token, cookie="hmcs", secure=secure)


def asking(target: str = "/", **headers: str) -> Head:
    return Head("GET", target, {"host": "127.0.0.1:8080"} | headers)


def status(
    head: Head | None, token: str | None = None, host: str = HERE, names: tuple[str, ...] = ()
) -> int | None:
    return admission(token, host, names).judge(head, HERE, 0.0).status


def cookie_in(verdict: Verdict) -> str:
    (line,) = [header for header in verdict.headers if header.startswith("Set-Cookie")]
    return line.removeprefix("Set-Cookie: ")


def pair_in(verdict: Verdict) -> str:
    return cookie_in(verdict).partition(";")[0]


def test_the_head_of_a_request_is_read() -> None:
    head = head_of(b"GET /x?y=1 HTTP/1.1\r\nHost: here:1\r\nORIGIN: http://a\r\n\r\n")
    assert head == Head("GET", "/x?y=1", {"host": "here:1", "origin": "http://a"})
    assert head is not None
    assert head.path == "/x"


@pytest.mark.parametrize(
    "data",
    [
        b"\r\n\r\n",
        b"\x16\x03\x01\r\n\r\n",
        b"SSH-2.0-x\r\n\r\n",
        b"GET / HTTP/2\r\nHost: a\r\n\r\n",
        b"GET  / HTTP/1.1\r\nHost: a\r\n\r\n",
        b"GET http://a/ HTTP/1.1\r\nHost: a\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost a\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\nX: b\r\n\r\n",
        b"GET / HTTP/1.1\r\n Host: a\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nOrigin: http://a\r\norigin: http://b\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nCookie: a=1\r\nCookie: b=1\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nX: \x00\r\n\r\n",
    ],
)
def test_what_is_no_request_is_refused(data: bytes) -> None:
    assert status(head_of(data)) == 400


@given(st.binary(max_size=200))
def test_any_bytes_are_judged(data: bytes) -> None:
    head = head_of(b"GET / HTTP/1.1\r\n" + data + b"\r\n\r\n")
    assert status(head, TOKEN) in (None, 400, 401, 403)
    assert head_of(data) is None or head_of(data).headers is not None  # type: ignore[union-attr]


TEXT = st.text(st.characters(max_codepoint=255), max_size=40)


@given(TEXT, TEXT, TEXT, TEXT)
def test_any_headers_are_judged(host: str, origin: str, cookie: str, token: str) -> None:
    head = asking(f"/?token={token}", host=host, origin=origin, cookie=cookie)
    assert status(head, TOKEN) in (400, 401, 403)


def test_without_a_token_only_loopback_addresses_are_served() -> None:
    for host in ("127.0.0.1:8080", "localhost:1", "LOCALHOST", "[::1]:8080", "127.3.2.1"):
        assert status(asking(host=host)) is None
    for host in (
        "elsewhere.example:8080",
        "127.evil.test",
        "127.0.0.1.evil.test:8080",
        "localhost.evil.test",
        "127.1.evil",
        "192.0.2.1",
        "0.0.0.0:8080",
        "2130706433",
        "127.1",
        "localhost.",
    ):
        assert status(asking(host=host)) == 403
    for host in ("", "[:", "[::1", "::1", "[127.0.0.1]", "a b", "a:b", "a:0", "a:99999", "a/b"):
        assert status(asking(host=host)) == 400


def test_a_host_header_names_an_address_of_the_page_localhost_or_a_known_name() -> None:
    names = ("robot.example",)
    for host in ("robot.example:80", "ROBOT.example", "192.0.2.1:8080", "localhost"):
        assert status(asking(host=host), TOKEN, "192.0.2.1", names) == 401
    for host in ("evil.example", "sub.robot.example", "192.0.2.2"):
        assert status(asking(host=host), TOKEN, "192.0.2.1", names) == 403
    # At every address of the machine, also of one that hands connections on to it.
    assert status(asking(host="192.0.2.2"), TOKEN, "0.0.0.0") == 401
    assert status(asking(host="[2001:db8::1]:8080"), TOKEN, "::") == 401
    assert status(asking(host="evil.example"), TOKEN, "0.0.0.0") == 403


def test_the_name_the_page_is_served_at_is_known() -> None:
    named = Admission(doors("robot.lan", ["192.0.2.1"], ()), TOKEN, cookie="c", secure=False)
    for host in ("robot.lan:8080", "192.0.2.1:8080"):
        assert named.judge(asking(host=host), HERE, 0.0).status == 401


@pytest.mark.parametrize("token", [None, TOKEN])
def test_pages_of_other_sites_are_kept_out(token: str | None) -> None:
    for origin in (
        "http://elsewhere.example",
        "null",
        "http://127.0.0.1:8081",
        "http://127.0.0.1",
        "http://localhost:8080",
        "chrome-extension://abc",
    ):
        assert status(asking(origin=origin, upgrade="websocket"), token) == 403
    for origin in ("http://127.0.0.1:8080", "HTTP://127.0.0.1:8080"):
        assert status(asking(origin=origin), None) is None


def test_the_usual_port_may_be_left_out() -> None:
    assert status(asking(host="127.0.0.1", origin="http://127.0.0.1:80")) is None
    assert status(asking(host="127.0.0.1:443", origin="https://127.0.0.1")) is None


@pytest.mark.parametrize(
    "origin", ["http://[::1", "", "//a", "http://", "http://a b", "x", "http://[z]"]
)
def test_an_origin_that_is_none_is_malformed(origin: str) -> None:
    assert status(asking(origin=origin)) == 400
    assert status(asking(origin=origin), TOKEN) == 400


def test_a_token_is_exchanged_for_a_session_that_lets_in() -> None:
    door = admission(TOKEN)
    verdict = door.judge(asking("/?token=a+secret%3B+of+8"), HERE, 0.0)
    assert verdict.status == 303
    assert "Location: /" in verdict.headers
    cookie = cookie_in(verdict)
    assert {"HttpOnly", "SameSite=Strict", "Path=/", f"Max-Age={LASTS_S:.0f}"} <= set(
        cookie.split("; ")
    )
    assert "Secure" not in cookie
    assert TOKEN not in cookie
    assert door.judge(asking(cookie=f"other=1; {pair_in(verdict)}"), HERE, 1.0) is PASSED
    # It is of this console, and of no other.
    assert status(asking(cookie=pair_in(verdict)), TOKEN) == 401


def test_every_session_has_a_secret_of_its_own_that_is_long() -> None:
    door = admission(TOKEN)
    secrets = {
        pair_in(door.judge(asking("/?token=a+secret%3B+of+8"), HERE, 0.0)) for _ in range(20)
    }
    assert len(secrets) == 20
    assert min(map(len, secrets)) > 40


def test_a_session_ends() -> None:
    door = admission(TOKEN)
    asked = asking(cookie=pair_in(door.judge(asking("/?token=a+secret%3B+of+8"), HERE, 0.0)))
    assert door.judge(asked, HERE, LASTS_S - 1) is PASSED
    assert door.judge(asked, HERE, LASTS_S).status == 401


def test_of_too_many_sessions_the_oldest_ends() -> None:
    door = admission(TOKEN)
    cookies = [
        pair_in(door.judge(asking("/?token=a+secret%3B+of+8"), HERE, 0.0))
        for _ in range(MOST_SESSIONS + 1)
    ]
    passed = [door.judge(asking(cookie=cookie), HERE, 1.0) is PASSED for cookie in cookies]
    assert passed == [False] + [True] * MOST_SESSIONS


def test_over_encrypted_connections_the_cookie_stays_on_them() -> None:
    verdict = admission(TOKEN, secure=True).judge(asking("/?token=a+secret%3B+of+8"), HERE, 0.0)
    assert "Secure" in cookie_in(verdict).split("; ")


def test_who_brings_no_token_or_a_wrong_one_stays_outside() -> None:
    for head in (
        asking(),
        asking("/?token=wrong"),
        asking("/?token="),
        asking("/?token=wrong&token=a+secret%3B+of+8"),
        asking(cookie="hmcs=wrong"),
        asking(cookie="hmcs="),
        asking(cookie=f'hmcs="{TOKEN}"'),
        asking("/?token=é"),
    ):
        assert status(head, TOKEN) == 401


def test_wrong_tokens_of_an_address_cost_more_and_more_time_and_nobody_elses() -> None:
    door = admission(TOKEN)
    wrong, right = asking("/?token=wrong"), asking("/?token=a+secret%3B+of+8")
    tried = [door.judge(wrong, ELSEWHERE, now_s / 10) for now_s in range(80)]
    assert sum(verdict.status == 401 for verdict in tried) < 8
    reported = next(verdict for verdict in tried if verdict.status == 429)
    assert re.search(r"wait \d+ s", reported.reason)
    assert any(header.startswith("Retry-After: ") for header in reported.headers)
    # Even the right one has to wait, else whoever tries would learn of it.
    assert door.judge(right, ELSEWHERE, 8.0).status == 429
    assert door.judge(right, HERE, 8.0).status == 303
    assert door.judge(right, ELSEWHERE, 1000.0).status == 303
    assert door.judge(wrong, ELSEWHERE, 1000.0).wrong_tokens == 1


def test_who_is_in_already_is_not_kept_waiting_by_wrong_tokens_of_the_same_address() -> None:
    door = admission(TOKEN)
    cookie = pair_in(door.judge(asking("/?token=a+secret%3B+of+8"), HERE, 0.0))
    for _ in range(10):
        door.judge(asking("/?token=wrong"), HERE, 1.0)
    assert door.judge(asking(cookie=cookie), HERE, 1.0) is PASSED


def load(*arguments: str) -> ConsoleSettings:
    settings = load_settings(ConsoleSettings, "console", arguments).settings
    assert isinstance(settings, ConsoleSettings)
    return settings


@pytest.mark.parametrize("host", ["0.0.0.0", "127.evil.test", "::", "", "127.0.0.1.evil.test"])
def test_a_host_that_others_can_reach_needs_a_token(host: str) -> None:
    with pytest.raises(UserError, match=r"can be reached.*give a token"):
        load("--host", host)
    assert load("--host", host, "--token", TOKEN).host == host


@pytest.mark.parametrize("host", ["127.0.0.1", "127.9.9.9", "::1", "localhost"])
def test_a_loopback_host_needs_none(host: str) -> None:
    assert load("--host", host).token is None


def test_a_token_is_not_shown_with_the_settings() -> None:
    assert TOKEN not in as_yaml(load("--token", TOKEN))


def test_a_token_that_is_guessed_soon_is_refused() -> None:
    with pytest.raises(UserError, match="token"):
        load("--token", "short")


@pytest.mark.parametrize("name", ["http://a", "a:80", "a b", "", "192.0.2.1", "a/b", "*"])
def test_what_is_no_name_of_a_host_cannot_be_one_of_the_page(name: str) -> None:
    with pytest.raises(UserError, match="is no name of a host"):
        load("--page-names", f'["{name}"]')


def test_a_certificate_and_its_key_go_together() -> None:
    for alone in ("--page-certificate", "--page-key"):
        with pytest.raises(UserError, match="give both, or neither"):
            load(alone, "x.pem")
    both = load("--page-certificate", "x.pem", "--page-key", "x.key")
    assert (both.page_certificate, both.page_key) == (Path("x.pem"), Path("x.key"))
    assert load("--page-certificate", "", "--page-key", "").page_key is None
