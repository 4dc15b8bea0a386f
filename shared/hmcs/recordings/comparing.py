"""A replay beside its recording, in figures: what was believed, and what the fixture did."""

from __future__ import annotations

from array import array
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.bus.messages import Belief
from hmcs.recognition.scoring import changes
from hmcs.recordings.fixture_replay import FixtureReplay
from hmcs.recordings.replaying import Replay
from hmcs.recordings.ticks import FixtureOutput

COMPARED = ("probabilities", "unknown", "log_likelihood", "mean_log_likelihood", "segment_start")
"""What makes two beliefs the same, bit by bit."""
CLOSE = 0.02
"""Factors that differ by less count as the same."""
SAME_EVENT_S = 1.0
"""A fixture that lets go, or takes hold, farther apart in time does so for other reasons."""


class Comparison(NamedTuple):
    """Two recognizers side by side."""

    steps: int
    degraded: int
    """Of those, believed without all evidence live: what was believed then was no fault of the
    model, and is compared with nothing."""
    compared: int
    """The other steps both said something of."""
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
    now, then = array("q"), array("q")
    """Likely states of the compared steps, by number."""
    states: dict[str, int] = {}
    degraded = same = 0
    right: list[bool] = []
    was_right: list[bool] = []
    for believed in replay.beliefs:
        replayed, recorded = believed.replayed, believed.recorded
        if believed.label is not None:
            right.append(replayed.likely_state == believed.label)
            if recorded is not None:
                was_right.append(recorded.likely_state == believed.label)
        if recorded is None:
            continue
        if recorded.missing_gestemes:
            degraded += 1
            continue
        same += same_bits(replayed, recorded)
        for side, belief in ((now, replayed), (then, recorded)):
            side.append(states.setdefault(belief.likely_state, len(states)))
    return Comparison(
        len(replay.beliefs),
        degraded,
        len(now),
        same,
        _mean([one == other for one, other in zip(now, then, strict=True)]),
        _later_steps(now, then),
        _mean(right),
        _mean(was_right),
        replay.lasted_s / max(replay.spent_s, 1e-9),
    )


def same_bits(one: Belief, other: Belief) -> bool:
    """Return whether two beliefs are of one model and the same to the last bit."""
    return one.model_hash == other.model_hash and all(
        np.array_equal(getattr(one, name), getattr(other, name)) for name in COMPARED
    )


def fixtures_compared(fixture_replay: FixtureReplay) -> FixtureComparison:
    """Return how what the fixture would have done stands to what it did."""
    times_ms, apart, moved_apart = array("d"), array("d"), array("d")
    degrees_apart, off_now_mm, off_then_mm = array("d"), array("d"), array("d")
    same_states, both, then_only, now_only = 0, 0, 0, 0
    events = _Events(), _Events()
    for tick in fixture_replay.ticks:
        now, then = tick.now, tick.then
        if then is None:
            continue
        times_ms.append(tick.log_ns / 1e6)
        apart.append(abs(now.factor - then.factor))
        moved_apart.append(float(np.sum(np.square(now.velocity - then.velocity))))
        same_states += now.state == then.state
        both += now.guides and then.guides
        then_only += then.guides and not now.guides
        now_only += now.guides and not then.guides
        if now.direction.any() and then.direction.any():
            degrees_apart.append(_angle_deg(now.direction, then.direction))
        for did, off_mm in ((now, off_now_mm), (then, off_then_mm)):
            if did.off_guide_m is not None:
                off_mm.append(1e3 * did.off_guide_m)
        for side, did in zip(events, (now, then), strict=True):
            side.take(times_ms[-1], did)
    count = len(apart)
    holds_now, holds_then = (side.takes_hold_ms for side in events)
    goes_now, goes_then = (side.lets_go_ms for side in events)
    ticks = fixture_replay.ticks
    lasted_s = (ticks[-1].log_ns - ticks[0].log_ns) / 1e9 if ticks else 0.0
    return FixtureComparison(
        len(ticks),
        count,
        _mean(apart),
        _mean([each <= CLOSE for each in apart]),
        _share(same_states, count),
        _share(both, count),
        _share(then_only, count),
        _share(now_only, count),
        _mean(degrees_apart),
        1e3 * float(np.sqrt(_mean(moved_apart))),
        _mean(off_then_mm),
        _mean(off_now_mm),
        len(holds_then),
        len(holds_now),
        _later_ms(holds_now, holds_then),
        len(goes_then),
        len(goes_now),
        _later_ms(goes_now, goes_then),
        lasted_s / max(fixture_replay.spent_s, 1e-9),
    )


def rows_of(replay: Replay, fixture_replay: FixtureReplay) -> Iterator[dict[str, object]]:
    """Yield a row for every step: what is and was believed, how surely, and how stiff that made it.

    Factor and compliance are those of the tick at the sample that completed the step.
    """
    first_ns = replay.beliefs[0].log_ns if replay.beliefs else 0
    ticks = {(tick.device, tick.sample): number for number, tick in enumerate(fixture_replay.ticks)}
    for believed in replay.beliefs:
        then = believed.recorded
        number = None if believed.sample is None else ticks.get((believed.clock, believed.sample))
        tick = None if number is None else fixture_replay.ticks[number]
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


def _later_steps(now: Sequence[int], then: Sequence[int]) -> float:
    numbers = np.array(now, dtype=np.int64)
    changed = np.array(changes(now), dtype=np.int64)
    later = []
    for at in changes(then):
        same = changed[numbers[changed] == then[at]]
        if len(same):
            later.append(_nearest(same, at) - at)
    return float(np.median(later)) if later else float("nan")


def _nearest(places: NDArray[Any], at: float) -> float:
    """Of the rising places, one at least, the one nearest to `at`; of two the earlier one."""
    behind = int(np.searchsorted(places, at))
    beside = places[max(behind - 1, 0) : behind + 1]
    return float(beside[np.argmin(np.abs(beside - at))])


class _Events:
    """When a fixture begins to guide, and ends, while the operator drives, ms."""

    def __init__(self) -> None:
        self.takes_hold_ms, self.lets_go_ms = array("d"), array("d")
        self._guided: bool | None = None

    def take(self, at_ms: float, did: FixtureOutput) -> None:
        """Take in what it does next."""
        if did.engaged and self._guided is not None and did.guides != self._guided:
            (self.takes_hold_ms if did.guides else self.lets_go_ms).append(at_ms)
        self._guided = did.guides


def _later_ms(now_ms: Sequence[float], then_ms: Sequence[float]) -> float:
    """Median of how much later each of `then_ms` has its nearest in `now_ms`."""
    if not now_ms:
        return float("nan")
    times_ms = np.sort(now_ms)
    apart = [_nearest(times_ms, at_ms) - at_ms for at_ms in then_ms]
    later = [later_ms for later_ms in apart if abs(later_ms) <= 1e3 * SAME_EVENT_S]
    return float(np.median(later)) if later else float("nan")


def _angle_deg(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    cosine = float(one @ other) / float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def _share(count: int, of: int) -> float:
    return count / of if of else float("nan")


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if len(values) else float("nan")
