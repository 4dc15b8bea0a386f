"""Further senses: what motion alone cannot tell apart, force or turning may."""

import numpy as np
import pytest

from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import steps_of_demonstration
from hmcs.recognition.learning import learn
from hmcs.recognition.registry import recognizer_of
from hmcs.recognition.segment_filter.gesteme_learning import LearningSettings
from hmcs.recognition.segment_filter.sensor_densities import (
    SensorDensities,
    SensorWeights,
    log_densities,
    sensor_rows,
    variance_floors,
)
from hmcs.recognition.segments import LearningError, segments_of

FORCE_N = {"go": 3.0, "turn": -3.0, "rise": 0.0}


def felt(demonstration: Demonstration, seed: int, force=FORCE_N) -> Demonstration:
    rng = np.random.default_rng(seed)
    wrenches = rng.normal(0.0, 0.5, (len(demonstration.positions), 6))
    wrenches[:, 0] += [force[state] for state in demonstration.states]
    angle = 0.25 * np.arange(len(wrenches)) / len(wrenches)
    turned = np.stack([0 * angle, 0 * angle, np.sin(angle), np.cos(angle)], axis=1)
    return demonstration._replace(wrenches=wrenches, orientations=turned)


@pytest.fixture(scope="module")
def taught(task, performances):
    demonstrations = [felt(performances(["along", "round", "up"], s), s) for s in range(4)]
    weights = SensorWeights(turn=0.5, force=1.0)
    return learn(task, demonstrations, LearningSettings(senses=weights))


def recognized(model, demonstration):
    recognizer = recognizer_of(model)
    steps = steps_of_demonstration(demonstration, model.task.dead_zone_m)
    return [recognizer.step(step) for step in steps]


def test_force_that_fits_no_state_is_reported_as_unknown(taught, performances):
    motion = performances(["along", "round", "up"], 50)
    right = recognized(taught, felt(motion, 50))
    pushed = recognized(taught, felt(motion, 50, dict.fromkeys(FORCE_N, 20.0)))
    assert right[15].belief.states.max() > 0.9
    assert pushed[15].belief.unknown > 0.9


def test_a_silent_sense_speaks_for_nothing(taught, performances):
    motion = performances(["along", "round", "up"], 51)
    silent = recognized(taught, motion)
    reported = recognized(taught, felt(motion, 51))
    likely = [r.belief.states.argmax() for r in reported]
    assert np.mean([r.belief.states.argmax() for r in silent] == np.array(likely)) > 0.95


def test_each_sense_counts_by_its_weight():
    senses = SensorDensities(
        ("force",), np.zeros((1, 1, 3)), np.ones((1, 1, 3)), np.array([2.0, 0.0, 1.0])
    )
    values = np.array([1.0, 5.0, -2.0])
    single = -0.5 * (values**2 + np.log(2 * np.pi))
    assert log_densities(senses, values)[0, 0] == pytest.approx(2.0 * single[0] + single[2])


def test_a_demonstration_without_a_sense_that_counts_is_reported(task, performances):
    demonstrations = [felt(performances(["along", "round", "up"], 0), 0)]
    demonstrations.append(performances(["along", "round", "up"], 1))
    with pytest.raises(LearningError, match=r"'seed-1' has no force: record it, or set its weight"):
        learn(task, demonstrations, LearningSettings(senses=SensorWeights(force=1.0)))


def test_silence_counts_as_the_sense_does_on_average():
    rng = np.random.default_rng(0)
    means, variances = rng.normal(size=(2, 3, 3)), rng.uniform(0.2, 3.0, (2, 3, 3))
    senses = SensorDensities(("force",), means, variances, np.array([1.0, 0.5, 2.0]))
    drawn = means + np.sqrt(variances) * rng.normal(size=(20_000, 2, 3, 3))
    # What each phase expects of itself, on average over what it lets one feel.
    squares = ((drawn - means) ** 2 / variances).mean(axis=0)
    average = (-0.5 * senses.weights * (squares + np.log(2 * np.pi * variances))).sum(axis=2)
    np.testing.assert_allclose(log_densities(senses, np.full(3, np.nan)), average, atol=0.05)


def test_no_phase_is_surer_of_a_sense_than_a_quarter_of_its_spread():
    rng = np.random.default_rng(0)
    spread = np.array([0.1, 4.0, 0.0])
    rows = [rng.normal(0, spread, (400, 3)) for _ in range(20)]
    # What never varies is as sure as the finest device.
    np.testing.assert_allclose(np.sqrt(variance_floors(rows)), [0.025, 1.0, 1e-3], rtol=0.05)


def test_the_first_step_turns_as_the_second_does(task, performances):
    segment = segments_of(task, [felt(performances(["along", "round", "up"], 0), 0)])[0]
    rows = sensor_rows(segment, ("turn", "force"))
    assert np.isfinite(rows).all()
    np.testing.assert_array_equal(rows[0, :3], rows[1, :3])
    assert np.abs(rows[0, :3]).max() > 1e-3
    # Of what is felt at a step the first is like any other.
    assert (rows[0, 3:] != rows[1, 3:]).all()
    assert sensor_rows(segment, ()).shape == (len(segment.steps), 0)
