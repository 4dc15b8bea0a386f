"""The part of the task the hand is said to be in; the pedal begins the next one."""

from __future__ import annotations

from typing import NamedTuple

from hmcs_console.order import Order, next_part


class Marking(NamedTuple):
    """How parts are marked now."""

    order: Order | None
    """Of the task; None where the console knows none, and the pedal marks nothing."""
    by_pedal: bool
    """Whether the pedal begins the next part."""
    now: str = ""
    """The state that was marked last; empty while none is."""

    @property
    def next(self) -> str:
        """The state the pedal would begin; empty where it would end the task."""
        return "" if self.order is None else next_part(self.order, self.now)


def pressed(marking: Marking) -> Marking | None:
    """Return the marking after the pedal went down; None where that marks nothing."""
    if marking.order is None or not marking.by_pedal:
        return None
    return marking._replace(now=marking.next)
