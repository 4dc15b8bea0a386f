"""Implausible demonstrations get a finding with file, time and remedy; human ones get none."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.motion.demonstrations import Demonstration, read_csv
from hmcs.motion.lasa import drawings, read_drawing, shapes
from hmcs.task import find_task, load_task, shipped_tasks
from hmcs_trainer.plausibility import Finding, implausible
from hmcs_trainer.validation import findings
from support.carried import TASK, changed, serious, shown, texts, turned

# --- no false alarms ------------------------------------------------------------------------------


@pytest.mark.long
def test_what_people_drew_passes_without_a_word() -> None:
    task = load_task("human-shapes")
    assert task.drawings is not None
    for shape in shapes():
        for number, (time_s, drawn_m) in enumerate(drawings(shape), start=1):
            positions = np.column_stack([0 * time_s, task.drawings.scale * drawn_m])
            each = Demonstration(f"{shape}/{number}", time_s, positions, (None,) * len(time_s))
            assert implausible(task, each) == []
    every = [read_drawing(g.name, number, task) for g in task.gestemes for number in range(1, 8)]
    assert findings(task, every) == []


def test_what_comes_along_passes_without_a_word() -> None:
    files = [find_task(name).with_suffix(".csv") for name in shipped_tasks()]
    written = [(load_task(file.stem), read_csv(file)) for file in files if file.is_file()]
    assert len(written) == 3
    for task, demonstration in written:
        assert implausible(task, demonstration) == []


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 1_000),
    st.sampled_from([10.0, 30.0, 100.0, 1000.0]),
    st.floats(0.0, 1.5e-3),
    st.floats(0.3, 4.0),
)
def test_a_hand_passes_at_any_rate_with_any_noise_and_pace(
    seed: int, rate_hz: float, noise_m: float, pace: float
) -> None:
    hand = shown(seed, rate_hz, noise_m)
    assert implausible(TASK, hand._replace(time_s=hand.time_s / pace)) == []


def test_a_hand_that_flicks_from_rest_passes() -> None:
    # 30 cm in a third of a second, smoothly: as fast as a hand reaches.
    time_s = np.arange(0, 2, 0.01)
    share = np.clip((time_s - 0.8) / 0.33, 0, 1)
    smooth = 10 * share**3 - 15 * share**4 + 6 * share**5
    positions = smooth[:, None] * [0.0, 0.3, 0.0]
    hand = Demonstration("flick", time_s, positions, ("bring",) * len(time_s))
    assert implausible(TASK, hand) == []


def test_a_device_that_loses_some_samples_passes() -> None:
    hand = shown()
    kept = np.random.default_rng(0).uniform(size=len(hand.time_s)) > 0.2
    thinned = Demonstration(
        hand.name,
        hand.time_s[kept],
        hand.positions[kept],
        tuple(state for state, there in zip(hand.states, kept, strict=True) if there),
    )
    assert implausible(TASK, thinned) == []


def test_a_recorder_that_was_held_up_makes_no_jump_of_a_hand_that_went_on() -> None:
    hand = shown(noise_m=0.0)
    kept = np.ones(len(hand.time_s), dtype=bool)
    # For 0.3 s nothing was heard of the hand, and the sample before came as late as the next.
    kept[251:281] = False
    time_s = hand.time_s.copy()
    time_s[250] = time_s[281] - 0.001
    late = Demonstration(
        hand.name,
        time_s[kept],
        hand.positions[kept],
        tuple(state for state, there in zip(hand.states, kept, strict=True) if there),
    )
    assert np.linalg.norm(np.diff(late.positions, axis=0), axis=1).max() > 0.04
    assert implausible(TASK, late) == []


# --- jumps ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("rate_hz", [5.0, 20.0, 100.0, 1000.0])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.5, 0.9999])
def test_a_sample_that_the_tracker_lost_is_refused_with_file_and_time(
    rate_hz: float, share: float
) -> None:
    hand = shown(rate_hz=rate_hz)
    k = int(share * len(hand.time_s))
    lost = hand._replace(positions=hand.positions.copy())
    lost.positions[k] = 0.0
    (text,) = serious(lost)
    at_s = hand.time_s[max(k, 1)]
    assert text.startswith(f"take-0.csv: at {at_s:.3f} s the hand jumps by 0.")
    assert "Take these samples out" in text


@pytest.mark.parametrize("size_m", [0.03, 0.1, 0.5])
def test_a_jump_that_stays_is_refused(size_m: float) -> None:
    (text,) = serious(changed(shown(), slice(300, None), np.array([size_m, 0, 0])))
    assert "at 3.000 s" in text
    told_m = float(text.split("jumps by ")[1].split()[0])
    assert told_m == pytest.approx(size_m, abs=0.005)


def test_a_jump_where_nothing_is_labeled_does_no_harm() -> None:
    hand = changed(shown(), slice(50, 60), np.array([0.3, 0, 0]))
    states = tuple(None if k < 100 else state for k, state in enumerate(hand.states))
    assert not serious(hand._replace(states=states), shown(1))


def test_where_the_tracker_jumps_disagreement_is_not_reported_as_well() -> None:
    jumping = changed(shown(), slice(300, None), np.array([0.0, 0.0, 2.0]))
    (text,) = serious(jumping, shown(1), shown(2))
    assert "jumps" in text


def test_a_hand_that_is_turned_in_no_time_is_refused() -> None:
    hand = turned(shown(), np.linspace(0, 1, 600))
    assert hand.orientations is not None
    hand.orientations[250] = [1.0, 0.0, 0.0, 0.0]
    (text,) = serious(hand)
    assert "at 2.500 s the hand turns by 180° within 10 ms (and 1 times more)" in text


def test_the_sign_of_a_quaternion_is_no_turn() -> None:
    hand = turned(shown(), np.linspace(0, 1, 600))
    assert hand.orientations is not None
    hand.orientations[::2] *= -1
    assert not texts(hand, hand._replace(name="other", positions=shown(1).positions))


# --- training -------------------------------------------------------------------------------------


def test_findings_name_a_remedy() -> None:
    hand = shown()
    for strange in (
        changed(hand, slice(300, None), np.array([0.5, 0, 0])),
        hand._replace(positions=hand.positions * 1000),
        hand._replace(time_s=hand.time_s * 1000),
    ):
        for finding in implausible(TASK, strange):
            assert isinstance(finding, Finding)
            assert finding.text.startswith("take-0.csv: ")
            assert any(word in finding.text for word in ("out", "Give", "show it", "see that"))
