"""Support vector machines: numpy's evaluation against scikit-learn's, and chapter 3's rules."""

import subprocess
import sys

import numpy as np
import pytest
from sklearn.svm import SVC

from hmcs_baselines.svm import (
    LearningMissingError,
    SvmError,
    SvmSettings,
    decisions,
    fit_machines,
    log_observations,
    log_product_rule,
    state_probabilities,
)


def directions(seed, counts=(30, 50, 20)):
    """Unit vectors about an axis each."""
    rng = np.random.default_rng(seed)
    labels = np.repeat(np.arange(len(counts)), counts)
    raw = np.eye(3)[labels] + rng.normal(0, 0.35, (len(labels), 3))
    return raw / np.linalg.norm(raw, axis=1, keepdims=True), labels


@pytest.mark.parametrize(
    "settings", [SvmSettings(), SvmSettings(rbf_width=0.4, slack_penalty=10.0)]
)
def test_decisions_are_scikit_learns(settings):
    samples, labels = directions(0)
    fresh, _ = directions(1)
    ours = decisions(fit_machines(samples, labels, settings), fresh)
    for k in range(3):
        theirs = SVC(C=settings.slack_penalty, gamma=1 / (2 * settings.rbf_width**2))
        theirs.fit(samples, np.where(labels == k, 1, -1))
        np.testing.assert_allclose(ours[:, k], theirs.decision_function(fresh), atol=1e-9)


def test_probabilities_are_the_product_rule_normalized():
    decision = np.random.default_rng(2).normal(0, 2, (20, 4))
    g = 1 / (1 + np.exp(-0.5 * decision))
    by_hand = np.array(
        [[g[n, i] * np.prod(np.delete(1 - g[n], i)) for i in range(4)] for n in range(20)]
    )
    by_hand /= by_hand.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(np.exp(log_product_rule(decision, 0.5)), by_hand, rtol=1e-12)


def test_very_sure_machines_do_not_underflow():
    log_probability = log_product_rule([[4000.0, -4000.0]], 0.5)
    np.testing.assert_allclose(log_probability, [[0.0, -4000.0]])


def test_bayes_inversion_divides_by_how_often_a_state_occurs():
    samples, labels = directions(3)
    machines = fit_machines(samples, labels)
    np.testing.assert_allclose(machines.priors, [0.3, 0.5, 0.2])
    ratio = np.exp(log_observations(machines, samples)) * machines.priors
    np.testing.assert_allclose(ratio, state_probabilities(machines, samples), rtol=1e-12)


def test_separate_directions_are_distinguished():
    samples, labels = directions(4)
    fresh, truth = directions(5)
    probable = state_probabilities(fit_machines(samples, labels), fresh).argmax(axis=1)
    assert (probable == truth).mean() > 0.9


@pytest.mark.parametrize(
    ("samples", "labels", "says"),
    [
        (np.eye(3), [0, 1], "3 samples with labels"),
        (np.eye(3), [0.0, 1.0, 2.0], "whole number"),
        (np.eye(3), [0, 0, 0], "two states"),
        (np.eye(3), [0, 2, 2], "1, 0, 2 samples"),
        (np.eye(3), [0, -1, 1], "below 0"),
        (np.zeros((0, 3)), np.zeros(0, dtype=int), "no samples"),
        ([[0.0], [np.nan], [1.0]], [0, 1, 1], "sample 1"),
        ([0.0, 1.0], [0, 1], "shape"),
    ],
)
def test_data_that_machines_cannot_be_fitted_to_are_refused(samples, labels, says):
    with pytest.raises(SvmError, match=says):
        fit_machines(samples, labels)


def test_samples_of_other_features_are_refused():
    samples, labels = directions(6)
    with pytest.raises(SvmError, match=r"\(n, 3\)"):
        decisions(fit_machines(samples, labels), samples[:, :2])


def test_settings_that_are_not_positive_are_refused():
    with pytest.raises(ValueError, match="positive"):
        fit_machines(np.eye(2), [0, 1], SvmSettings(rbf_width=0.0))


def test_without_scikit_learn_the_error_names_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "sklearn.svm", None)
    with pytest.raises(LearningMissingError, match=r"hmcs-baselines\[learning\]"):
        fit_machines(np.eye(2), [0, 1])


def test_importing_the_module_imports_no_scikit_learn():
    code = "import sys, hmcs_baselines.svm; sys.exit('sklearn' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
