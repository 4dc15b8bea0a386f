"""Why a state is held likely, and what would change that, in words."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hmcs_console.telling.reasons import Reasons, Rival, Support

_STRAIGHT_RAD = np.radians(5.0)
"""A smaller turn is none that a hand could be told to make."""
_COUNTS = 0.38
"""An axis is named that has at least so much of a direction: one less than 22.5° from the next."""
_WAYS = (("forward", "back"), ("left", "right"), ("up", "down"))
"""Along x, y and z, and against them."""


def reasons(told: Reasons | None) -> str:
    """Return what is known of the likely state and of those that might take over."""
    if told is None:
        return ""
    return "\n\n".join(part for part in (_along(told), _supported(told), _changing(told)) if part)


def side(direction: NDArray[np.float64]) -> str:
    """Return a direction, unit vector, (3,), as a person beside the robot says it, with its axis.

    x is forward, y left, z up.
    """
    named = [
        ways[int(value < 0)]
        for value, ways in zip(direction, _WAYS, strict=True)
        if abs(value) >= _COUNTS
    ]
    axis = int(np.abs(direction).argmax())
    sign = "−" if direction[axis] < 0 else "+"
    return f"{' and '.join(reversed(named))} (toward {sign}{'xyz'[axis]})"


def _along(told: Reasons) -> str:
    if told.progress is None or told.left_m is None:
        return ""
    return f"{told.progress:.0%} along {told.likely}'s path, {told.left_m * 1e3:.0f} mm to go"


def _supported(told: Reasons) -> str:
    if not told.support:
        return ""
    return "Newest step, against the background: " + ", ".join(map(_support, told.support))


def _support(support: Support) -> str:
    name = (
        support.gesteme
        if support.gesteme == support.state
        else f"{support.gesteme} ({support.state})"
    )
    if support.log_ratio_nats is None:
        return f"{name} ruled out"
    return f"{name} {support.log_ratio_nats:+.2f} nats"


def _changing(told: Reasons) -> str:
    if not told.rivals:
        return ""
    lines = [f"- {_rival(rival)}" for rival in told.rivals]
    return "\n".join(["What would change its mind:", "", *lines])


def _rival(rival: Rival) -> str:
    name = f"**{rival.state}** ({rival.probability:.0%}{', may follow' if rival.follows else ''})"
    lacking = (
        "" if rival.odds_nats is None else f" would take over after {rival.odds_nats:.1f} nats more"
    )
    turn = _turn(rival)
    if not turn:
        return name + lacking
    return f"{name}{lacking}: a hand that {turn}"


def _turn(rival: Rival) -> str:
    if rival.turn_rad is None:
        return ""
    if rival.turn_rad < _STRAIGHT_RAD:
        return "goes straight on"
    if rival.toward is None:
        return "turns back"
    return f"turns {np.degrees(rival.turn_rad):.0f}° {side(rival.toward)}"
