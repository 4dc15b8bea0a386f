"""Pace, colors, trails, history, geometry, and requests."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hmcs.bus.messages import Label, Record, Step, Train
from hmcs_console.seeing.history import LONGEST_ROWS, columns, limits, written
from hmcs_console.seeing.trails import Trail
from hmcs_console.serving.pace import next_rate_hz
from hmcs_console.shapes.geometry import box_edges, capsule, line, tube, turn_to, wxyz
from hmcs_console.shapes.palette import UNKNOWN, color_of, css
from hmcs_console.teaching import requests

# --- pace -----------------------------------------------------------------------------------------


def test_the_rate_halves_while_drawing_takes_longer_than_its_period_but_not_below_two() -> None:
    rates = [30.0]
    for _ in range(6):
        rates.append(next_rate_hz(rates[-1], took_s=1.0, wanted_hz=30.0))
    assert rates == [30.0, 15.0, 7.5, 3.75, 2.0, 2.0, 2.0]


def test_the_rate_recovers_once_there_is_time_to_spare() -> None:
    rate = 2.0
    for _ in range(6):
        rate = next_rate_hz(rate, took_s=0.01, wanted_hz=30.0)
    assert rate == 30.0


def test_the_rate_stays_where_the_faster_one_would_be_too_much() -> None:
    assert next_rate_hz(15.0, took_s=0.03, wanted_hz=30.0) == 15.0


# --- colors ---------------------------------------------------------------------------------------


def test_each_state_has_its_color_and_a_stranger_is_gray() -> None:
    states = ("one", "two", "three")
    assert len({color_of(state, states) for state in states}) == 3
    assert color_of("four", states) == color_of("", states) == UNKNOWN


def test_more_states_than_colors_still_have_one() -> None:
    states = tuple(f"s{number}" for number in range(20))
    assert all(color_of(state, states) != UNKNOWN for state in states)


def test_a_page_reads_colors_in_hexadecimal() -> None:
    assert css((255, 0, 16)) == "#ff0010"


# --- trails and history ---------------------------------------------------------------------------


def along_x(x: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array([x, 0.0, 0.0])


def test_a_trail_keeps_its_newest_pieces_only() -> None:
    trail = Trail(longest=3, spacing_m=0.5)
    for number in range(10):
        trail.add(along_x(number), (number, 0, 0))
    assert_allclose(trail.pieces.segments[:, 0, 0], [6, 7, 8])
    assert_allclose(trail.pieces.segments[:, 1, 0], [7, 8, 9])
    colors = trail.pieces.colors
    assert colors[:, 0, 0].tolist() == colors[:, 1, 0].tolist() == [7, 8, 9]


def test_a_trail_leaves_out_what_is_too_near() -> None:
    trail = Trail(spacing_m=0.1)
    for x in (0.0, 0.05, 0.09, 0.11):
        trail.add(along_x(x), UNKNOWN)
    assert_allclose(trail.pieces.segments[:, :, 0], [[0.0, 0.11]], rtol=1e-6)


def test_a_lifted_trail_has_no_piece_to_where_it_goes_on() -> None:
    trail = Trail()
    trail.add(along_x(0.0), UNKNOWN)
    trail.lift()
    trail.add(along_x(1.0), UNKNOWN)
    segments, colors = trail.pieces
    assert segments.shape == colors.shape == (0, 2, 3)


def test_a_trail_is_the_very_same_as_long_as_nothing_was_added() -> None:
    trail = Trail(spacing_m=0.1)
    for x in (0.0, 0.2):
        trail.add(along_x(x), UNKNOWN)
    before = trail.pieces
    trail.add(along_x(0.25), UNKNOWN)
    assert trail.pieces is before
    trail.add(along_x(0.4), UNKNOWN)
    assert len(before.segments) == 1
    assert len(trail.pieces.segments) == 2


def test_history_has_a_column_for_each_number_and_gaps_where_it_was_not_reported() -> None:
    rows = written(written((), 10.0, {"a": 1.0}), 10.5, {"a": 2.0, "b": 3.0})
    times, a, b = columns(rows, ("a", "b"))
    assert_allclose(times, [-0.5, 0.0])
    assert_allclose(a, [1.0, 2.0])
    assert_allclose(b, [np.nan, 3.0])


def test_history_is_bounded_and_never_empty() -> None:
    rows = ()
    for number in range(LONGEST_ROWS + 10):
        rows = written(rows, float(number), {})
    assert len(rows) == LONGEST_ROWS
    assert [len(column) for column in columns((), ("a",))] == [1, 1]


@pytest.mark.parametrize(
    ("numbers", "expected"),
    [
        ([0.03, np.nan, 0.18], (0.0, 0.2)),
        ([np.nan], (0.0, 1.0)),
        ([0.2], (0.0, 0.2)),
        ([-0.03, 4.1], (-0.05, 5.0)),
        ([-0.7], (-1.0, 0.0)),
    ],
)
def test_a_plot_has_round_limits_with_every_number_between_them(
    numbers: list[float], expected: tuple[float, float]
) -> None:
    assert limits([np.array(numbers)]) == pytest.approx(expected)


# --- geometry -------------------------------------------------------------------------------------


def test_a_box_has_twelve_edges_along_its_axes() -> None:
    edges = box_edges((0, 0, 0), (1, 2, 3))
    lengths = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    assert sorted(lengths) == [1] * 4 + [2] * 4 + [3] * 4


def test_a_line_through_points_has_a_piece_between_each_two() -> None:
    assert_allclose(line(np.eye(3)), [[[1, 0, 0], [0, 1, 0]], [[0, 1, 0], [0, 0, 1]]])


@pytest.mark.parametrize("seed", range(5))
def test_a_tube_keeps_its_radius_about_each_point(seed: int) -> None:
    points = np.cumsum(np.random.default_rng(seed).normal(size=(20, 3)), axis=0)
    radii = np.linspace(0.1, 0.3, 20)
    tubes = tube(points, radii, sides=6)
    rings = tubes.vertices.reshape(20, 6, 3)
    assert_allclose(np.linalg.norm(rings - points[:, None], axis=2), radii[:, None] * np.ones(6))
    assert tubes.faces.min() == 0
    assert tubes.faces.max() == len(tubes.vertices) - 1


@pytest.mark.parametrize("end", [(0, 0, 0), (0, 0, 1), (1, -2, 0.5)])
def test_every_point_of_a_capsule_is_its_radius_away_from_its_line(end: tuple[float, ...]) -> None:
    vertices, first, last = capsule((0, 0, 0), end, 0.5).vertices, np.zeros(3), np.array(end)
    length2 = max(last @ last, 1e-12)
    share = np.clip((vertices - first) @ (last - first) / length2, 0, 1)
    nearest = first + share[:, None] * (last - first)
    assert_allclose(np.linalg.norm(vertices - nearest, axis=1), 0.5, atol=1e-9)


@pytest.mark.parametrize("direction", [(0, 0, 1), (0, 0, -2), (1, 0, 0), (-1, 2, -3)])
def test_a_turn_brings_the_z_axis_into_the_direction(direction: tuple[float, ...]) -> None:
    w, x, y, z = turn_to(direction)
    turned = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]
    assert_allclose(turned, np.array(direction) / np.linalg.norm(direction), atol=1e-12)


def test_quaternions_are_reordered_for_the_page() -> None:
    assert_allclose(wxyz((1, 2, 3, 4)), (4, 1, 2, 3))


# --- wishes ---------------------------------------------------------------------------------------


def test_a_label_is_true_from_the_step_the_hand_is_making_now() -> None:
    step = Step(index=41, position=np.zeros(3), displacement=np.ones(3))
    assert requests.label("in", "clock", step) == Label(state="in", clock="clock", step=42)
    assert requests.label("in", "", None) == Label(state="in")


def test_demonstrations_are_distinguished_by_commas_and_blanks() -> None:
    asked = requests.train(" mine ", "demo", "a.csv, b.csv\n c.hdf5", "")
    assert (asked.service, asked.verb.name) == ("trainer", "train")
    assert asked.body == Train(
        model="mine", task="demo", demonstrations=("a.csv", "b.csv", "c.hdf5")
    )


def test_states_are_found_in_demonstrations_where_that_is_wished() -> None:
    for find_states in (False, True):
        body = requests.train("mine", "demo", "a.csv", "", find_states=find_states).body
        assert isinstance(body, Train)
        assert body.find_states is find_states


def test_a_recording_without_a_name_gets_one_from_the_recorder() -> None:
    assert requests.record(True, " ").body == Record(on=True)


@pytest.mark.parametrize(
    ("model", "task", "files", "reported"),
    [
        ("", "demo", "a.csv", "model '' cannot be part of a key"),
        ("a/b", "demo", "a.csv", "use 1 to 64 letters"),
        ("mine", " ", "a.csv", "name a task"),
        ("mine", "demo", " , ", "name the recordings to learn from"),
    ],
)
def test_a_training_nobody_could_carry_out_is_reported_and_not_asked_for(
    model: str, task: str, files: str, reported: str
) -> None:
    with pytest.raises(requests.RequestError, match=reported):
        requests.train(model, task, files, "")
