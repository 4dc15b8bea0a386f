"""The closed loop against the formulas it stands for: densities, the phase, the heading."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.recognition.segment_filter.exits import DEFAULT_WEIGHTS
from hmcs_laboratory.single_gestemes.closed_loop import (
    NODES_LOOKED_AT,
    ClosedLoop,
    Paths,
    Phases,
    State,
    advance,
    direction_densities,
    mean_node,
    next_phases,
    opened,
    phases_at_start,
)

ADVANCE = {-1: 0.15, 0: 0.25, 1: 0.35, 2: 0.20, 3: 0.05}
"""How far the phase moves on in a step, and how probably."""


def line(nodes: int = 30, step: float = 1.0) -> Paths:
    return Paths(
        np.arange(nodes)[None, :, None] * np.array([step, 0.0]), np.array([nodes], dtype=np.intp)
    )


def loop(**changed: object) -> ClosedLoop:
    """A hand that follows a line, surely."""
    paths = line()
    shape = paths.nodes.shape[:2]
    return ClosedLoop(
        paths=paths,
        ahead=np.tile([1.0, 0.0], (*shape, 1)),
        correction=np.zeros((*shape, 2)),
        variance=np.full(shape, 1e-3),
        normal=np.array([[1.0, 0.0]]),
        exit_weights=DEFAULT_WEIGHTS,
        step=1.0,
        persistence=0.5,
        look_ahead_steps=3.0,
        backwards=0.01,
        outlier=1e-3,
        spread=1.0,
        position_power=0.1,
    )._replace(**changed)


ONE = np.zeros(1, dtype=np.intp)


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("variance", [1e-3, 0.3, 5.0])
def test_what_is_expected_of_a_direction_integrates_to_one(
    dimensions: int, variance: float
) -> None:
    angle = np.linspace(0, np.pi, 40_001)
    direction = np.zeros((len(angle), dimensions))
    direction[:, 0], direction[:, 1] = np.cos(angle), np.sin(angle)
    expected = np.tile(0.9 * np.eye(dimensions)[0], (len(angle), 1))
    parts = direction_densities(direction, expected, np.full(len(angle), variance), 0.1, 0.02)
    around = 2.0 if dimensions == 2 else 2.0 * np.pi * np.sin(angle)
    shares = [np.trapezoid(around * part * np.ones_like(angle), angle) for part in parts]
    np.testing.assert_allclose(shares, [0.88, 0.1, 0.02], atol=1e-4)


@settings(max_examples=50)
@given(st.integers(0, 10_000), st.integers(4, 30), st.floats(0.5, 50.0))
def test_the_phase_is_what_bayes_makes_of_every_node(seed: int, nodes: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    paths = line(nodes)
    first = int(rng.integers(0, max(nodes - NODES_LOOKED_AT, 0) + 1))
    before = np.zeros(first + NODES_LOOKED_AT)
    before[first:nodes] = rng.dirichlet(np.ones(len(before[first:nodes])))
    there = np.array([rng.uniform(0, nodes), rng.normal()])
    predicted = np.zeros(nodes)
    for node, weight in enumerate(before):
        for shift, share in ADVANCE.items():
            # What would pass the end stays there; before the beginning there is nothing.
            to = min(node + shift, nodes - 1)
            if to >= 0:
                predicted[to] += share * weight
    joint = predicted * np.exp(-((there - paths.nodes[0]) ** 2).sum(axis=1) / (2 * spread**2))
    weights = np.zeros((1, NODES_LOOKED_AT))
    weights[0] = before[first:]
    found, log_total = next_phases(
        paths, ONE, Phases(np.array([first], dtype=np.intp), weights), there[None], spread
    )
    assert log_total[0] == pytest.approx(np.log(joint.sum()))
    expected = joint / joint.sum()
    window = slice(int(found.first[0]), int(found.first[0]) + NODES_LOOKED_AT)
    seen = np.pad(expected, (0, NODES_LOOKED_AT))[window]
    # A few nodes at the edge of what is looked at are let go.
    assert seen.sum() > 0.5
    np.testing.assert_allclose(found.weights[0], seen / seen.sum(), atol=1e-9)


def test_a_place_that_tells_nothing_moves_the_phase_on_by_what_hands_do() -> None:
    middle = Phases(np.array([8], dtype=np.intp), np.eye(NODES_LOOKED_AT)[4][None])
    moved, _ = next_phases(line(), ONE, middle, np.zeros((1, 2)), 1e6)
    expected = 12 + sum(shift * share for shift, share in ADVANCE.items())
    assert mean_node(moved)[0] == pytest.approx(expected)


def test_what_would_pass_the_end_stays_there() -> None:
    nodes = 20
    at_last_but_one = Phases(np.array([10], dtype=np.intp), np.eye(NODES_LOOKED_AT)[8][None])
    moved, _ = next_phases(line(nodes), ONE, at_last_but_one, np.zeros((1, 2)), 1e6)
    last = moved.weights[0, nodes - 1 - int(moved.first[0])]
    assert last == pytest.approx(ADVANCE[1] + ADVANCE[2] + ADVANCE[3])


@pytest.mark.parametrize(
    ("direction", "sign"), [((1.0, 0.0), 1.0), ((-1.0, 0.0), -1.0), ((0.0, 1.0), 0.0)]
)
def test_a_step_backwards_keeps_the_heading_and_one_that_tells_nothing_tells_none(
    direction: tuple[float, float], sign: float
) -> None:
    state = State(phases_at_start(1), np.array([[1.0, 0.0]]))
    advanced = advance(loop(), ONE, state, np.zeros((1, 2)), np.array([direction]))
    np.testing.assert_allclose(advanced.state.heading[0], sign * np.array(direction), atol=2e-3)


def test_the_place_counts_as_evidence_to_its_power_only() -> None:
    place, move = np.zeros((1, 2)), np.array([[0.8, 0.3]])
    reported = {
        power: advance(loop(position_power=power), ONE, opened(1, 2), place, move).log_density[0]
        for power in (0.0, 0.1, 0.5)
    }
    _, log_near = next_phases(line(), ONE, phases_at_start(1), place + move, 1.0)
    for power, log_density in reported.items():
        assert log_density == pytest.approx(reported[0.0] + power * log_near[0])
    assert log_near[0] < -0.05
