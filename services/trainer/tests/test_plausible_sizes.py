"""Other units, holes, ways out of the workspace and gestemes that are too long are reported."""

from __future__ import annotations

import pytest

from hmcs.motion.demonstrations import Demonstration
from hmcs_trainer.validation import findings
from support.carried import TASK, serious, shown, texts

# --- units ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("size", "unit"), [(1000.0, "millimeters"), (100.0, "centimeters"), (1 / 0.0254, "inches")]
)
def test_positions_in_other_units_are_refused_with_a_guess(size: float, unit: str) -> None:
    hand = shown()
    (text,) = serious(hand._replace(positions=hand.positions * size))
    assert "take-0.csv: its positions reach over" in text
    assert f"are they in {unit}?" in text


def test_one_file_in_other_units_among_others_is_named() -> None:
    one = shown(1)
    text, *more = serious(shown(0), one._replace(positions=one.positions * 1000), shown(2))
    assert text.startswith("take-1.csv")
    assert not any(other.startswith(("take-0", "take-2")) for other in more)


def test_one_file_ten_times_as_large_is_refused_though_it_fits_the_workspace() -> None:
    box = {"lower_m": [-9, -9, -9], "upper_m": [9, 9, 9]}
    wide = TASK.model_copy(update={"workspace": TASK.workspace.model_validate(box)})
    one = shown(1, noise_m=0.0)
    given_ = [shown(0), one._replace(positions=one.positions * 12.0), shown(2)]
    found = [finding.text for finding in findings(wide, given_) if finding.serious]
    assert found
    assert all(text.startswith("take-1.csv") and "units" in text for text in found)


def test_of_two_that_differ_much_in_size_both_are_reported() -> None:
    one = shown(1)
    half = one.positions[0] + 0.4 * (one.positions - one.positions[0])
    found = texts(shown(0), one._replace(positions=half))
    assert sum("leave it out, if it was not meant" in text for text in found) == 6
    assert not serious(shown(0), one._replace(positions=half))


@pytest.mark.parametrize("size", [1e3, 1e6, 1e9])
def test_times_in_other_units_are_reported(size: float) -> None:
    hand = shown()
    (text,) = (t for t in texts(hand._replace(time_s=hand.time_s * size), shown(1)))
    assert "take-0.csv: it lasts" in text
    assert "milliseconds or nanoseconds" in text


def test_times_that_are_far_too_short_are_reported() -> None:
    hand = shown()
    found = texts(hand._replace(time_s=hand.time_s / 60), shown(1))
    assert any("see that its times are seconds" in text for text in found)


# --- holes, and ways out of the workspace ---------------------------------------------------------


def test_a_hole_in_the_samples_is_reported_with_its_times() -> None:
    hand = shown()
    kept = (hand.time_s < 2.5) | (hand.time_s >= 4.5)
    hole = Demonstration(
        hand.name,
        hand.time_s[kept],
        hand.positions[kept],
        tuple(state for state, there in zip(hand.states, kept, strict=True) if there),
    )
    found = texts(hole, shown(1))
    assert any("no sample from 2.49 s to 4.50 s, and the hand moved 0.2" in t for t in found)


def test_a_pause_without_samples_is_no_hole() -> None:
    hand = shown()
    later = hand.time_s + 5.0 * (hand.time_s >= 2.5)
    assert not texts(hand._replace(time_s=later), shown(1))


def test_a_way_that_leaves_the_workspace_is_reported_wherever_it_was_recorded() -> None:
    far = shown().positions[0] + 2.0 * (shown().positions - shown().positions[0])
    for moved_m in (0.0, 5.0):
        found = texts(shown()._replace(positions=far + moved_m))
        assert any("leaves the workspace by 0.1" in text and "along y" in text for text in found)


def test_a_way_longer_than_the_workspace_is_reported() -> None:
    positions = shown().positions[0] + 3.5 * (shown().positions - shown().positions[0])
    (text, *_) = texts(shown()._replace(positions=positions))
    assert "the robot cannot make it" in text


# --- long gestemes --------------------------------------------------------------------------------


def test_a_gesteme_too_long_to_be_remembered_is_reported_with_a_dead_zone_that_helps() -> None:
    fine = TASK.model_copy(update={"dead_zone_m": 1e-4})
    hands = [shown(seed, 2000.0, noise_m=0.0) for seed in range(2)]
    texts = [finding.text for finding in findings(fine, hands)]
    (text,) = (t for t in texts if "steps of dead_zone_m" in t and "'over'" in t)
    wanted = float(text.rsplit("make dead_zone_m ", 1)[1].split()[0])
    helped = TASK.model_copy(update={"dead_zone_m": wanted})
    assert not any("steps of dead_zone_m" in f.text for f in findings(helped, hands))
    assert wanted < 5e-4
