"""Rows: means and intervals as the textbook has them, one row a method and setting."""

import numpy as np
import pytest
from scipy import stats

from hmcs_laboratory.study import Measured
from hmcs_laboratory.summary import mean_ci95, rows_of


@pytest.mark.parametrize("count", [2, 3, 10, 40])
def test_the_interval_is_that_of_students_t(count):
    values = np.random.default_rng(count).normal(3.0, 2.0, count)
    mean, half = mean_ci95(values)
    lower, upper = stats.t.interval(0.95, count - 1, loc=values.mean(), scale=stats.sem(values))
    np.testing.assert_allclose([mean - half, mean + half], [lower, upper])


def test_one_value_has_no_interval_and_none_has_no_mean():
    assert mean_ci95([0.5]) == (0.5, None)
    assert mean_ci95([]) == (None, None)
    assert mean_ci95([np.nan, np.nan]) == (None, None)


def test_what_could_not_be_measured_is_left_out():
    assert mean_ci95([1.0, np.nan, 3.0]) == mean_ci95([1.0, 3.0])


def test_a_row_stands_for_one_method_at_one_setting_over_all_trials():
    trials = [
        [
            Measured(method, {"noise": noise}, {"accuracy": accuracy + noise})
            for noise in (0.1, 0.2)
            for method in ("b", "a")
        ]
        for accuracy in (0.2, 0.4)
    ]
    rows = rows_of(trials)
    assert [(row["method"], row["noise"]) for row in rows] == [
        ("b", 0.1),
        ("a", 0.1),
        ("b", 0.2),
        ("a", 0.2),
    ]
    assert [row["accuracy"] for row in rows] == pytest.approx([0.4, 0.4, 0.5, 0.5])
    assert all(row["accuracy_ci95"] > 0 for row in rows)


def test_a_name_is_a_setting_or_a_measure():
    with pytest.raises(ValueError, match="'noise' is a setting and a measure"):
        rows_of([[Measured("a", {"noise": 0.1}, {"noise": 1.0})]])
