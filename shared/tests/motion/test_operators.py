"""The synthetic operator of the thesis, 3.1.5."""

from __future__ import annotations

import dataclasses
import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.motion.operators import (
    Operator,
    OperatorStuckError,
    TaskSegment,
    follow,
    joined,
    perform,
)
from hmcs.motion.paths import Path
from hmcs.motion.references import (
    References,
    random_gesteme,
    random_gestemes,
    random_performance,
)
from hmcs.task import load_task

LINE = np.linspace((0, 0, 0), (1, 0, 0), 41)


def test_without_noise_a_line_is_followed_in_even_steps() -> None:
    trace = follow(LINE, Operator(noise=0), np.random.default_rng(0))
    np.testing.assert_allclose(trace.positions[:, 1:], 0, atol=1e-12)
    np.testing.assert_allclose(np.diff(trace.positions[:, 0]), 0.05, atol=1e-12)
    assert 0.9 - 1e-9 <= trace.positions[-1, 0] <= 1.0


def test_without_noise_an_arc_is_followed_within_what_the_look_ahead_cuts() -> None:
    angle = np.linspace(0, 2 * np.pi, 400)
    arc = 0.4 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    trace = follow(arc, Operator(noise=0), np.random.default_rng(0))
    radius = np.linalg.norm(trace.positions, axis=1)
    assert np.abs(radius - 0.4).max() < 0.03
    turned = np.unwrap(np.arctan2(trace.positions[:, 1], trace.positions[:, 0]))
    assert turned[-1] > 2 * np.pi - 0.3


def test_a_step_is_what_3_1_5_says_by_hand() -> None:
    operator = Operator(step_m=0.05, noise=0.2, look_ahead_m=0.15)
    trace = follow(LINE[:, :2], operator, np.random.default_rng(3))
    rng = np.random.default_rng(3)
    q, d = np.zeros(2), np.array([1.0, 0.0])
    for seen in trace.positions[1:4]:
        ahead = [p for p in LINE[:, :2] if np.linalg.norm(p - q) > 0.15 and p[0] > q[0]]
        towards = (ahead[0] - q) / np.linalg.norm(ahead[0] - q)
        d = (towards + d) / 2 + 0.2 * rng.standard_normal(2)
        d = d / np.linalg.norm(d)
        q = q + 0.05 * (1 + 2 * 0.2 * rng.standard_normal()) * d
        np.testing.assert_allclose(seen, q, atol=1e-12)


def test_step_lengths_have_the_spread_of_the_thesis() -> None:
    long_line = np.linspace((0, 0), (400, 0), 16001)
    trace = follow(long_line, Operator(noise=0.3), np.random.default_rng(0))
    moved = np.diff(trace.positions, axis=0)
    lengths = np.linalg.norm(moved, axis=1)
    # |δ(1 + 2κΓ)|: its mean square is δ²(1 + 4κ²); one in twenty is negative at κ = 0.3.
    assert np.mean(lengths**2) == pytest.approx(0.05**2 * (1 + 4 * 0.3**2), rel=0.05)
    negative = 0.5 * math.erfc(1 / 0.6 / math.sqrt(2))
    backwards = np.mean(moved[:, 0] < 0)
    assert negative == pytest.approx(0.048, abs=0.001)
    assert backwards >= 0.8 * negative


def test_not_renormalizing_lets_the_error_change_the_length_too() -> None:
    long_line = np.linspace((0, 0, 0), (100, 0, 0), 4001)
    lengths = [
        np.linalg.norm(
            np.diff(
                follow(
                    long_line,
                    Operator(noise=0.3, renormalize=renormalize),
                    np.random.default_rng(0),
                ).positions,
                axis=0,
            ),
            axis=1,
        ).std()
        for renormalize in (True, False)
    ]
    assert lengths[1] != pytest.approx(lengths[0], rel=0.01)


@settings(max_examples=30)
@given(
    st.integers(0, 10_000), st.sampled_from([2, 3]), st.sampled_from(["line", "circle", "mixed"])
)
def test_the_hand_arrives_and_passes_every_segment_in_order(
    seed: int, dimensions: int, kind: Any
) -> None:
    rng = np.random.default_rng(seed)
    gestemes = random_gestemes(References(kind=kind, dimensions=dimensions), 4, rng)
    reference, owners = joined(gestemes, 0.025)
    trace = follow(reference[:, :dimensions], Operator(noise=0.15), rng, owners)
    assert (np.diff(trace.segments) >= 0).all()
    assert set(trace.segments) == {0, 1, 2, 3}
    assert np.linalg.norm(trace.positions[-1] - reference[-1, :dimensions]) <= 0.1
    distance = [
        np.linalg.norm(reference[:, :dimensions] - q, axis=1).min() for q in trace.positions
    ]
    assert max(distance) < 0.4


def test_the_same_seed_makes_the_same_motion() -> None:
    traces = [follow(LINE, Operator(), np.random.default_rng(7)).positions for _ in range(2)]
    np.testing.assert_array_equal(traces[0], traces[1])


def test_a_hand_too_noisy_to_arrive_gives_up() -> None:
    with pytest.raises(OperatorStuckError, match="noise"):
        follow(LINE, Operator(noise=50, most_steps=2), np.random.default_rng(0))


@pytest.mark.parametrize("reference", [np.zeros((1, 3)), np.zeros((5, 4)), np.zeros((5, 3))])
def test_a_reference_that_leads_nowhere_is_refused(reference: np.ndarray) -> None:
    with pytest.raises(ValueError, match="reference"):
        follow(reference, Operator(), np.random.default_rng(0))


@pytest.mark.parametrize("change", [{"step_m": 0}, {"noise": -1}, {"look_ahead_m": math.nan}])
def test_an_operator_that_cannot_move_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=next(iter(change))):
        dataclasses.replace(Operator(), **change)


@given(st.integers(0, 10_000), st.sampled_from([2, 3]))
def test_random_lines_and_arcs_are_what_they_are_called(seed: int, dimensions: int) -> None:
    rng = np.random.default_rng(seed)
    line = random_gesteme(References(kind="line", dimensions=dimensions), rng)
    assert np.linalg.norm(line[-1]) == pytest.approx(Path(line).length_m)
    assert 0.5 - 1e-9 <= Path(line).length_m <= 1.5 + 1e-9
    arc = random_gesteme(References(kind="circle", dimensions=dimensions), rng)
    a, b = arc[len(arc) // 3], arc[2 * len(arc) // 3]
    sides = [np.linalg.norm(v) for v in (a, b, a - b)]
    radius = np.prod(sides) / (2 * np.linalg.norm(np.cross(a, b)))
    assert 0.15 - 1e-9 <= radius <= 0.5 + 1e-9
    assert np.pi / 2 * radius * 0.99 <= Path(arc).length_m <= 2 * np.pi * radius + 1e-9
    np.testing.assert_array_equal(arc[0], 0)
    if dimensions == 2:
        assert (arc[:, 2] == 0).all()


@given(st.integers(0, 10_000))
def test_consecutive_gestemes_turn_by_theta_min_at_least(seed: int) -> None:
    references = References(kind="mixed", least_turn_rad=0.7)
    gestemes = random_gestemes(references, 5, np.random.default_rng(seed))
    for before, after in itertools.pairwise(gestemes):
        end, start = before[-1] - before[-2], after[1] - after[0]
        cosine = end @ start / np.linalg.norm(end) / np.linalg.norm(start)
        assert math.acos(np.clip(cosine, -1, 1)) >= 0.7 - 1e-6


@pytest.mark.parametrize(
    "change", [{"dimensions": 4}, {"length_m": (2, 1)}, {"radius_m": (0, 1)}, {"sample_m": 0}]
)
def test_references_that_make_no_gesteme_are_refused(change: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=next(iter(change))):
        dataclasses.replace(References(), **change)


def test_joined_curves_meet_and_keep_their_own_points() -> None:
    points, owners = joined([LINE, np.array([[5, 5, 5], [5, 6, 5]])], 0.1)
    assert len(points) == len(owners)
    np.testing.assert_allclose(points[0], 0)
    np.testing.assert_allclose(points[owners.index(1)], (1, 0, 0))
    np.testing.assert_allclose(points[-1], (1, 1, 0))
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() <= 0.1 + 1e-9


def test_a_performance_has_its_speed_its_rate_and_its_states_in_order() -> None:
    task = [
        TaskSegment("go", LINE),
        TaskSegment("turn", np.array([[0, 0, 0], [0, 1.0, 0]])),
    ]
    made = perform(
        "p",
        task,
        Operator(noise=0.1, step_m=0.02, look_ahead_m=0.06),
        np.random.default_rng(0),
        speed_m_s=0.2,
        rate_hz=50,
    )
    np.testing.assert_allclose(np.diff(made.time_s), 0.02)
    speeds = np.linalg.norm(np.diff(made.positions, axis=0), axis=1) * 50
    assert np.median(speeds) == pytest.approx(0.2, rel=0.02)
    assert speeds.max() <= 0.2 + 1e-9
    change = made.states.index("turn")
    assert set(made.states[:change]) == {"go"}
    assert set(made.states[change:]) == {"turn"}
    assert np.linalg.norm(made.positions[change] - (1, 0, 0)) < 0.1


def test_a_random_run_through_a_task_obeys_its_order() -> None:
    task = load_task("human-shapes")
    gestemes = {gesteme.name: LINE for gesteme in task.gestemes}
    states = [s.state for s in random_performance(task, gestemes, np.random.default_rng(0), 7)]
    assert states[0] == "write-g"
    for before, after in itertools.pairwise(states):
        assert after in task.state(before).next
    assert len(states) == 7
    ending = load_task("lines-through-obstacles")
    gestemes = {gesteme.name: LINE for gesteme in ending.gestemes}
    run = random_performance(ending, gestemes, np.random.default_rng(0), 99)
    assert [segment.state for segment in run] == ["lift", "carry", "over", "lower"]
