"""In which order the parts of a task are performed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from hmcs.task import Task


class Order(NamedTuple):
    """In which order a task's states are performed."""

    first: str
    """The state it most likely begins in."""
    follow: Mapping[str, Mapping[str, float]]
    """For each state those that follow it, with their probabilities."""


def order_of(task: Task) -> Order:
    """Return the order of a task's file."""
    return Order(
        max(task.start, key=lambda state: task.start[state]),
        {state.name: state.next for state in task.states},
    )


def next_part(order: Order, now: str) -> str:
    """Return the state that most likely begins after `now`, the first one after none.

    Empty after a state that none follows, or only the first one anew: there the task ends, and is
    begun again by one more press.
    """
    if not now:
        return order.first
    follow = order.follow.get(now, {})
    likeliest = max(follow, key=lambda state: follow[state], default="")
    return "" if likeliest == order.first else likeliest
