"""Hosts of a test's own on this machine: network namespaces, joined by links that can be spoiled.

Every two hosts have a link of their own, with a delay and losses. The test itself looks at each
host over a link that nothing is ever done to.
"""

from __future__ import annotations

import itertools
import os
import secrets
import shutil
import subprocess
import warnings
from collections.abc import Iterable
from dataclasses import dataclass, field
from types import TracebackType
from typing import Self

WHY_NOT = "needs root and the programs ip and tc (Debian: iproute2)"


def possible() -> bool:
    """Whether hosts can be made here."""
    if os.geteuid() != 0 or not (shutil.which("ip") and shutil.which("tc")):
        return False
    name = f"hmcs-{secrets.token_hex(2)}"
    made = subprocess.run(["ip", "netns", "add", name], capture_output=True, check=False)
    if made.returncode:
        return False
    _run("ip", "netns", "delete", name)
    return True


@dataclass
class Host:
    """One namespace."""

    name: str
    namespace: str
    watched_at: str
    """Its address on the link to the test."""
    addresses: dict[str, str] = field(default_factory=dict)
    """Its address on the link to each other host, by that host's name."""

    def command(self, words: Iterable[object]) -> list[str]:
        """Return a command as it is run on this host."""
        return ["ip", "netns", "exec", self.namespace, *map(str, words)]


class Network:
    """Hosts by name, each linked to each other one and to the test; all gone with the `with`."""

    def __init__(self, names: Iterable[str], delay_ms: float, loss_percent: float) -> None:
        self._tag = secrets.token_hex(2)
        self._delay_ms, self._loss_percent = delay_ms, loss_percent
        self.hosts: dict[str, Host] = {}
        self._names = tuple(names)

    def __enter__(self) -> Self:
        try:
            for number, name in enumerate(self._names):
                self._add_host(number, name)
            for number, (one, other) in enumerate(itertools.combinations(self._names, 2)):
                self._add_link(number, self.hosts[one], self.hosts[other])
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Remove every host and link."""
        for host in self.hosts.values():
            subprocess.run(
                ["ip", "netns", "delete", host.namespace], capture_output=True, check=False
            )
        self.hosts.clear()

    def cut(self, one: str, other: str) -> None:
        """Take a link down, as a pulled cable does."""
        self._set(one, other, "down")

    def heal(self, one: str, other: str) -> None:
        """Bring a link up again."""
        self._set(one, other, "up")

    def move(self, name: str, other: str) -> None:
        """Give a host another address on its link to another one."""
        host = self.hosts[name]
        old = host.addresses[other]
        new = ".".join([*old.split(".")[:3], str(int(old.rsplit(".", 1)[1]) + 100)])
        device = self._device(name, other)
        # The first address of a network may take the others of it along when it goes.
        _run("ip", "-n", host.namespace, "address", "delete", f"{old}/24", "dev", device)
        _run("ip", "-n", host.namespace, "address", "add", f"{new}/24", "dev", device)
        host.addresses[other] = new

    def _add_host(self, number: int, name: str) -> None:
        namespace = f"hmcs-{self._tag}-{name}"
        _run("ip", "netns", "add", namespace)
        host = Host(name, namespace, f"10.78.{number}.2")
        self.hosts[name] = host
        _run("ip", "-n", namespace, "link", "set", "lo", "up")
        here, there = f"h{self._tag}{number}t", f"h{self._tag}{number}w"
        _run("ip", "link", "add", here, "type", "veth", "peer", "name", there)
        _run("ip", "link", "set", there, "netns", namespace)
        _run("ip", "address", "add", f"10.78.{number}.1/24", "dev", here)
        _run("ip", "link", "set", here, "up")
        _run("ip", "-n", namespace, "address", "add", f"{host.watched_at}/24", "dev", there)
        _run("ip", "-n", namespace, "link", "set", there, "up")

    def _add_link(self, number: int, one: Host, other: Host) -> None:
        ends = (self._device(one.name, other.name), self._device(other.name, one.name))
        _run("ip", "link", "add", ends[0], "type", "veth", "peer", "name", ends[1])
        for place, (host, peer, device) in enumerate(
            ((one, other, ends[0]), (other, one, ends[1])), start=1
        ):
            host.addresses[peer.name] = f"10.77.{number}.{place}"
            _run("ip", "link", "set", device, "netns", host.namespace)
            address = f"{host.addresses[peer.name]}/24"
            _run("ip", "-n", host.namespace, "address", "add", address, "dev", device)
            _run("ip", "-n", host.namespace, "link", "set", device, "up")
            self._spoil(host, device)

    def _spoil(self, host: Host, device: str) -> None:
        """Let a link take its time and lose some, where the kernel can do that."""
        spoiled = subprocess.run(
            ["tc", "-n", host.namespace, "qdisc", "add", "dev", device, "root", "netem",
             "delay", f"{self._delay_ms}ms", "loss", f"{self._loss_percent}%"],
            capture_output=True, check=False,
        )  # fmt: skip
        if spoiled.returncode:
            warnings.warn(
                "links have no delay and lose nothing: this kernel has no netem", stacklevel=2
            )

    def _set(self, one: str, other: str, state: str) -> None:
        namespace = self.hosts[one].namespace
        _run("ip", "-n", namespace, "link", "set", self._device(one, other), state)

    def _device(self, of: str, toward: str) -> str:
        numbers = {name: number for number, name in enumerate(self._names)}
        return f"h{self._tag}{numbers[of]}{numbers[toward]}l"


def _run(*words: str) -> None:
    subprocess.run(words, check=True, capture_output=True)
