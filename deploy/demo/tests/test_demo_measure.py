from __future__ import annotations

from collections.abc import Callable
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.paths import Path
from hmcs.recognition.model import Model
from hmcs.recognition.scoring import NONE
from hmcs_demo.measure import Measured, longest_delay_ms, measure, missing_between
from hmcs_demo.recording import (
    NO_SAMPLE,
    Motions,
    Recording,
    load_recording,
    save_recording,
)
from hmcs_demo.summary import Summary
from hmcs_demo.tracks import path_errors, recognized
from hmcs_demo.truth import RunError, SampleClock, TrueStateInterval

Record = Callable[..., Recording]
MS = 1_000_000
RATE_HZ = 100.0


def test_true_segments_begin_where_the_labels_do(measured: Measured) -> None:
    assert measured.segments == (TrueStateInterval(0, 0, 200), TrueStateInterval(1, 200, 400))
    assert measured.motion_s == pytest.approx(4.0, abs=1e-6)


def test_each_step_is_of_the_state_most_of_it_was_made_in(measured: Measured) -> None:
    begun = np.concatenate([[0], measured.step_end[:-1]])
    expected = ((begun + measured.step_end) // 2 >= 200).astype(int)
    assert measured.true_states.tolist() == expected.tolist()
    assert measured.scores.accuracy > 0.9


@pytest.mark.parametrize("late_ns", [0, 4_000_000, 9_000_000])
def test_samples_are_distinguished_however_late_they_are(
    recorded: Record, performance: Demonstration, model: Model, late_ns: int
) -> None:
    measured = measure(recorded(late_ns), performance, model, RATE_HZ)
    assert measured.hand.sample.tolist() == list(range(401))


def test_latencies_are_those_of_the_recording(measured: Measured) -> None:
    assert measured.hops.input_to_command == pytest.approx(np.full(401, 2.0))
    assert measured.hops.step_to_belief == pytest.approx(np.full(len(measured.step_end), 3.0))
    # Of two states that follow the same command the first one counts.
    assert measured.hops.input_to_robot == pytest.approx(np.full(401, 5.0))


def test_robot_figures_are_those_of_the_recording(measured: Measured) -> None:
    assert measured.tracking_error_m_s == pytest.approx(np.full(802, 3e-3))
    assert (measured.collisions, measured.stops) == (0, 0)


def test_collisions_and_stops_are_counted_as_they_begin(
    recorded: Record, performance: Demonstration, model: Model
) -> None:
    recording = recorded()
    contact = np.zeros(802, dtype=bool)
    contact[[0, 1, 5, 6, 801]] = True
    stop = np.array(["none"] * 802, dtype="<U20")
    stop[10:13], stop[13:15], stop[30] = "stale_command", "disengaged", "collision"
    robot = recording.robot._replace(in_contact=contact, stop=stop)
    measured = measure(recording._replace(robot=robot), performance, model, RATE_HZ)
    assert (measured.collisions, measured.stops) == (3, 2)


@pytest.mark.parametrize(("dead_man", "stops"), [(True, 1), (False, 0)])
def test_stop_the_fixture_makes_counts_unless_the_operator_has_let_go(
    recorded: Record, performance: Demonstration, model: Model, dead_man: bool, stops: int
) -> None:
    recording = recorded()
    stop = np.array(["none"] * 802, dtype="<U20")
    stop[100:] = "disengaged"
    held = recording.motions.dead_man.copy()
    since = np.searchsorted(recording.motions.sample, recording.robot.sample[100])
    held[since:] = dead_man
    recording = recording._replace(
        robot=recording.robot._replace(stop=stop), motions=recording.motions._replace(dead_man=held)
    )
    assert measure(recording, performance, model, RATE_HZ).stops == stops


def with_stop(recording: Recording, stops_at: int, pauses_at: int, paused: int) -> Recording:
    """The robot stops at a played sample; the operator lets go at another, and then presses again.

    What the hand moved meanwhile the robot did not follow.
    """

    def later(rows: Any) -> Any:
        after = np.asarray(rows.sample) > 70 + pauses_at
        return rows._replace(
            sample=rows.sample + paused * after,
            captured_ns=rows.captured_ns + 10 * paused * MS * after,
            received_ns=rows.received_ns + 10 * paused * MS * after,
        )

    motions = recording.motions
    stands = motions.position[np.searchsorted(motions.sample, 70 + pauses_at)]
    at = int(np.searchsorted(motions.sample, 70 + pauses_at, side="right"))
    waits = np.arange(1, paused + 1)
    captured_ns = motions.captured_ns[at - 1] + 10 * MS * waits
    shifted = later(motions)
    columns = {
        "sample": 70 + pauses_at + waits,
        "captured_ns": captured_ns,
        "received_ns": captured_ns + MS,
        "position": np.tile(stands, (paused, 1)),
        # The first sample with the dead-man pressed again is the one it was let go at.
        "dead_man": waits == paused,
    }
    motions = shifted._replace(
        **{
            name: np.insert(getattr(shifted, name), at, new, axis=0)
            for name, new in columns.items()
        }
    )
    robot = recording.robot
    number = robot.sample - 70
    standing = (number > stops_at) & (number <= pauses_at)
    before = np.searchsorted(number, stops_at)
    missed_m = robot.tool_position[np.searchsorted(number, pauses_at)] - (
        stood_at := robot.tool_position[before]
    )
    tool = robot.tool_position - missed_m * (number > pauses_at)[:, None]
    tool[standing] = stood_at
    robot = later(robot)._replace(
        tool_position=tool,
        stop=np.where(standing, "stale_command", "none"),
        sample=np.where(standing, NO_SAMPLE, later(robot).sample),
    )
    beliefs = recording.beliefs
    paused_ns = recording.motions.captured_ns[at - 1]
    late = beliefs.received_ns - 4 * MS > paused_ns
    return recording._replace(
        motions=motions,
        steps=later(recording.steps),
        commands=later(recording.commands),
        fixtures=later(recording.fixtures),
        beliefs=beliefs._replace(received_ns=beliefs.received_ns + 10 * paused * MS * late),
        robot=robot,
    )


@pytest.mark.parametrize(
    ("stops_at", "pauses_at"), [(100, 130), (190, 215)], ids=["within a segment", "at a switch"]
)
def test_operator_who_lets_go_and_presses_again_shifts_no_sample_and_makes_no_path_error(
    recorded: Record,
    performance: Demonstration,
    model: Model,
    measured: Measured,
    stops_at: int,
    pauses_at: int,
) -> None:
    again = measure(with_stop(recorded(), stops_at, pauses_at, 50), performance, model, RATE_HZ)
    assert again.stops == 1
    assert again.hand.sample.tolist() == sorted([*range(401), pauses_at])
    assert again.step_end.tolist() == measured.step_end.tolist()
    assert again.true_states.tolist() == measured.true_states.tolist()
    assert again.scores == measured.scores
    later = measured.step_end > pauses_at
    assert again.step_time_s - measured.step_time_s == pytest.approx(0.5 * later)
    assert again.belief_delay_ms == pytest.approx(measured.belief_delay_ms)
    assert again.motion_s == pytest.approx(measured.motion_s + 0.5)
    assert again.clock.when(pauses_at - 1) == pytest.approx((pauses_at - 1) / RATE_HZ)
    assert again.clock.when(pauses_at + 1) == pytest.approx((pauses_at + 1) / RATE_HZ + 0.5)
    assert np.nanmax(again.hand.error_m) < 1e-3
    assert np.nanmax(again.tool.error_m) < 1e-3
    followed = ~np.isin(np.arange(401), range(stops_at + 1, pauses_at + 1))
    assert sorted(set(again.tool.sample.tolist())) == np.flatnonzero(followed).tolist()


@pytest.mark.parametrize("hung", [0, 30], ids=["samples lost", "recording waited"])
def test_gap_in_the_samples_is_distinguished_from_a_hang_by_where_the_hand_is_then(
    recorded: Record, performance: Demonstration, model: Model, hung: int
) -> None:
    recording = recorded()
    motions = recording.motions
    kept = (motions.sample <= 70 + 150) | (motions.sample > 70 + 180 - hung)
    after = motions.sample > 70 + 150
    motions = motions._replace(**{k: column[kept] for k, column in motions._asdict().items()})
    shift_ns = 10 * hung * MS * after[kept]
    motions = motions._replace(
        captured_ns=motions.captured_ns + shift_ns, received_ns=motions.received_ns + shift_ns
    )
    clock = SampleClock(performance, model.state_names, RATE_HZ, motions)
    held = motions.sample[motions.dead_man]
    assert clock.number(held).tolist() == (held - 70).tolist()


def test_step_without_a_belief_is_missing_and_waits_for_the_next_one(
    recorded: Record, performance: Demonstration, model: Model
) -> None:
    measured = measure(recorded(without=(10,)), performance, model, RATE_HZ)
    assert measured.scores.missing_steps == 1
    assert measured.believed_states[10] == NONE
    assert np.isnan(measured.unknown[10])
    apart_ms = 1e3 * (measured.step_time_s[11] - measured.step_time_s[10])
    assert measured.belief_delay_ms[10] == pytest.approx(apart_ms + 3.0)
    at_s = float(measured.step_time_s[10])
    assert longest_delay_ms(measured, at_s, 0.05) == pytest.approx(apart_ms + 3.0)
    assert missing_between(measured, at_s - 0.01, at_s + 0.01) == 1
    assert missing_between(measured, at_s + 0.01, at_s + 1.0) == 0


def test_hand_on_the_mean_path_is_no_error_and_the_robot_is_laid_at_its_own_place(
    measured: Measured,
) -> None:
    assert np.nanmax(measured.hand.error_m) < 1e-3
    assert np.nanmax(measured.tool.error_m) < 1e-3


def test_another_motion_than_the_performance_is_refused(
    recorded: Record, performance: Demonstration, model: Model
) -> None:
    with pytest.raises(RunError, match="off the performance"):
        measure(recorded(offset_m=0.05), performance, model, RATE_HZ)


@pytest.mark.parametrize("table", ["motions", "steps", "beliefs", "commands", "robot"])
def test_run_in_which_something_was_not_seen_is_refused(
    recorded: Record, performance: Demonstration, model: Model, table: str
) -> None:
    recording = recorded()
    rows = getattr(recording, table)
    empty = type(rows)(*(column[:0] for column in rows))
    with pytest.raises(RunError, match="was seen on the bus"):
        measure(recording._replace(**{table: empty}), performance, model, RATE_HZ)


def test_hand_that_never_engages_is_refused(
    recorded: Record, performance: Demonstration, model: Model
) -> None:
    recording = recorded()
    motions: Motions = recording.motions
    motions = motions._replace(dead_man=np.zeros_like(motions.dead_man))
    with pytest.raises(RunError, match="no motion"):
        measure(recording._replace(motions=motions), performance, model, RATE_HZ)


def test_recording_comes_back_from_its_file_as_it_was(recorded: Record, tmp_path: FilePath) -> None:
    recording = recorded()
    save_recording(tmp_path / "recording.npz", recording)
    again = load_recording(tmp_path / "recording.npz")
    for table, known in zip(again[1:], recording[1:], strict=True):
        for column, expected in zip(table, known, strict=True):
            assert np.array_equal(column, expected)
    assert again.states.tolist() == recording.states.tolist()


def test_path_error_is_the_distance_to_the_path() -> None:
    path = Path(np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0]], dtype=float))
    points = np.array([[0.0, 0.01, 0], [0.05, -0.02, 0], [0.09, 0.05, 0], [0.1, 0.13, 0]])
    assert path_errors(path, points) == pytest.approx([0.01, 0.02, 0.01, 0.03], abs=1e-4)


def test_path_error_does_not_go_back_where_a_path_turns_close_beside_itself() -> None:
    there_and_back = Path(np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.01, 0], [0, 0.01, 0]]))
    # The hand turns early: the nearest points to its way back are on the way there.
    x = np.concatenate([np.linspace(0, 0.07, 20), np.linspace(0.07, 0.0, 20)])
    y = np.concatenate([np.zeros(20), np.full(20, 0.004)])
    errors = path_errors(there_and_back, np.stack([x, y, np.zeros(40)], axis=1))
    assert errors[-1] == pytest.approx(0.006, abs=1e-4)


@settings(max_examples=30)
@given(st.lists(st.tuples(*[st.floats(-0.02, 0.02)] * 3), min_size=1, max_size=5))
def test_matching_is_the_best_monotone_one(displacements: list[tuple[float, ...]]) -> None:
    path = Path(np.array([[0, 0, 0], [0.003, 0, 0], [0.003, 0.002, 0]]))
    points = path.at(np.linspace(0, path.length_m, 11))
    given_points = np.array(displacements)
    squared = ((given_points[:, None] - points) ** 2).sum(axis=2)

    def least(first: int, row: int) -> float:
        if row == len(squared):
            return 0.0
        return min(squared[row, j] + least(j, row + 1) for j in range(first, 11))

    errors = path_errors(path, given_points)
    assert float((errors**2).sum()) == pytest.approx(least(0, 0), abs=1e-12)


def test_motion_has_the_color_of_the_step_it_was_part_of() -> None:
    finished, believed = np.array([3, 5]), np.array([7, 8])
    colors = recognized(np.arange(8), finished, believed)
    assert colors.tolist() == [7, 7, 7, 7, 8, 8, 8, 8]


def test_summary_counts_the_swap_from_the_hands_first_motion(summary: Summary) -> None:
    assert summary.swap.at_s == pytest.approx(2.0)
    assert summary.swap.ready_after_s == pytest.approx(0.5)
    assert summary.swap.longest_belief_gap_ms == pytest.approx(3.0)
    assert summary.velocity_tracking_mm_s_rms == pytest.approx(3.0)
    assert summary.latency_ms.input_to_command.p99 == pytest.approx(2.0)
