"""The elbow criterion: its formulas, and what figures 2.6 to 2.8 show."""

import numpy as np
import pytest

from hmcs_baselines.cluster_count import (
    CusumSettings,
    cusum_elbow,
    error_elbow,
    normalized_error,
    search_clusters,
    slope_elbow,
)
from hmcs_baselines.clustering import ClusteringError


def directions(count, seed, each=40, noise=0.08):
    """Motion directions about some evenly spread on the unit circle, as in figure 2.5."""
    rng = np.random.default_rng(seed)
    angles = np.repeat(2 * np.pi * np.arange(count) / count, each)
    angles = angles + rng.normal(0, noise, len(angles))
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


def found(count, most, seed, restarts=20):
    rng = np.random.default_rng(seed)
    search = search_clusters(directions(count, seed), most, rng, restarts=restarts)
    return cusum_elbow(search.error).clusters


@pytest.mark.parametrize("seed", range(3))
def test_five_directions_are_found_among_fifteen_as_in_figure_2_6(seed):
    assert found(5, 15, seed) == 5


@pytest.mark.parametrize("seed", range(3))
def test_ten_directions_are_found_among_fifteen_as_in_figure_2_7(seed):
    assert found(10, 15, seed, restarts=60) == 10


@pytest.mark.parametrize("seed", range(3))
def test_ten_directions_searched_up_to_eight_give_the_elbow_at_five_of_figure_2_8(seed):
    assert found(10, 8, seed) == 5


def test_distance_and_error_are_those_of_the_text():
    points = directions(3, 0)
    search = search_clusters(points, 5, np.random.default_rng(0))
    v = [
        sum(np.linalg.norm(x - c.centers[m]) for x, m in zip(points, c.members, strict=True))
        for c in search.clusters
    ]
    np.testing.assert_allclose(search.distance, v)
    np.testing.assert_allclose(search.error, (v - np.min(v)) / (np.max(v) - np.min(v)))
    assert (search.error.max(), search.error.min()) == (1.0, 0.0)
    np.testing.assert_allclose(search.slope, np.diff(search.error))
    assert [len(c.centers) for c in search.clusters] == [1, 2, 3, 4, 5]


def test_the_statistic_follows_the_recursion_backward():
    error = np.array([1.0, 0.6, 0.25, 0.245, 0.22, 0.21, 0.2, 0.0])
    elbow = cusum_elbow(error, CusumSettings(drift=0.01, threshold=0.3))
    # By hand: y(8) … y(3) are .2, .01, .01, .025, .005, .35.
    np.testing.assert_allclose(
        elbow.statistic[::-1], [0, 0, 0, 0, 0.005, 0, 0.335, np.nan], atol=1e-12
    )
    np.testing.assert_allclose(
        elbow.expected[::-1], [np.nan, 0.2, 0.2, 0.01, 0.01, 0.0175, 0.005, np.nan]
    )
    assert elbow.resets == (8, 7, 6, 5, 3)
    assert (elbow.clusters, elbow.alarm) == (3, 2)


def test_a_curve_that_falls_evenly_has_no_alarm():
    elbow = cusum_elbow(np.linspace(1, 0, 8))
    assert elbow.alarm is None
    assert elbow.clusters == 1


def test_thresholds_take_the_first_number_below():
    error = np.array([1.0, 0.5, 0.1, 0.08, 0.0])
    assert error_elbow(error, 0.3) == 3
    assert slope_elbow(error, 0.05) == 3
    assert slope_elbow(error, 0.0) == 5
    assert error_elbow(error, -1.0) == 5


def test_equal_distances_have_no_error():
    assert (normalized_error([2.0, 2.0]) == 0).all()


def test_one_number_of_clusters_has_no_elbow():
    with pytest.raises(ClusteringError, match="two numbers"):
        search_clusters(directions(3, 0), 1, np.random.default_rng(0))
    with pytest.raises(ClusteringError, match="3 distinct"):
        search_clusters(np.eye(3), 4, np.random.default_rng(0))
