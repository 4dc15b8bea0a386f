"""What a hand does that was not meant: wander, noise that grows with speed, and tremor."""

from __future__ import annotations

import numpy as np

from hmcs.arrays import Array

TREMOR_MEMORY_S = 0.3
"""A tremor's amplitude and phase drift over so long: about 1 Hz of width."""


class Wander:
    """A velocity that drifts about zero: an Ornstein–Uhlenbeck process on each axis."""

    def __init__(
        self, rms_total: float, memory_s: float, period_s: float, rng: np.random.Generator
    ) -> None:
        """Drift with `rms_total` over three axes together, forgotten over `memory_s`."""
        self._keep = float(np.exp(-period_s / memory_s))
        self._rms = rms_total / np.sqrt(3.0)
        self._rng = rng
        self._value = self._rms * rng.standard_normal(3)

    def step(self) -> Array:
        """Return the next value, shape (3,)."""
        fresh = self._rms * np.sqrt(1.0 - self._keep**2)
        self._value = self._keep * self._value + fresh * self._rng.standard_normal(3)
        return np.asarray(self._value)


class Tremor:
    """A narrow band of oscillation: a carrier whose two quadratures wander slowly."""

    def __init__(
        self,
        rms_m_s: float,
        band_hz: tuple[float, float],
        period_s: float,
        rng: np.random.Generator,
    ) -> None:
        """Oscillate with `rms_m_s` over three axes, at one frequency of the band drawn by lot."""
        self._step_rad = 2.0 * np.pi * rng.uniform(*band_hz) * period_s
        self._in_phase = Wander(rms_m_s, TREMOR_MEMORY_S, period_s, rng)
        self._quadrature = Wander(rms_m_s, TREMOR_MEMORY_S, period_s, rng)
        self._phase_rad = rng.uniform(0.0, 2.0 * np.pi)

    def step(self) -> Array:
        """Return the next velocity, m/s, shape (3,)."""
        self._phase_rad += self._step_rad
        # Two independent quadratures share the power of the whole.
        return np.asarray(
            np.cos(self._phase_rad) * self._in_phase.step()
            + np.sin(self._phase_rad) * self._quadrature.step()
        )
