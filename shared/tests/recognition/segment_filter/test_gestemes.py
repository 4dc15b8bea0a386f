"""The bank against the forward algorithm of the plain HMM, and its promises to the bus."""

import numpy as np
import pytest

from hmcs.motion.steps import Step, steps_of, steps_of_demonstration
from hmcs.recognition.hmm.emissions import log_gaussians
from hmcs.recognition.hmm.inference import forward
from hmcs.recognition.learning import learn
from hmcs.recognition.segment_filter.alignment import Alignment
from hmcs.recognition.segment_filter.exits import exit_features, exit_probability
from hmcs.recognition.segment_filter.gesteme_learning import LearningSettings
from hmcs.recognition.segment_filter.gestemes import GestemeBank
from hmcs.recognition.segment_filter.recognizer import bank_of, filter_of
from hmcs.recognition.segment_filter.sensor_densities import SensorWeights


@pytest.fixture(scope="module")
def steps(performances, task):
    motion = performances(["along", "round", "up", "along"], 99)
    return steps_of(motion.positions, task.dead_zone_m)


def run(bank, steps):
    return [bank.step(step) for step in steps]


def as_pairs(evidence):
    return {
        (int(g), int(s)): (float(e), float(r))
        for g, s, e, r in zip(
            evidence.pair_gesteme,
            evidence.pair_start,
            evidence.exit,
            evidence.log_ratio,
            strict=True,
        )
    }


def dense_chain(parameters, g):
    """Transition matrix given no exit."""
    n = int((parameters.stay[g] > 0).sum())
    return n, (
        np.diag(parameters.stay[g, :n])
        + np.diag(parameters.advance[g, : n - 1], 1)
        + np.diag(parameters.skip[g, : n - 2], 2)
    )


@pytest.mark.parametrize("gesteme", [0, 1, 2])
@pytest.mark.parametrize("start", [0, 7, 25])
def test_evidence_equals_the_forward_algorithm_of_each_gesteme_hmm(model, steps, gesteme, start):
    lenient = model.knowledge.scoring._replace(prune_nats=np.inf, window_steps=10_000)
    evidence = run(GestemeBank(model.knowledge.parameters, lenient, model.axes, range(3)), steps)

    n, A = dense_chain(model.knowledge.parameters, gesteme)
    parameters = model.knowledge.parameters
    assert A.sum(axis=1) == pytest.approx(1.0)
    moves = np.array([step.displacement for step in steps[start:]])
    places = np.cumsum(moves, axis=0)
    directions = moves / np.linalg.norm(moves, axis=1, keepdims=True)
    emission = log_gaussians(
        parameters.means[gesteme, :n],
        parameters.variances[gesteme, :n],
        np.hstack([places, directions]),
    )
    log_alpha = forward(parameters.initial[gesteme, :n], A, emission)
    totals = np.logaddexp.reduce(log_alpha, axis=1)
    filtered = np.exp(log_alpha - totals[:, None])
    likely = filtered.argmax(axis=1)
    leaving = exit_probability(
        parameters.exit_weights,
        exit_features(
            filtered @ parameters.remaining[gesteme, :n],
            (places - parameters.ends[gesteme, 0]) / parameters.step_m,
            np.repeat(parameters.normals[gesteme, :1], len(places), axis=0),
            directions - parameters.means[gesteme, likely, 3:],
        ),
    )
    for k in range(len(moves)):
        exits, log_ratio = as_pairs(evidence[start + k])[gesteme, start]
        assert exits == pytest.approx(leaving[k - 1] if k else 0.0, abs=1e-9)
        before = totals[k - 1] if k else 0.0
        expected = (totals[k] - before - lenient.background) / lenient.temperature
        if expected < -50:
            # Long since pruned in use; from here on densities are too small for either.
            assert log_ratio < -40
            break
        assert log_ratio == pytest.approx(expected, rel=1e-7, abs=1e-7)


def test_evidence_does_not_depend_on_what_else_is_held(model, steps):
    whole = run(bank_of(model), steps)
    for alone in ([0], [1], [2], [0, 2]):
        for full, part in zip(whole, run(bank_of(model, alone), steps), strict=True):
            expected = {pair: v for pair, v in as_pairs(full).items() if pair[0] in alone}
            assert as_pairs(part) == expected


def test_a_late_joiner_that_replays_the_window_is_equal_to_the_bit(model, steps):
    short = model.knowledge.scoring._replace(window_steps=12)
    bank = GestemeBank(model.knowledge.parameters, short, model.axes, range(3))
    whole = run(bank, steps)
    joined_at = 30
    late = GestemeBank(model.knowledge.parameters, short, model.axes, range(3))
    for step in steps[joined_at - 12 + 1 : joined_at]:
        late.step(step)
    for t in range(joined_at, len(steps)):
        assert as_pairs(late.step(steps[t])) == as_pairs(whole[t])


def test_gestemes_gained_by_replay_continue_as_if_they_had_always_been_held(model, steps):
    whole = run(bank_of(model), steps)
    half = bank_of(model, [0, 1])
    for step in steps[:20]:
        half.step(step)
    fresh = bank_of(model, [2])
    for step in steps[:20]:
        fresh.step(step)
    grown = half.replaced(fresh, keep=[1])
    assert grown.held == (1, 2)
    for t in range(20, len(steps)):
        evidence = grown.step(steps[t])
        expected = {pair: v for pair, v in as_pairs(whole[t]).items() if pair[0] in (1, 2)}
        assert as_pairs(evidence) == expected
        assert (np.diff(evidence.pair_start) >= 0).all()


def test_pairs_older_than_the_window_or_hopeless_are_dropped(model, steps):
    short = model.knowledge.scoring._replace(window_steps=9)
    for evidence in run(
        GestemeBank(model.knowledge.parameters, short, model.axes, range(3)), steps
    ):
        assert (evidence.pair_start > evidence.step - 9).all()
    counts = [len(evidence.pair_start) for evidence in run(bank_of(model), steps)]
    assert max(counts) < 3 * len(steps) / 2


def test_a_classifier_with_no_living_pair_still_speaks(model):
    bank = bank_of(model, [0])
    away = np.array([-0.5, 0.0, 0.0])
    evidence = [bank.step(Step(t, t * away, away)) for t in range(5)]
    assert evidence[-1].gestemes == (0,)
    assert all(np.isfinite(item.log_ratio).all() for item in evidence)
    assert len(evidence[-1].pair_start) == 0


def test_a_leap_that_no_phase_explains_leaves_numbers(model):
    lenient = model.knowledge.scoring._replace(prune_nats=np.inf)
    bank = GestemeBank(model.knowledge.parameters, lenient, model.axes, range(3))
    leap = np.array([9.0, 9.0, 9.0])
    evidence = [bank.step(Step(t, t * leap, leap)) for t in range(3)]
    assert [len(item.pair_start) for item in evidence] == [3, 6, 9]
    assert all(np.isfinite(item.log_ratio).all() for item in evidence)
    assert all(np.isfinite(item.exit).all() for item in evidence)


def test_a_step_along_none_of_the_axes_looked_at_has_no_direction(model):
    evidence = bank_of(model).step(Step(0, np.zeros(3), np.zeros(3)))
    assert len(evidence.pair_start) == 3
    assert np.isfinite(evidence.log_ratio).all()


def test_pruning_changes_no_belief(model, steps):
    unpruned = model.knowledge.scoring._replace(prune_nats=np.inf)
    full = GestemeBank(model.knowledge.parameters, unpruned, model.axes, range(3))
    pruned = bank_of(model)
    one, other = filter_of(model), filter_of(model)
    for step in steps:
        np.testing.assert_allclose(
            one.step(full.step(step)).states, other.step(pruned.step(step)).states, atol=1e-6
        )


def test_a_bank_that_gains_gestemes_still_knows_how_the_hand_was_turned(task, performances):
    def turned(seed):
        demonstration = performances(["along", "round", "up"], seed)
        half = np.linspace(0, 0.8, len(demonstration.positions))
        quaternions = np.stack([0 * half, 0 * half, np.sin(half), np.cos(half)], axis=1)
        return demonstration._replace(orientations=quaternions)

    settings = LearningSettings(senses=SensorWeights(turn=1.0))
    model = learn(task, [turned(seed) for seed in range(3)], settings)
    steps = steps_of_demonstration(turned(50), task.dead_zone_m)
    whole, part, fresh = bank_of(model), bank_of(model, [0, 1]), bank_of(model, [2])
    for step in steps[:10]:
        whole.step(step), part.step(step), fresh.step(step)
    replaced = part.replaced(fresh, [0, 1])
    for step in steps[10:14]:
        expected, found = whole.step(step), replaced.step(step)
        np.testing.assert_array_equal(found.log_ratio, expected.log_ratio)


@pytest.fixture(scope="module")
def bank_of_round(model):
    def make(sigma):
        scoring = model.knowledge.scoring._replace(
            alignment=Alignment(sigma=sigma), prune_nats=np.inf
        )
        return GestemeBank(model.knowledge.parameters, scoring, model.axes, [1])

    return make


def performed_round(step_m, size, turn_rad):
    """The gesteme `round`, larger and turned about z."""
    steps = int(0.08 * size * np.pi / step_m)
    angle = np.linspace(0, np.pi, steps + 1)
    path = 0.08 * size * np.stack([np.sin(angle), 1 - np.cos(angle), 0 * angle], axis=1)
    c, s = np.cos(turn_rad), np.sin(turn_rad)
    path = path @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    return [Step(k, path[k], move) for k, move in enumerate(np.diff(path, axis=0))]


@pytest.mark.parametrize("size", [1.2, 1.3])
def test_what_remains_of_a_gesteme_is_counted_in_the_size_it_is_performed_in(
    bank_of_round, model, size
):
    left, off = 5, {}
    for sigma in (0.0, 0.3):
        bank, steps = (
            bank_of_round(sigma),
            performed_round(model.knowledge.parameters.step_m, size, 0.0),
        )
        for step in steps[: len(steps) - left]:
            bank.step(step)
        off[sigma] = abs(bank.exit_features[0, 3] - (left + 0.5))
    # Once it is known how large it is performed, much less is missing from what is left.
    assert off[0.3] < 0.75 * off[0.0]


@pytest.mark.parametrize("turn_rad", [-0.25, 0.0, 0.25])
def test_a_gesteme_performed_turned_is_no_sign_of_leaving_it(bank_of_round, model, turn_rad):
    bank = bank_of_round(0.3)
    for step in performed_round(model.knowledge.parameters.step_m, 1.0, turn_rad):
        bank.step(step)
    features = bank.exit_features[0]
    # Its end is near, and the step went as it was expected to.
    assert features[7] > 0.5
    assert features[8] < 0.25 * turn_rad**2 + 0.02


@pytest.mark.parametrize("turn_rad", [-0.4, 0.4])
def test_the_end_of_a_gesteme_performed_turned_is_passed_in_the_turned_direction(
    bank_of_round, model, turn_rad
):
    parameters = model.knowledge.parameters
    bank, path = bank_of_round(0.3), performed_round(parameters.step_m, 1.0, turn_rad)
    for step in path:
        bank.step(step)
    growth, turn = 1 + bank.similarity.growth[0], bank.similarity.turn[0]

    def performed(vector):
        return growth * vector + np.cross(turn, vector)

    there = path[-1].position + path[-1].displacement
    from_end = there - performed(parameters.ends[1, 0])
    normal = performed(parameters.normals[1, 0])
    along = from_end @ normal / np.linalg.norm(normal) / parameters.step_m
    assert bank.exit_features[0, 5] == pytest.approx(along)
    assert np.sign(turn[2]) == np.sign(turn_rad)
