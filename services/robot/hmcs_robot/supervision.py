"""Which command is in force: a state machine that is told the time and knows no wire.

The arm follows a command only while its writer is fresh and engaged. Everything else makes it
stand, and after every stop it moves again only once it has seen `engaged` False and then True, so
also after the start and when another writer takes over. A writer is one boot of one process. While
a writer is fresh the commands of any other are refused.

The robot's own hang (a tick that comes later than `Policy.hang_ns`) is a stop as well: nothing it
knows is fresh any more. What queued up meanwhile is stamped on arrival only now and looks fresh
without being so; hence commands are refused for another `Policy.settle_ns` after a hang.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from hmcs_robot.driver import Array

Stop = Literal[
    "none",
    "disengaged",
    "no_command",
    "stale_command",
    "refused_command",
    "second_writer",
    "collision",
    "asked",
]
_LASTING: tuple[Stop, ...] = ("stale_command", "refused_command", "collision", "asked")
"""Stops that stay the reason when the commands go stale."""
Verdict = Literal["accepted", "second_writer", "late"]


@dataclass(frozen=True)
class Policy:
    """How patient the supervision is."""

    hang_ns: int = 100_000_000
    """A longer time between two ticks is a hang of the robot's own process."""
    settle_ns: int = 250_000_000
    """How long commands are refused after a hang."""


@dataclass(frozen=True)
class Order:
    """A command as the supervision sees it."""

    writer: str
    """Boot of the process that wrote it."""
    twist: Array
    """m/s and rad/s, shape (6,), finite."""
    valid_for_ns: int
    engaged: bool
    received_ns: int
    """Arrival by the receiver's own monotonic clock."""


@dataclass(frozen=True)
class Supervision:
    """What is in force now; begin with `Supervision()`."""

    stop: Stop = "no_command"
    """Why the arm stands; `none` while it follows `twist`."""
    armed: bool = False
    """`engaged` False was seen since the last stop: True may now start the motion."""
    writer: str | None = None
    twist: Array = field(default_factory=lambda: np.zeros(6))
    """Zero unless the arm follows it, shape (6,)."""
    fresh_until_ns: int = 0
    """When the writer's last command goes stale."""
    deaf_until_ns: int = 0
    """Until when commands are refused after a hang."""
    ticked_ns: int | None = None
    """When it was last told the time."""
    contacts: tuple[str, ...] = ()
    """What the arm touched at the last tick."""


def accept(
    now: Supervision, order: Order, time_ns: int, policy: Policy
) -> tuple[Supervision, Verdict]:
    """Return the supervision after `order`, seen at `time_ns`, and what became of the order."""
    now = _expired(_after_hang(now, time_ns, policy), time_ns, "stale_command")
    fresh_until_ns = order.received_ns + order.valid_for_ns
    if order.received_ns < now.deaf_until_ns or fresh_until_ns < time_ns:
        return now, "late"
    if order.writer != now.writer:
        if now.writer is not None and time_ns <= now.fresh_until_ns:
            return now, "second_writer"
        if now.writer is not None:
            now = _halt(now, "second_writer")
    now = replace(now, writer=order.writer, fresh_until_ns=fresh_until_ns)
    if not order.engaged:
        return replace(now, stop="disengaged", armed=True, twist=np.zeros(6)), "accepted"
    if now.stop == "none" or now.armed:
        return replace(now, stop="none", armed=False, twist=order.twist), "accepted"
    return now, "accepted"


def tick(
    now: Supervision,
    contacts: tuple[str, ...],
    time_ns: int,
    policy: Policy,
    *,
    refused: bool = False,
) -> Supervision:
    """Return the supervision at `time_ns`, with the arm touching `contacts`.

    `refused`: what came since the last accepted command was no valid command, which then is why
    the last one went stale.
    A contact stops the arm when it is made, not while it lasts: after a re-engage the arm can be
    driven away from what it touches.
    """
    now = _after_hang(now, time_ns, policy)
    now = _expired(now, time_ns, "refused_command" if refused else "stale_command")
    if now.stop == "none" and set(contacts) - set(now.contacts):
        now = _halt(now, "collision")
    return replace(now, contacts=contacts, ticked_ns=time_ns)


def stopped(now: Supervision) -> Supervision:
    """Return the supervision after somebody asked for a stop."""
    return _halt(now, "asked")


def _after_hang(now: Supervision, time_ns: int, policy: Policy) -> Supervision:
    if now.ticked_ns is None or time_ns - now.ticked_ns <= policy.hang_ns:
        return now
    halted = _halt(now, "stale_command") if now.writer is not None else now
    return replace(halted, deaf_until_ns=time_ns + policy.settle_ns, ticked_ns=time_ns)


def _expired(now: Supervision, time_ns: int, stop: Stop) -> Supervision:
    if now.writer is None or time_ns <= now.fresh_until_ns or now.stop in _LASTING:
        return now
    return _halt(now, stop)


def _halt(now: Supervision, stop: Stop) -> Supervision:
    return replace(now, stop=stop, armed=False, twist=np.zeros(6))
