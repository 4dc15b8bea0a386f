"""Every figure in a short form, printed with `-s`; `make bench` measures them in full.

Only what a busy machine cannot spoil is asserted: what is right, and that nothing is lost. Speed is
held against its goals by `make bench` alone.
"""

from __future__ import annotations

import math

import pytest

from bench import (
    accuracy,
    fixture_tick,
    hmm_speed,
    messages,
    recorder,
    replay,
    step_to_belief,
    two_hops,
    whole_stack,
)
from bench.figures import Figure, tell


def measured(figures: list[Figure]) -> dict[str, float]:
    """Print the figures; return their values by name. Each has to be a number."""
    tell("", figures)
    assert all(math.isfinite(figure.value) for figure in figures)
    return {figure.name: figure.value for figure in figures}


def test_the_largest_message_is_measured_there_and_back() -> None:
    values = measured(messages.measure(50))
    assert values["evidence of 25 gestemes"] == 5660


def test_two_hops_are_measured_against_raw_sockets() -> None:
    values = measured(two_hops.measure(2.0))
    assert values["input to robot p50 / the same over raw sockets"] > 0


def test_no_step_stays_without_a_belief() -> None:
    values = measured(step_to_belief.measure(200))
    assert values["steps without a belief"] == 0


def test_the_robot_keeps_its_velocity() -> None:
    values = measured(whole_stack.measure(3.0))
    assert values["robot velocity tracking at 200 mm/s, rms"] < whole_stack.TRACKING_MM_S


@pytest.mark.parametrize("way", [(6, 7), (1, 4)])
def test_human_motion_is_recognized(way: tuple[int, int]) -> None:
    values = measured(accuracy.measure([way]))
    assert values["state accuracy"] >= accuracy.ACCURACY
    assert values["switch delay, p95"] <= accuracy.P95_DELAY_STEPS
    assert values["false switches in 1000 steps"] <= 2 * accuracy.FALSE_SWITCHES


def test_hidden_markov_models_are_learned_as_by_hmmlearn() -> None:
    values = measured(hmm_speed.measure(1))
    assert values["largest relative difference of log-likelihoods"] < hmm_speed.SAME_LIKELIHOOD


def test_a_tick_of_the_fixture_is_measured_also_at_a_mesh() -> None:
    values = measured(fixture_tick.measure(50))
    assert values["tick sliding along that mesh"] > values["tick without regions"] > 0


def test_a_recorder_loses_nothing_at_a_thousand_samples_a_second() -> None:
    values = measured(recorder.measure(3.0))
    assert values["messages lost by the recorder"] == 0


def test_a_replay_is_the_same() -> None:
    values = measured(replay.measure(1))
    assert values["steps replayed with the very same belief"] == 1.0
    assert values["ticks of the fixture replayed with the same factor"] == 1.0
