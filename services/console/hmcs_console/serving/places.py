"""Where the page may be opened: addresses and names, compared by what they mean, not by letters.

A name that somebody else controls may lead to this machine at any time (DNS rebinding), and a page
that was opened under it would belong to the one who does. An address belongs to nobody, so it is
enough that it is written as one; names have to be known.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from ipaddress import IPv4Address, IPv6Address, ip_address
from typing import NamedTuple

LOCALHOST = "localhost"
_NAME = re.compile(r"[a-z0-9](?:[a-z0-9_-]{0,62})(?:\.[a-z0-9](?:[a-z0-9_-]{0,62}))*")
_PLACE = re.compile(r"(\[[0-9a-f:.]{2,45}\]|[a-z0-9._-]{1,253})(?::([0-9]{1,5}))?")
_ORIGIN = re.compile(r"([a-z][a-z0-9+.-]{0,30})://(.*)")
_PORTS = {"http": 80, "https": 443}

Address = IPv4Address | IPv6Address


class Place(NamedTuple):
    """A host and a port, as a browser writes them."""

    host: str
    """In lower case, IPv6 addresses without brackets."""
    port: int | None
    """None where it is the usual one."""


class Doors(NamedTuple):
    """Under which hosts the page is opened."""

    listens: frozenset[Address]
    """The addresses it is served at."""
    names: frozenset[str]
    """That lead to it as well, in lower case."""

    def admit(self, host: str) -> bool:
        """Whether a browser that asked for a host meant this page.

        So did one that wrote an address at which it can be reached.
        """
        if host in self.names or host == LOCALHOST:
            return True
        address = address_of(host)
        if address is None:
            return False
        # Served at every address of this machine, and maybe handed on to it by another one.
        at_any = any(listens.is_unspecified for listens in self.listens)
        return at_any or address.is_loopback or address in self.listens


def doors(host: str, served_at: Iterable[str], names: Iterable[str]) -> Doors:
    """Return the doors of a page at a host, which are these addresses, known by more names."""
    known = {name.lower() for name in names}
    if address_of(host) is None:
        known.add(host.lower())
    addresses = (address_of(address.partition("%")[0]) for address in served_at)
    return Doors(frozenset(filter(None, addresses)), frozenset(known))


def address_of(host: str) -> Address | None:
    """Return the address a host is written as; None where it is a name, or nothing."""
    try:
        address = ip_address(host)
    except ValueError:
        return None
    mapped = address.ipv4_mapped if isinstance(address, IPv6Address) else None
    return mapped or address


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach what is served at a host."""
    address = address_of(host)
    return host.lower() == LOCALHOST if address is None else address.is_loopback


def is_name(host: str) -> bool:
    """Whether a host is a name, and none of an address."""
    return _NAME.fullmatch(host.lower()) is not None and address_of(host) is None


def place_of(address: str) -> Place | None:
    """Return the place a `Host` header names; None where it names none."""
    found = _PLACE.fullmatch(address.lower())
    if found is None:
        return None
    host, port = found[1].strip("[]"), found[2]
    if found[1].startswith("[") and (":" not in host or address_of(host) is None):
        return None
    if port is not None and not 0 < int(port) < 65_536:
        return None
    return Place(host, None if port is None else int(port))


def is_of(origin: str, place: Place) -> bool | None:
    """Whether an `Origin` header names the very place a request goes to; None where it is none."""
    if origin == "null":
        return False
    found = _ORIGIN.fullmatch(origin.lower())
    named = None if found is None else place_of(found[2])
    if found is None or named is None:
        return None
    usual = _PORTS.get(found[1])
    return (named.host, named.port or usual) == (place.host, place.port or usual)
