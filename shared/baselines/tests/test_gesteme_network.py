from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import Step, steps_of_demonstration
from hmcs.recognition.hmm import inference
from hmcs.recognition.hmm.log_transitions import LogTransitions
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.registry import recognizer_of, segmentation_of
from hmcs.recognition.segmentation import label_of
from hmcs.recognition.task_chain import chain_of
from hmcs.task import Task
from hmcs_baselines.concatenated import (
    Network,
    NetworkScores,
    NetworkSettings,
    joined,
)
from hmcs_baselines.gesteme_hmms import GestemeHmmSettings
from support.lessons import ROUND, lesson_task, performed, steps_performed

USUAL = NetworkSettings()
STRICT = NetworkSettings(off_network=0.0)
ACROSS = {"right": (1, 0, 0), "up": (0, 1, 0), "left": (-1, 0, 0)}


def plain_task(states: dict[str, tuple[str, list[str]]]) -> Task:
    fields = lesson_task().model_dump()
    fields["gestemes"] = [{"name": name} for name in dict.fromkeys(g for g, _ in states.values())]
    fields["states"] = [
        {"name": name, "gestemes": [gesteme], "next": following}
        for name, (gesteme, following) in states.items()
    ]
    return Task.model_validate({**fields, "start": [next(iter(states))]})


def straight(moves: list[tuple[str, str, int]]) -> Demonstration:
    """Straight lines without noise, one step a sample: state, where to, how many steps."""
    way = [np.array(ACROSS[where]) * 0.0101 for _, where, count in moves for _ in range(count)]
    labels = [state for state, _, count in moves for _ in range(count)]
    positions = np.cumsum([np.zeros(3), *way], axis=0)
    return Demonstration(
        "straight", np.arange(len(positions)) / 10.0, positions, (*labels, labels[-1])
    )


@cache
def taught(settings: NetworkSettings = USUAL) -> Model:
    demonstrations = [performed(seed) for seed in range(4)]
    return learn(lesson_task(), demonstrations, settings, recognizer="gesteme-network")


def network_of(model: Model) -> tuple[Network, NetworkScores]:
    network = joined(model.knowledge, chain_of(model.task))
    return network, NetworkScores(model.knowledge, network, model.axes, model.task.dead_zone_m)


def test_offline_segmentation_finds_the_true_one_of_a_noiseless_motion() -> None:
    task = plain_task(
        {"out": ("right", ["side"]), "side": ("up", ["back"]), "back": ("left", ["out"])}
    )
    learned = straight([("out", "right", 8), ("side", "up", 5), ("back", "left", 9)])
    model = learn(task, [learned], STRICT, recognizer="gesteme-network")
    performed_now = [("out", "right", 12), ("side", "up", 3), ("back", "left", 6)] * 2
    steps = steps_of_demonstration(straight(performed_now), 0.01)
    edges = np.cumsum([0, *(count for _, _, count in performed_now)]).tolist()
    found = [(each.state, each.start, each.stop) for each in segmentation_of(model, steps)]
    assert found == list(zip([0, 1, 2, 0, 1, 2], edges[:-1], edges[1:], strict=True))


def test_segments_are_counted_by_the_index_of_the_step() -> None:
    model = taught()
    later = [step._replace(index=step.index + 7) for step in steps_performed(50)]
    whole, shifted = (segmentation_of(model, steps) for steps in (steps_performed(50), later))
    assert shifted == tuple(s._replace(start=s.start + 7, stop=s.stop + 7) for s in whole)


def test_offline_segmentation_agrees_with_the_operators_pedal() -> None:
    steps = steps_performed(60, ROUND * 2)
    marks = [step.index for step in steps if step.mark]
    found = segmentation_of(taught(), steps)
    assert [label_of(lesson_task(), each) for each in found] == list(ROUND * 2)
    assert min(each.probability for each in found) > 0.8
    np.testing.assert_allclose([piece.start for piece in found], marks, atol=2)
    assert [piece.stop for piece in found[:-1]] == [piece.start for piece in found[1:]]
    assert found[-1].stop == len(steps)


def test_a_state_that_follows_itself_makes_a_piece_each_time() -> None:
    task = plain_task({"stroke": ("stroke", ["stroke"])})
    stroke = [("stroke", "right", 6), ("stroke", "left", 6)]
    settings = NetworkSettings(GestemeHmmSettings(states=2), off_network=0.0)
    model = learn(task, [straight(stroke)], settings, recognizer="gesteme-network")
    found = segmentation_of(model, steps_of_demonstration(straight(stroke * 3), 0.01))
    assert [each[:4] for each in found] == [(0, 0, 0, 12), (0, 0, 12, 24), (0, 0, 24, 36)]


def test_the_online_filter_is_the_forward_algorithm_on_the_joined_hmm() -> None:
    model, steps = taught(), steps_performed(50)
    network, scores = network_of(model)
    log_emission = np.stack([scores.log_emission(step) for step in steps])
    log_states, log_scales, _ = inference.log_filtered(
        network.initial, LogTransitions(network.transition), log_emission
    )
    recognizer = recognizer_of(model)
    for step, cells, log_scale in zip(steps, np.exp(log_states), log_scales, strict=True):
        belief = recognizer.step(step).belief
        states = np.bincount(network.task_state, cells, len(ROUND))
        np.testing.assert_allclose(belief.states, states, atol=1e-9)
        np.testing.assert_allclose(belief.log_likelihood, log_scale, rtol=1e-6, atol=1e-9)


def test_what_may_follow_is_as_likely_whatever_the_task_says_and_nothing_else_may() -> None:
    fields = lesson_task().model_dump()
    fields["states"][0]["next"] = {"turn": 0.1, "lift": 0.9}
    task = Task.model_validate(fields)
    network = joined(taught(STRICT).knowledge, chain_of(task))
    last = np.flatnonzero(network.slot == 0)[-1]
    first = [int(np.flatnonzero(network.slot == k)[0]) for k in range(4)]
    ways = network.transition[last, first]
    assert ways[1] == pytest.approx(ways[2])
    assert ways[1] > 0
    assert ways[3] == 0


@pytest.mark.parametrize("settings", [STRICT, NetworkSettings(off_network=0.1)])
def test_the_joined_hmm_is_one(settings: NetworkSettings) -> None:
    network, _ = network_of(taught(settings))
    np.testing.assert_allclose(network.transition.sum(axis=1), 1.0)
    np.testing.assert_allclose(network.initial.sum(), 1.0)
    assert (network.transition >= 0).all()


def test_gestemes_last_as_long_as_demonstrated() -> None:
    model = taught(STRICT)
    network, _ = network_of(model)
    for slot, state in enumerate(ROUND):
        own = network.slot == slot
        inside = network.transition[np.ix_(own, own)]
        # Fundamental matrix of the absorbing chain: expected steps before it leaves.
        steps = np.linalg.inv(np.eye(len(inside)) - inside)[0].sum()
        marks = [
            [step.index for step in steps_performed(seed) if step.mark]
            + [len(steps_performed(seed))]
            for seed in range(4)
        ]
        demonstrated = np.mean([m[slot + 1] - m[slot] for m in marks])
        assert steps == pytest.approx(demonstrated, rel=0.15), state


def pressing(seed: int, states: tuple[str, ...] = ("press", "slide")) -> Demonstration:
    """The same motion with another force."""
    rng = np.random.default_rng(seed)
    count, force = 40, {"press": (0.0, 0.0, 5.0), "slide": (0.0, 0.0, 0.5)}
    labels = [state for state in states for _ in range(count)]
    positions = np.zeros((len(labels), 3))
    positions[:, 0] = 0.0051 * np.arange(len(labels))
    wrenches = np.zeros((len(labels), 6))
    wrenches[:, :3] = [force[label] for label in labels]
    wrenches[:, :3] += rng.normal(0, 0.3, (len(labels), 3))
    time_s = np.arange(len(labels)) / 10.0
    return Demonstration("pressed", time_s, positions, tuple(labels), None, wrenches)


def pressing_model() -> Model:
    task = plain_task({"press": ("press", ["slide"]), "slide": ("slide", ["press"])})
    return learn(task, [pressing(seed) for seed in range(3)], STRICT, recognizer="gesteme-network")


def test_force_tells_apart_what_moves_alike() -> None:
    model = pressing_model()
    motion = pressing(9, ("press", "slide", "press"))
    found = segmentation_of(model, steps_of_demonstration(motion, 0.01))
    assert [piece.state for piece in found] == [0, 1, 0]


def test_a_force_that_is_not_felt_is_left_out() -> None:
    recognizer = recognizer_of(pressing_model())
    steps: list[Step] = steps_of_demonstration(pressing(9), 0.01)
    for step in steps:
        belief = recognizer.step(step._replace(wrench=None)).belief
        assert np.isfinite(belief.log_likelihood)
        np.testing.assert_allclose(belief.states.sum(), 1.0)


def test_a_gesteme_lasts_as_long_as_it_was_demonstrated() -> None:
    counts = {"right": 24, "up": 12, "left": 7}
    task = plain_task(
        {"right": ("right", ["up"]), "up": ("up", ["left"]), "left": ("left", ["right"])}
    )
    moves = [(name, name, count) for name, count in counts.items()]
    model = learn(task, [straight(moves)] * 2, STRICT, recognizer="gesteme-network")
    network, _ = network_of(model)
    for state, count in enumerate(counts.values()):
        own = np.flatnonzero(network.task_state == state)
        within = network.transition[np.ix_(own, own)]
        # How often each of its states is visited, from its first one on, before it is left.
        visits = np.linalg.inv(np.eye(len(own)) - within)[0]
        assert visits.sum() == pytest.approx(count, rel=0.1)
