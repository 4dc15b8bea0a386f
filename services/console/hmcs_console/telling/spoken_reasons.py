"""Why a state is held likely, and what would change that, in words."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hmcs.shown import Markdown
from hmcs_console.telling.reasons import Reasons, Rival, Support

_STRAIGHT_RAD = np.radians(5.0)
"""No hand could follow advice to make a smaller turn."""
_COUNTS = 0.38
"""An axis is named that has at least so much of a direction: one less than 22.5° from the next."""
_WAYS = (("forward", "back"), ("left", "right"), ("up", "down"))
"""Along x, y and z, and against them."""


def reasons(given: Reasons | None) -> Markdown:
    """Return what is known of the likely state and of those that might take over."""
    if given is None:
        return Markdown("")
    parts = (_along(given), _supported(given), _changing(given))
    return Markdown("\n\n").join(part for part in parts if part)


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


def _along(reasons: Reasons) -> Markdown:
    if reasons.progress is None or reasons.left_m is None:
        return Markdown("")
    return Markdown("{:.0%} along {}'s path, {:.0f} mm to go").format(
        reasons.progress, reasons.likely, reasons.left_m * 1e3
    )


def _supported(reasons: Reasons) -> Markdown:
    if not reasons.support:
        return Markdown("")
    return Markdown("Newest step, against the background: {}").format(
        Markdown(", ").join(map(_support, reasons.support))
    )


def _support(support: Support) -> Markdown:
    name = Markdown("{}" if support.gesteme == support.state else "{} ({})").format(
        support.gesteme, support.state
    )
    if support.log_ratio_nats is None:
        return Markdown("{} ruled out").format(name)
    return Markdown("{} {:+.2f} nats").format(name, support.log_ratio_nats)


def _changing(reasons: Reasons) -> Markdown:
    if not reasons.rivals:
        return Markdown("")
    lines = [Markdown("- {}").format(_rival(rival)) for rival in reasons.rivals]
    head = [Markdown("What would change its mind:"), Markdown("")]
    return Markdown("\n").join([*head, *lines])


def _rival(rival: Rival) -> Markdown:
    name = Markdown("**{}** ({:.0%}{})").format(
        rival.state, rival.probability, ", may follow" if rival.follows else ""
    )
    lacking = Markdown("")
    if rival.odds_nats is not None:
        lacking = Markdown(" would take over after {:.1f} nats more").format(rival.odds_nats)
    turn = _turn(rival)
    return Markdown("{}{}: a hand that {}" if turn else "{}{}").format(name, lacking, turn)


def _turn(rival: Rival) -> str:
    if rival.turn_rad is None:
        return ""
    if rival.turn_rad < _STRAIGHT_RAD:
        return "goes straight on"
    if rival.toward is None:
        return "turns back"
    return f"turns {np.degrees(rival.turn_rad):.0f}° {side(rival.toward)}"
