"""Tremor as real devices sample it, and the filters that take it out."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from hypothesis import strategies as st

from hmcs.fixtures.filters.tremor import FourierCombiner, Notch, TremorFilter

PERIOD_S = 0.01


def passed(filtered: TremorFilter, twists: np.ndarray, times_s: np.ndarray) -> np.ndarray:
    apart_s = np.diff(times_s, prepend=times_s[0] - PERIOD_S)
    return np.array(
        [filtered.filtered(t, apart) for t, apart in zip(twists, apart_s.tolist(), strict=True)]
    )


def even(rate_hz: float, seconds: float) -> np.ndarray:
    return np.arange(0.0, seconds, 1.0 / rate_hz)


# --- how real devices sample ----------------------------------------------------------------------


def jittered(times_s: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """By an eighth of the interval, so that neighbors may even come at once."""
    return np.sort(times_s + 0.125 * times_s[1] * rng.standard_normal(len(times_s)))


def late(times_s: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A fifth of them, by 8 ms."""
    return np.sort(times_s + 0.008 * (rng.random(len(times_s)) < 0.2))


def dropped(times_s: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """One in ten never comes."""
    return times_s[rng.random(len(times_s)) > 0.1]


def bunched(times_s: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Four at a time, 0.2 ms apart; now and then one is stamped before the one before it."""
    begins = np.repeat(times_s[::4], 4)[: len(times_s)]
    within = 2e-4 * (np.arange(len(times_s)) % 4)
    return np.asarray(begins + within - 3e-4 * (rng.random(len(times_s)) < 0.02))


def mixed(times_s: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The rate changes every second."""
    rates = rng.choice([30.0, 60.0, 100.0, 250.0, 1000.0], size=int(times_s[-1]) + 1)
    return np.concatenate([k + even(rate, 1.0) for k, rate in enumerate(rates)])


SAMPLINGS: dict[str, Callable[[np.ndarray, np.random.Generator], np.ndarray]] = {
    "even": lambda times_s, _: times_s,
    "jittered": jittered,
    "late": late,
    "dropped": dropped,
    "mixed": mixed,
}
FILTERS: dict[str, Callable[[], TremorFilter]] = {
    "notch": lambda: Notch(10.0, 0.7),
    "fourier": lambda: FourierCombiner(10.0),
}
samplings = st.sampled_from(sorted(SAMPLINGS))
filters = st.sampled_from(sorted(FILTERS))
rates_hz = st.floats(np.log(30.0), np.log(1000.0)).map(lambda log: float(np.exp(log)))
tremors_hz = st.lists(st.floats(8.0, 12.0), min_size=6, max_size=6)
seeds = st.integers(0, 2**31)


def tremor_of(times_s: np.ndarray, hz: list[float], rng: np.random.Generator) -> np.ndarray:
    """40 mm/s on each of six axes, each at its own frequency."""
    phases = rng.uniform(0.0, 2.0 * np.pi, 6)
    return np.asarray(0.04 * np.sin(2.0 * np.pi * np.outer(times_s, hz) + phases))
