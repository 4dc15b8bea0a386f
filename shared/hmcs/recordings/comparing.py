"""A replay beside its recording, in figures: what was believed, and what the fixture did."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.bus.messages import Belief
from hmcs.recognition.scoring import changes
from hmcs.recordings.guiding import Did, Guided
from hmcs.recordings.replaying import Replay

COMPARED = ("probabilities", "unknown", "log_likelihood", "mean_log_likelihood", "segment_start")
"""What makes two beliefs the same, bit by bit."""
CLOSE = 0.02
"""Factors that differ by less are told as the same."""
SAME_EVENT_S = 1.0
"""A fixture that lets go, or takes hold, farther apart in time does so for other reasons."""


class Comparison(NamedTuple):
    """Two recognizers side by side."""

    steps: int
    compared: int
    """Steps both said something of, with all evidence."""
    same_bits: int
    """Of those, with the very same belief; only the same model can have them."""
    agreement: float
    """Share of the compared steps with the same likely state; NaN where there is none."""
    later_steps: float
    """Median of how much later than the recorded one the replayed changes to the same state; NaN
    where it never does."""
    replayed_right: float
    """Share of the labeled steps that are right; NaN where the recording has no labels."""
    recorded_right: float
    times_real: float
    """How many times as fast as it happened."""


class FixtureComparison(NamedTuple):
    """What the fixture did and would have done, side by side; NaN for what there is none of."""

    ticks: int
    """Samples of the operator."""
    compared: int
    """Of those, with a recorded answer of the fixture."""
    factor_apart: float
    """Mean difference of the factors k, regardless of sign."""
    factor_close: float
    """Share of the compared ticks with the same k, within `CLOSE`."""
    same_state: float
    """Share of the compared ticks with the same state's fixture, or none."""
    guides_both: float
    """Share of the compared ticks in which both are stiffer than free motion..."""
    guides_recorded_only: float
    """...only the recorded one was..."""
    guides_replayed_only: float
    """...only the replayed one is."""
    directions_apart_deg: float
    """Mean angle between the preferred directions, where both guide."""
    velocities_apart_mm_s: float
    """Root of the mean squared difference of the commanded velocities."""
    recorded_off_guide_mm: float
    """Mean of how far the robot was beside the guide it had..."""
    replayed_off_guide_mm: float
    """...and of how far the same robot is beside the guide it would have had."""
    recorded_takes_hold: int
    """How often it began to guide while the operator drove."""
    replayed_takes_hold: int
    takes_hold_later_ms: float
    """Median of how much later than the recorded one the replayed does so."""
    recorded_lets_go: int
    """How often it went over to free motion while the operator drove."""
    replayed_lets_go: int
    lets_go_later_ms: float
    """Median of how much later than the recorded one the replayed does so."""
    times_real: float
    """How many times as fast as it happened."""


def compared(replay: Replay) -> Comparison:
    """Return how a replay stands to what was recorded, and both to the labels."""
    pairs = [
        (believed.replayed, believed.recorded)
        for believed in replay.beliefs
        if believed.recorded is not None and not believed.recorded.missing_gestemes
    ]
    alike = [now.likely_state == then.likely_state for now, then in pairs]
    labeled = [believed for believed in replay.beliefs if believed.label is not None]
    right = [believed.replayed.likely_state == believed.label for believed in labeled]
    was_right = [
        believed.recorded.likely_state == believed.label
        for believed in labeled
        if believed.recorded is not None
    ]
    return Comparison(
        len(replay.beliefs),
        len(pairs),
        sum(same_bits(now, then) for now, then in pairs),
        _mean(alike),
        _later_steps(pairs),
        _mean(right),
        _mean(was_right),
        replay.lasted_s / max(replay.spent_s, 1e-9),
    )


def same_bits(one: Belief, other: Belief) -> bool:
    """Return whether two beliefs are of one model and the same to the last bit."""
    return one.model_hash == other.model_hash and all(
        np.array_equal(getattr(one, name), getattr(other, name)) for name in COMPARED
    )


def fixtures_compared(guided: Guided) -> FixtureComparison:
    """Return how what the fixture would have done stands to what it did."""
    ticks = [(tick.log_ns / 1e6, tick.now, tick.then) for tick in guided.ticks if tick.then]
    times_ms = np.array([at_ms for at_ms, _, _ in ticks])
    now, then = [now for _, now, _ in ticks], [then for _, _, then in ticks]
    apart = [abs(a.factor - b.factor) for a, b in zip(now, then, strict=True)]
    guides = [(a.guides, b.guides) for a, b in zip(now, then, strict=True)]
    off_now_mm, off_then_mm = (
        [1e3 * did.off_guide_m for did in side if did.off_guide_m is not None]
        for side in (now, then)
    )
    holds_now, holds_then = (_events(side, guides=True) for side in (now, then))
    goes_now, goes_then = (_events(side, guides=False) for side in (now, then))
    lasted_s = (guided.ticks[-1].log_ns - guided.ticks[0].log_ns) / 1e9 if guided.ticks else 0.0
    return FixtureComparison(
        len(guided.ticks),
        len(ticks),
        _mean(apart),
        _mean([each <= CLOSE for each in apart]),
        _mean([a.state == b.state for a, b in zip(now, then, strict=True)]),
        _mean([both == (True, True) for both in guides]),
        _mean([both == (False, True) for both in guides]),
        _mean([both == (True, False) for both in guides]),
        _mean(
            [
                _angle_deg(a.direction, b.direction)
                for a, b in zip(now, then, strict=True)
                if a.direction.any() and b.direction.any()
            ]
        ),
        1e3 * _rms([a.velocity - b.velocity for a, b in zip(now, then, strict=True)]),
        _mean(off_then_mm),
        _mean(off_now_mm),
        len(holds_then),
        len(holds_now),
        _later_ms(times_ms[holds_now], times_ms[holds_then]),
        len(goes_then),
        len(goes_now),
        _later_ms(times_ms[goes_now], times_ms[goes_then]),
        lasted_s / max(guided.spent_s, 1e-9),
    )


def rows_of(replay: Replay, guided: Guided) -> Iterator[dict[str, object]]:
    """Yield a row for every step: what is and was believed, how surely, and how stiff that made it.

    Factor and compliance are those of the tick at the sample that completed the step.
    """
    first_ns = replay.beliefs[0].log_ns if replay.beliefs else 0
    ticks = {(tick.device, tick.sample): tick for tick in guided.ticks}
    for believed in replay.beliefs:
        then = believed.recorded
        tick = None if believed.sample is None else ticks.get((believed.clock, believed.sample))
        now_did, then_did = (None, None) if tick is None else (tick.now, tick.then)
        yield {
            "time_s": (believed.log_ns - first_ns) / 1e9,
            "step": believed.step,
            "label": believed.label or "",
            "recorded_state": "" if then is None else then.likely_state,
            "recorded_probability": "" if then is None else then.confidence,
            "replayed_state": believed.replayed.likely_state,
            "replayed_probability": believed.replayed.confidence,
            "replayed_unknown": believed.replayed.unknown,
            "recorded_factor": "" if then_did is None else then_did.factor,
            "recorded_compliance": "" if then_did is None else then_did.compliance,
            "replayed_factor": "" if now_did is None else now_did.factor,
            "replayed_compliance": "" if now_did is None else now_did.compliance,
        }


def _later_steps(pairs: list[tuple[Belief, Belief]]) -> float:
    names = sorted({state for pair in pairs for belief in pair for state in belief.states})
    now, then = ([names.index(pair[side].likely_state) for pair in pairs] for side in (0, 1))
    later = []
    for at in changes(then):
        near = [t - at for t in changes(now) if now[t] == then[at]]
        if near:
            later.append(min(near, key=abs))
    return float(np.median(later)) if later else float("nan")


def _events(side: Sequence[Did], *, guides: bool) -> list[int]:
    """Ticks at which it begins to guide, or ends, while the operator drives."""
    return [
        k
        for k, (before, did) in enumerate(pairwise(side), start=1)
        if did.engaged and did.guides == guides and before.guides != guides
    ]


def _later_ms(now_ms: NDArray[np.float64], then_ms: NDArray[np.float64]) -> float:
    """Median of how much later each of `then_ms` has its nearest in `now_ms`."""
    if not len(now_ms):
        return float("nan")
    nearest = [float(min(now_ms - at_ms, key=abs)) for at_ms in then_ms]
    later = [later_ms for later_ms in nearest if abs(later_ms) <= 1e3 * SAME_EVENT_S]
    return float(np.median(later)) if later else float("nan")


def _angle_deg(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    cosine = float(one @ other) / float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def _rms(differences: Sequence[NDArray[np.float64]]) -> float:
    if not differences:
        return float("nan")
    return float(np.sqrt(np.mean(np.sum(np.square(differences), axis=1))))


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else float("nan")
