"""k-means against its definition and scikit-learn's from the same start; MacQueen's two rules."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.cluster import KMeans

from hmcs_baselines.clustering import (
    ClusteringError,
    adaptive_k_means,
    assign,
    coarsened,
    distances,
    k_means,
    k_means_from,
    refined,
)


def blobs(rng, centers, count=40, spread=0.05):
    return np.concatenate([c + rng.normal(0, spread, (count, len(c))) for c in np.array(centers)])


SQUARE = [[0, 0], [0, 1], [1, 0], [1, 1]]


@settings(max_examples=25)
@given(seed=st.integers(0, 10**6), clusters=st.integers(1, 8))
def test_inertia_is_scikit_learns_from_the_same_start(seed, clusters):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(120, 3))
    start = points[rng.choice(len(points), clusters, replace=False)]
    ours = k_means_from(points, start)
    theirs = KMeans(clusters, init=start, n_init=1, tol=0, algorithm="lloyd").fit(points)
    inertia = (distances(points, ours.centers).min(axis=1) ** 2).sum()
    assert inertia == pytest.approx(theirs.inertia_, rel=1e-9)
    assert (ours.members == theirs.labels_).all()


@settings(max_examples=25)
@given(seed=st.integers(0, 10**6))
def test_stationary_centers_are_the_means_of_their_nearest_points(seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(60, 2))
    found = k_means(points, 5, rng)
    assert found.stationary
    assert (found.members == assign(points, found.centers)).all()
    for k, center in enumerate(found.centers):
        np.testing.assert_allclose(points[found.members == k].mean(axis=0), center, atol=1e-12)
    assert found.sizes.sum() == len(points)
    assert found.distance == pytest.approx(distances(points, found.centers).min(axis=1).sum())


def test_a_point_between_two_centers_belongs_to_the_lower_one():
    assert list(assign([[0.5, 0.0], [0.5, 0.5]], SQUARE)) == [0, 0]


def test_every_run_starts_from_points_of_the_data_no_two_alike():
    points = np.repeat([[0.0], [1.0], [5.0]], [50, 1, 1], axis=0)
    for seed in range(20):
        found = k_means(points, 3, np.random.default_rng(seed))
        assert sorted(found.centers.ravel()) == [0.0, 1.0, 5.0]


def test_more_restarts_never_give_a_larger_total_distance():
    points = blobs(np.random.default_rng(0), SQUARE)
    few = [k_means(points, 4, np.random.default_rng(s)).distance for s in range(10)]
    many = [k_means(points, 4, np.random.default_rng(s), restarts=8).distance for s in range(10)]
    assert all(m <= f for m, f in zip(many, few, strict=True))
    assert sum(many) < sum(few)


def test_a_cluster_that_loses_its_members_takes_the_farthest_point():
    points = np.array([[0.0], [1.0], [10.0]])
    found = k_means_from(points, [[0.0], [1.0], [1.0]])
    assert sorted(found.centers.ravel()) == [0.0, 1.0, 10.0]
    assert found.distance == 0


def test_the_same_generator_gives_the_same_clusters():
    points = blobs(np.random.default_rng(1), SQUARE)
    one, two = (k_means(points, 6, np.random.default_rng(3), restarts=3) for _ in range(2))
    assert (one.centers == two.centers).all()


@pytest.mark.parametrize("clusters", [1, 2, 4, 9])
def test_coarsening_and_refinement_find_the_number_whatever_the_start(clusters):
    points = blobs(np.random.default_rng(2), SQUARE)
    found = adaptive_k_means(
        points, clusters, np.random.default_rng(0), coarsening=0.5, refinement=0.6
    )
    assert found.stationary
    assert len(found.centers) == 4
    np.testing.assert_allclose(sorted(found.centers.round().tolist()), SQUARE)


def test_coarsening_merges_the_nearest_two_by_their_weights():
    centers = np.array([[0.0], [1.0], [10.0]])
    np.testing.assert_allclose(coarsened(centers, [3, 1, 1], 2.0), [[0.25], [10.0]])
    np.testing.assert_allclose(coarsened(centers, [3, 1, 1], 1.0), centers)


def test_refinement_makes_the_farthest_point_a_center_until_none_is_far():
    points = np.array([[0.0], [4.0], [5.0], [9.0]])
    np.testing.assert_allclose(refined(points, np.array([[0.0]]), 4.5), [[0.0], [9.0]])


@pytest.mark.parametrize(
    ("points", "says"),
    [
        (np.zeros((0, 2)), "0 points"),
        ([[1.0, 2.0]], "1 points"),
        ([[1.0, 2.0], [np.nan, 0.0]], "point 1"),
        (np.ones((5, 2)), "1 distinct"),
        ([1.0, 2.0, 3.0], "shape"),
    ],
)
def test_points_that_cannot_be_clustered_are_refused(points, says):
    with pytest.raises(ClusteringError, match=says):
        k_means(points, 2, np.random.default_rng(0))


def test_refinement_below_coarsening_is_refused():
    with pytest.raises(ValueError, match="coarsening"):
        adaptive_k_means(np.eye(3), 2, np.random.default_rng(0), coarsening=2.0, refinement=1.0)
