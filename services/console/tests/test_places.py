from __future__ import annotations

from ipaddress import ip_address

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs_console.serving.places import Place, is_loopback, is_name, place_of


def test_loopback_is_what_only_this_machine_reaches() -> None:
    loopback = ("127.0.0.1", "127.1.2.3", "localhost", "LocalHost", "::1", "::ffff:127.0.0.1")
    assert all(map(is_loopback, loopback))
    others = (
        "0.0.0.0",
        "192.168.0.1",
        "::",
        "::ffff:192.0.2.1",
        "example.com",
        "127.evil.test",
        "127.0.0.1.evil.test",
        "127.0.0.1 ",
        "127.0.0.256",
        "127.1",
        "0177.0.0.1",
        "2130706433",
        "localhost.evil.test",
        "",
    )
    assert not any(map(is_loopback, others))


@given(st.ip_addresses())
def test_an_address_is_loopback_as_its_numbers_say(address: object) -> None:
    assert is_loopback(str(address)) == ip_address(str(address)).is_loopback


@pytest.mark.parametrize(
    ("reported", "place"),
    [
        ("Robot.Example:8080", Place("robot.example", 8080)),
        ("192.0.2.1", Place("192.0.2.1", None)),
        ("[2001:DB8::1]:1", Place("2001:db8::1", 1)),
        ("::1", None),
        ("[::1", None),
        ("[1.2.3.4]", None),
        ("a:", None),
        ("a:-1", None),
        ("a:65536", None),
        ("user@a", None),
        ("a\n", None),
        ("é", None),
    ],
)
def test_a_place_is_read_as_browsers_write_it(reported: str, place: Place | None) -> None:
    assert place_of(reported) == place


def test_a_name_is_none_of_an_address() -> None:
    assert all(map(is_name, ("robot", "robot.lab.example", "robot-1.lan", "xn--bcher-kva.example")))
    assert not any(map(is_name, ("192.0.2.1", "::1", "", "a..b", ".a", "a.", "a b", "a:1", "-a")))
