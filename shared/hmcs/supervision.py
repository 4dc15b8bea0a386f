"""Which command is in force: a state machine without a clock or a wire of its own.

The arm follows a command only while its writer is fresh and engaged. Everything else makes it
stand, and after every stop it moves again only once it has seen `engaged` False and then True, so
also after the start and when another writer takes over. A writer is one boot of one process. While
a writer is fresh the commands of any other are refused. How long a command counts is the robot's to
say: no sender makes it count longer than `Policy.longest_valid_ns`.

Two things can fall behind. A control tick that comes later than `Policy.late_tick_ns` is a stop. A
wire room that has given no sign of life for `Policy.hang_ns` hung: what queued up meanwhile is
stamped on arrival only now and looks fresh without being so; hence commands are refused for another
`Policy.settle_ns` after that.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from hmcs.arrays import Array

Stop = Literal[
    "none",
    "disengaged",
    "no_command",
    "stale_command",
    "refused_command",
    "second_writer",
    "not_paired",
    "late_tick",
    "silent_arm",
    "collision",
    "asked",
]
_LASTING: tuple[Stop, ...] = (
    "stale_command",
    "refused_command",
    "not_paired",
    "late_tick",
    "silent_arm",
    "collision",
    "asked",
)
"""Stops that stay the reason when the commands go stale."""
AT_ONCE: tuple[Stop, ...] = ("collision", "late_tick", "silent_arm")
"""Stops as hard as the arm can brake; all others are within its acceleration limits."""
ASKED_TOLD_NS = 500_000_000
"""So long at least a stop that was asked for stays the reason, also where nobody drives: who plays
a recording must not miss it."""
Verdict = Literal["accepted", "second_writer", "late"]
Writer = str | bytes
"""Something that is the same for all commands of one boot of one process, and for no others."""


@dataclass(frozen=True)
class Policy:
    """How patient the supervision is."""

    longest_valid_ns: int = 80_000_000
    """No command counts longer after its arrival, whatever it says."""
    late_tick_ns: int = 50_000_000
    """A longer time between two control ticks is a stop."""
    hang_ns: int = 100_000_000
    """A longer time without a sign of life of the wire room is its hang."""
    settle_ns: int = 250_000_000
    """How long commands are refused after a hang."""


@dataclass(frozen=True)
class Order:
    """A command as the supervision sees it."""

    writer: Writer
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
    writer: Writer | None = None
    twist: Array = field(default_factory=lambda: np.zeros(6))
    """Zero unless the arm follows it, shape (6,)."""
    fresh_until_ns: int = 0
    """When the writer's last command goes stale."""
    deaf_until_ns: int = 0
    """Until when commands are refused after a hang."""
    ticked_ns: int | None = None
    """When the last control tick was."""
    heard_ns: int | None = None
    """When the wire room last gave a sign of life."""
    contacts: tuple[str, ...] = ()
    """What the arm touched at the last tick."""
    asked_until_ns: int = 0
    """Until when a stop that was asked for stays the reason."""


def heard(now: Supervision, time_ns: int, policy: Policy) -> Supervision:
    """Return the supervision after a sign of life of the wire room."""
    if now.heard_ns is not None and time_ns - now.heard_ns > policy.hang_ns:
        halted = _halt(now, "stale_command") if now.writer is not None else now
        now = replace(halted, deaf_until_ns=time_ns + policy.settle_ns)
    return replace(now, heard_ns=time_ns)


def accept(
    now: Supervision, order: Order, time_ns: int, policy: Policy
) -> tuple[Supervision, Verdict]:
    """Return the supervision after `order`, seen at `time_ns`, and what became of the order."""
    now = _expired(heard(now, time_ns, policy), time_ns, "stale_command")
    fresh_until_ns = order.received_ns + min(order.valid_for_ns, policy.longest_valid_ns)
    if order.received_ns < now.deaf_until_ns or fresh_until_ns < time_ns:
        return now, "late"
    if order.writer != now.writer:
        if now.writer is not None and time_ns <= now.fresh_until_ns:
            return now, "second_writer"
        if now.writer is not None:
            now = _halt(now, "second_writer")
    now = replace(now, writer=order.writer, fresh_until_ns=fresh_until_ns)
    if not order.engaged:
        asked = now.stop == "asked" and time_ns < now.asked_until_ns
        stop: Stop = "asked" if asked else "disengaged"
        return replace(now, stop=stop, armed=True, twist=np.zeros(6)), "accepted"
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
    now = _expired(now, time_ns, "refused_command" if refused else "stale_command")
    late = now.ticked_ns is not None and time_ns - now.ticked_ns > policy.late_tick_ns
    if late and now.stop == "none":
        now = _halt(now, "late_tick")
    if now.stop == "none" and set(contacts) - set(now.contacts):
        now = _halt(now, "collision")
    return replace(now, contacts=contacts, ticked_ns=time_ns)


def stopped(now: Supervision) -> Supervision:
    """Return the supervision after somebody asked for a stop."""
    return replace(_halt(now, "asked"), asked_until_ns=(now.ticked_ns or 0) + ASKED_TOLD_NS)


def silent(now: Supervision) -> Supervision:
    """Return the supervision while the arm itself is not heard, so that nothing may move it."""
    return _halt(now, "silent_arm")


def unpaired(now: Supervision, writer: Writer) -> Supervision:
    """Return the supervision after a writer was heard to drive another robot."""
    return _halt(now, "not_paired") if now.writer == writer else now


def _expired(now: Supervision, time_ns: int, stop: Stop) -> Supervision:
    if now.writer is None or time_ns <= now.fresh_until_ns or now.stop in _LASTING:
        return now
    return _halt(now, stop)


def _halt(now: Supervision, stop: Stop) -> Supervision:
    return replace(now, stop=stop, armed=False, twist=np.zeros(6))
