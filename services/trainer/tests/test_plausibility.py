"""Implausible demonstrations get a finding with file, time and remedy; human ones get none."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.errors import UserError
from hmcs.motion.demonstrations import Demonstration, read_csv, write_csv
from hmcs.motion.lasa import drawings, read_drawing, shapes
from hmcs.recognition.learning import learn
from hmcs.recognition.segments import LearningError
from hmcs.task import Task, find_task, load_task, shipped_tasks
from hmcs_trainer.plausibility import Finding, implausible
from hmcs_trainer.training import checked, train
from hmcs_trainer.validation import findings

TASK = Task.model_validate(
    {
        "format": "hmcs-task/1",
        "name": "carry",
        "dead_zone_m": 0.008,
        "gestemes": [{"name": "up"}, {"name": "over"}, {"name": "down"}],
        "states": [
            {"name": "take", "gestemes": ["up"], "next": ["bring"]},
            {"name": "bring", "gestemes": ["over"], "next": ["set"]},
            {"name": "set", "gestemes": ["down"], "next": []},
        ],
        "start": ["take"],
        "workspace": {"lower_m": [0.45, -0.30, 0.30], "upper_m": [0.75, 0.30, 0.70]},
        "robot": {
            "model": "puma560",
            "tool_start_m": [0.60, 0.15, 0.40],
            "tool_orientation_xyzw": [0.0, 0.70710678, 0.0, 0.70710678],
        },
    }
)
CORNERS = np.array([[0.6, 0.15, 0.4], [0.6, 0.15, 0.6], [0.6, -0.15, 0.6], [0.6, -0.15, 0.4]])


def shown(seed: int = 0, rate_hz: float = 100.0, noise_m: float = 5e-4) -> Demonstration:
    """A part taken up, brought over and set down in six seconds."""
    rng = np.random.default_rng(seed)
    count = int(2.0 * rate_hz)
    corners = CORNERS + rng.normal(0, 0.004, CORNERS.shape)
    share = np.arange(count)[:, None] / count
    parts = [(1 - share) * a + share * b for a, b in pairwise(corners)]
    positions = np.vstack(parts) + rng.normal(0, noise_m, (3 * count, 3))
    states = tuple(name for name in ("take", "bring", "set") for _ in range(count))
    return Demonstration(f"take-{seed}.csv", np.arange(3 * count) / rate_hz, positions, states)


def turned(demonstration: Demonstration, angle_rad: np.ndarray) -> Demonstration:
    half = angle_rad / 2
    quaternions = np.stack([0 * half, 0 * half, np.sin(half), np.cos(half)], axis=1)
    return demonstration._replace(orientations=quaternions)


def changed(demonstration: Demonstration, at: slice, moved_m: np.ndarray) -> Demonstration:
    positions = demonstration.positions.copy()
    positions[at] += moved_m
    return demonstration._replace(positions=positions)


def serious(*demonstrations: Demonstration) -> list[str]:
    return [finding.text for finding in findings(TASK, demonstrations) if finding.serious]


def told(*demonstrations: Demonstration) -> list[str]:
    return [finding.text for finding in findings(TASK, demonstrations)]


# --- no false alarms ------------------------------------------------------------------------------


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


def test_where_the_tracker_jumps_disagreement_is_not_told_as_well() -> None:
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
    assert not told(hand, hand._replace(name="other", positions=shown(1).positions))


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
    texts = [finding.text for finding in findings(wide, given_) if finding.serious]
    assert texts
    assert all(text.startswith("take-1.csv") and "units" in text for text in texts)


def test_of_two_that_differ_much_in_size_both_are_told() -> None:
    one = shown(1)
    half = one.positions[0] + 0.4 * (one.positions - one.positions[0])
    texts = told(shown(0), one._replace(positions=half))
    assert sum("leave it out, if it was not meant" in text for text in texts) == 6
    assert not serious(shown(0), one._replace(positions=half))


@pytest.mark.parametrize("size", [1e3, 1e6, 1e9])
def test_times_in_other_units_are_told(size: float) -> None:
    hand = shown()
    (text,) = (t for t in told(hand._replace(time_s=hand.time_s * size), shown(1)))
    assert "take-0.csv: it lasts" in text
    assert "milliseconds or nanoseconds" in text


def test_times_that_are_far_too_short_are_told() -> None:
    hand = shown()
    texts = told(hand._replace(time_s=hand.time_s / 60), shown(1))
    assert any("see that its times are seconds" in text for text in texts)


# --- holes, and ways out of the workspace ---------------------------------------------------------


def test_a_hole_in_the_samples_is_told_with_its_times() -> None:
    hand = shown()
    kept = (hand.time_s < 2.5) | (hand.time_s >= 4.5)
    hole = Demonstration(
        hand.name,
        hand.time_s[kept],
        hand.positions[kept],
        tuple(state for state, there in zip(hand.states, kept, strict=True) if there),
    )
    texts = told(hole, shown(1))
    assert any("no sample from 2.49 s to 4.50 s, and the hand moved 0.2" in t for t in texts)


def test_a_pause_without_samples_is_no_hole() -> None:
    hand = shown()
    later = hand.time_s + 5.0 * (hand.time_s >= 2.5)
    assert not told(hand._replace(time_s=later), shown(1))


def test_a_way_that_leaves_the_workspace_is_told_wherever_it_was_recorded() -> None:
    far = shown().positions[0] + 2.0 * (shown().positions - shown().positions[0])
    for moved_m in (0.0, 5.0):
        texts = told(shown()._replace(positions=far + moved_m))
        assert any("leaves the workspace by 0.1" in text and "along y" in text for text in texts)


def test_a_way_longer_than_the_workspace_is_told() -> None:
    positions = shown().positions[0] + 3.5 * (shown().positions - shown().positions[0])
    (text, *_) = told(shown()._replace(positions=positions))
    assert "the robot cannot make it" in text


# --- turns ----------------------------------------------------------------------------------------


def half_turn(sign: float, seed: int) -> Demonstration:
    return turned(shown(seed), sign * np.pi * np.clip((np.arange(600) - 200) / 199, 0, 1))


def test_of_two_ways_round_one_is_learned_and_the_other_told() -> None:
    every = [half_turn(1, 0), half_turn(-1, 1), half_turn(-1, 2)]
    (text,) = told(*every)
    assert text.startswith(
        "take-0.csv: in 'bring' the hand turns up to 360° otherwise than in take-1"
    )
    ends = learn(TASK, every).turns["over"].quaternions[-1]
    np.testing.assert_allclose(np.abs(ends), [0, 0, 1, 0], atol=1e-6)


def test_turns_that_differ_a_little_are_all_learned() -> None:
    every = [turned(shown(seed), np.linspace(0, 1 + 0.1 * seed, 600)) for seed in range(3)]
    assert not told(*every)


def test_orientations_in_some_files_only_are_told() -> None:
    (text, *_) = told(half_turn(1, 0), shown(1))
    assert "take-1.csv: it has no orientations" in text


# --- long gestemes --------------------------------------------------------------------------------


def test_a_gesteme_too_long_to_be_remembered_is_told_with_a_dead_zone_that_helps() -> None:
    fine = TASK.model_copy(update={"dead_zone_m": 1e-4})
    hands = [shown(seed, 2000.0, noise_m=0.0) for seed in range(2)]
    texts = [finding.text for finding in findings(fine, hands)]
    (text,) = (t for t in texts if "steps of dead_zone_m" in t and "'over'" in t)
    wanted = float(text.rsplit("make dead_zone_m ", 1)[1].split()[0])
    helped = TASK.model_copy(update={"dead_zone_m": wanted})
    assert not any("steps of dead_zone_m" in f.text for f in findings(helped, hands))
    assert wanted < 5e-4


# --- training -------------------------------------------------------------------------------------


@pytest.fixture
def files(tmp_path: Path) -> list[str]:
    for folder, hand in (("one", shown(0)), ("two", shown(1)), ("three", shown(2))):
        (tmp_path / folder).mkdir()
        write_csv(tmp_path / folder / "take.csv", hand)
    (tmp_path / "task.yaml").write_text(TASK.model_dump_json())
    return [str(tmp_path / folder / "take.csv") for folder in ("one", "two", "three")]


def learned(files: list[str], tmp_path: Path, **more: bool) -> list[str]:
    said: list[str] = []
    train(str(tmp_path / "task.yaml"), files, tmp_path / "m.hmcs", progress=said.append, **more)
    return said


def test_files_of_one_name_are_told_apart_and_learned_from_each(
    files: list[str], tmp_path: Path
) -> None:
    write_csv(files[1], changed(shown(1), slice(10, 12), np.array([0, 0, 0.4])))
    with pytest.raises(LearningError) as caught:
        learned(files, tmp_path)
    assert str(caught.value).startswith(f"{files[1]}: at 0.100 s")
    assert not (tmp_path / "m.hmcs").exists()


def test_implausible_demonstrations_are_learned_from_on_request(
    files: list[str], tmp_path: Path
) -> None:
    write_csv(files[1], changed(shown(1), slice(10, 12), np.array([0, 0, 0.4])))
    with pytest.raises(LearningError, match="--accept-implausible"):
        learned(files, tmp_path)
    said = learned(files, tmp_path, accept_implausible=True)
    assert any("the hand jumps" in sentence for sentence in said)
    assert (tmp_path / "m.hmcs").exists()


@pytest.mark.parametrize("copied", [False, True])
def test_the_same_file_twice_counts_once_and_is_told(
    files: list[str], tmp_path: Path, copied: bool
) -> None:
    again = files[0]
    if copied:
        again = str(tmp_path / "copy.csv")
        Path(again).write_bytes(Path(files[0]).read_bytes())
    said = learned([*files, again], tmp_path)
    (sentence,) = (s for s in said if "the same samples as" in s)
    assert "left out" in sentence
    assert "up: 3 demonstrations" in said


def test_states_are_not_found_in_what_no_hand_made(files: list[str], tmp_path: Path) -> None:
    write_csv(files[1], changed(shown(1), slice(10, 12), np.array([0, 0, 0.4])))
    with pytest.raises(LearningError, match="jumps"):
        learned(files, tmp_path, find_states=True)


def test_checking_tells_what_training_would_tell(files: list[str]) -> None:
    said: list[str] = []
    assert checked(TASK, files, said.append) == (3, 0)
    assert said == []
    write_csv(files[1], changed(shown(1), slice(10, 12), np.array([0, 0, 0.4])))
    with pytest.raises(UserError, match=r"two.take.csv: at 0.100 s the hand jumps"):
        checked(TASK, files, said.append)


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
