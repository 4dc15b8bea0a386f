"""Every figure in a short form, told with `-s`; `make bench` measures them in full.

A goal that a machine's other work can spoil has room here: so much that only a regression uses it
up. One that it cannot spoil has none.
"""

from __future__ import annotations

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
    """Print the figures; return their values by name."""
    tell("", figures)
    return {figure.name: figure.value for figure in figures}


def test_the_largest_message_is_small_beside_a_hop() -> None:
    values = measured(messages.measure(500))
    assert values["evidence of 25 gestemes, there and back"] < 2 * messages.AT_MOST_US


def test_two_hops_take_not_much_longer_than_raw_sockets() -> None:
    values = measured(two_hops.measure(4.0))
    assert values["input to robot p50 / the same over raw sockets"] < 2 * two_hops.RATIO


def test_a_belief_takes_not_much_longer_than_over_raw_sockets() -> None:
    values = measured(step_to_belief.measure(400))
    assert values["step to belief p50 / the same over raw sockets"] < step_to_belief.RATIO
    assert values["step to belief, p99"] < 5 * step_to_belief.P99_MS
    assert values["CPU of a classifier a step"] < 2 * step_to_belief.CPU_MS_A_STEP
    assert values["steps without a belief"] == 0


def test_the_whole_stack_needs_less_than_a_core_and_the_robot_keeps_its_velocity() -> None:
    values = measured(whole_stack.measure(5.0))
    assert values["CPU of the whole stack at 100 Hz"] < whole_stack.CORES
    assert values["robot velocity tracking at 200 mm/s, rms"] < whole_stack.TRACKING_MM_S


@pytest.mark.parametrize("way", [(6, 7), (1, 4)])
def test_human_motion_is_recognized(way: tuple[int, int]) -> None:
    values = measured(accuracy.measure([way]))
    assert values["state accuracy"] >= accuracy.ACCURACY
    assert values["switch delay, p95"] <= accuracy.P95_DELAY_STEPS
    assert values["false switches in 1000 steps"] <= 2 * accuracy.FALSE_SWITCHES


def test_hidden_markov_models_are_learned_and_filtered_faster_than_by_hmmlearn() -> None:
    values = measured(hmm_speed.measure(2))
    assert (
        values["hmmlearn's time / ours, its faster implementation"] > hmm_speed.LEARNING_RATIO / 2
    )
    assert values["largest relative difference of log-likelihoods"] < hmm_speed.SAME_LIKELIHOOD
    (filtering,) = (value for name, value in values.items() if "scores the sequence anew" in name)
    assert filtering > hmm_speed.FILTER_RATIO
    large = [value for name, value in values.items() if str(hmm_speed.LARGE_MODELS) in name]
    assert len(large) == 2
    assert max(large) < 3 * hmm_speed.LARGE_UPDATE_US


def test_a_tick_of_the_fixture_is_short_also_at_a_mesh() -> None:
    values = measured(fixture_tick.measure(300))
    assert values["tick without regions"] < 4 * fixture_tick.TICK_US
    assert values["tick sliding along that mesh"] < 4 * fixture_tick.MESH_TICK_US


def test_a_recorder_loses_nothing_at_a_thousand_samples_a_second() -> None:
    values = measured(recorder.measure(3.0))
    assert values["messages lost by the recorder"] == 0
    assert values["CPU of the recorder"] < 2 * recorder.CPU_SHARE


def test_a_replay_is_the_same_and_much_faster_than_it_happened() -> None:
    values = measured(replay.measure(1))
    assert values["steps replayed with the very same belief"] == 1.0
    assert values["ticks of the fixture replayed with the same factor"] == 1.0
    assert values["recognition replayed, times as fast as it happened"] > replay.TIMES_REAL / 2
    assert (
        values["learning five states from three demonstrations, with the report"]
        < 3 * replay.LEARNING_S
    )
