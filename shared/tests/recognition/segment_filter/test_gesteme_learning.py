"""Gestemes learned from straight lines and from noise, against the formulas they follow."""

import numpy as np
import pytest

from hmcs.motion.steps import Step
from hmcs.recognition.segment_filter.gesteme_learning import LearningSettings, fit_gestemes
from hmcs.recognition.segment_filter.gestemes import GestemeBank, Scoring
from hmcs.recognition.segment_filter.sensor_densities import SensorWeights
from hmcs.recognition.segment_filter.variants import VariantSettings
from hmcs.recognition.segments import Segment

AXES = (0, 1, 2)
STEP_M = 0.01
PLAIN = LearningSettings(refine_iterations=0, variants=VariantSettings(apart=1e9))


def performed(moves, gesteme=0, index=0, wrench=None):
    """A segment of these displacements, m, shape (T, 3)."""
    positions = np.vstack([np.zeros(3), np.cumsum(moves, axis=0)])
    steps = tuple(Step(k, positions[k], move, wrench=wrench) for k, move in enumerate(moves))
    return Segment("made", gesteme, gesteme, positions, steps, demonstration_index=index)


def straight(steps, angle=0.0, **of_segment):
    move = STEP_M * np.array([np.cos(angle), np.sin(angle), 0.0])
    return performed(np.tile(move, (steps, 1)), **of_segment)


@pytest.mark.parametrize(("steps", "phases"), [(27, 22), (28, 22), (30, 24), (3, 3)])
def test_a_line_is_passed_in_phases_of_equal_length_to_its_end(steps, phases):
    p = fit_gestemes([[straight(steps)]], AXES, PLAIN)
    assert p.means.shape == (1, phases, 6)
    # The middle of each phase, in steps; a step is seen at its end, half a step on.
    middle = (np.arange(phases) + 0.5) * steps / phases
    seen = np.clip(middle + 0.5, 1.0, steps) * STEP_M
    np.testing.assert_allclose(p.means[0, :, 0], seen)
    np.testing.assert_allclose(p.means[0, :, 3:], [[1.0, 0.0, 0.0]] * phases, atol=1e-12)
    np.testing.assert_allclose(p.remaining[0], steps - middle)
    np.testing.assert_allclose(p.ends[0, 0], [steps * STEP_M, 0, 0], atol=1e-12)
    assert p.step_m == pytest.approx(STEP_M)


def test_the_end_is_passed_in_a_direction_of_unit_length():
    lines = [straight(20, angle, index=k) for k, angle in enumerate((-0.9, 0.9, 0.0))]
    np.testing.assert_allclose(fit_gestemes([lines], AXES, PLAIN).normals[0, 0], [1.0, 0, 0])


def test_one_demonstration_has_the_spread_expected_of_any():
    settings = PLAIN._replace(prior_position_share=0.08, prior_direction=0.4)
    variances = fit_gestemes([[straight(30)]], AXES, settings).variances[0]
    position = (0.08 * 30 * STEP_M) ** 2 + STEP_M**2
    direction = 0.4**2 + settings.direction_floor**2
    np.testing.assert_allclose(variances, [[position] * 3 + [direction] * 3] * len(variances))


def test_spreads_are_those_of_five_phases_together_and_drawn_to_the_mean_of_all():
    rng = np.random.default_rng(8)
    moves = STEP_M * (np.array([1.0, 0, 0]) + 0.4 * rng.normal(size=(3, 12, 3)))
    shown = [performed(move, index=k) for k, move in enumerate(moves)]
    p = fit_gestemes([shown], AXES, PLAIN._replace(phases_per_step=1.0))
    lengths = np.linalg.norm(moves, axis=2, keepdims=True)
    observed = np.concatenate([np.cumsum(moves, axis=1), moves / lengths], axis=2)
    own = observed.var(axis=0, ddof=1)
    around = [own[np.clip(np.arange(n - 2, n + 3), 0, 11)].mean(axis=0) for n in range(12)]
    prior = np.mean(around, axis=0)
    floor = np.repeat([lengths.mean(), PLAIN.direction_floor], 3)
    shrunk = (2.0 * np.array(around) + PLAIN.prior_demonstrations * prior) / (
        2.0 + PLAIN.prior_demonstrations
    )
    np.testing.assert_allclose(p.means[0], observed.mean(axis=0))
    np.testing.assert_allclose(p.variances[0], shrunk + floor**2)


@pytest.mark.parametrize("phases_per_step", [0.2, 0.8, 1.0, 1.7, 3.0, 6.0])
@pytest.mark.parametrize("steps", [2, 3, 9])
def test_a_chain_is_made_of_probabilities_however_many_phases_it_has(steps, phases_per_step):
    settings = PLAIN._replace(phases_per_step=phases_per_step)
    p = fit_gestemes([[straight(steps)]], AXES, settings)
    chain = np.stack([p.stay, p.advance, p.skip])
    assert (chain >= 0).all()
    np.testing.assert_allclose(chain.sum(axis=0), 1.0)
    # It begins at the beginning.
    np.testing.assert_allclose(p.initial[0, :2], [0.8, 0.2])
    assert not p.initial[0, 2:].any()


def test_what_is_felt_alike_every_time_is_expected_within_a_quarter_of_all_that_is_felt():
    def felt(gesteme, force_n):
        wrench = np.array([force_n, 0.0, 0.0, 0, 0, 0])
        return [straight(20, gesteme=gesteme, index=k, wrench=wrench) for k in range(3)]

    settings = PLAIN._replace(senses=SensorWeights(force=1.0))
    senses = fit_gestemes([felt(0, -2.0), felt(1, 2.0)], AXES, settings).senses
    np.testing.assert_allclose(senses.means[:, 0, 0], [-2.0, 2.0])
    np.testing.assert_allclose(np.sqrt(senses.variances[:, :, 0]), 0.25 * 2.0)


def test_a_way_of_performing_a_gesteme_is_left_at_its_own_end():
    angles = [0.0, 0.01, 0.02, np.pi / 2, np.pi / 2 + 0.01, np.pi / 2 + 0.02]
    shown = [straight(30, angle, index=k) for k, angle in enumerate(angles)]
    settings = PLAIN._replace(variants=VariantSettings(apart=0.5))
    p = fit_gestemes([shown], AXES, settings)
    assert p.ends.shape[1] == 2
    for angle in (0.01, np.pi / 2 + 0.01):
        bank = GestemeBank(p, Scoring(0.0, 1.0, 100, np.inf), AXES, [0])
        for step in straight(30, angle).steps:
            bank.step(step)
        _, near, *_, gate, _, _ = bank.exit_features[0]
        assert near < 0.5
        assert gate > 0.9


def test_phases_that_only_pad_a_shorter_gesteme_explain_nothing():
    p = fit_gestemes([[straight(10)], [straight(40, gesteme=1)]], AXES, PLAIN)
    possible = p.stay[0] + p.advance[0] + p.skip[0] > 0
    assert possible.sum() < len(possible)
    # So far aside that any density is tiny, and about as tiny in all its phases.
    aside = np.array([0.0, 2.0, 0.0])
    bank = GestemeBank(p, Scoring(0.0, 1.0, 100, np.inf), AXES, [0])
    found = bank.step(Step(0, np.zeros(3), aside)).log_ratio[0]
    seen = np.concatenate([aside, [0.0, 1.0, 0.0]])
    each = -0.5 * (
        (seen - p.means[0]) ** 2 / p.variances[0] + np.log(2.0 * np.pi * p.variances[0])
    ).sum(axis=1)
    with np.errstate(divide="ignore"):
        expected = np.logaddexp.reduce((np.log(p.initial[0]) + each)[possible])
    assert expected < -1500
    assert found == pytest.approx(expected, rel=1e-9)
