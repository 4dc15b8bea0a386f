"""How often the page is drawn: less often where drawing takes longer than there is time for."""

from __future__ import annotations

SLOWEST_HZ = 2.0
_EASY = 0.5
"""The rate rises again where drawing would take no more than this share of the shorter period."""


def next_rate_hz(rate_hz: float, took_s: float, wanted_hz: float) -> float:
    """Return the rate after a drawing that took so long.

    It halves, down to 2 Hz, where that was longer than its period, and doubles, up to what is
    wanted, where there was time to spare.
    """
    if took_s * rate_hz > 1:
        return max(rate_hz / 2, min(SLOWEST_HZ, wanted_hz))
    faster_hz = min(rate_hz * 2, wanted_hz)
    return faster_hz if took_s * faster_hz <= _EASY else rate_hz
