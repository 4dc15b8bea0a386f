"""Figures of clustering directions of motion and of the elbow: 2.5 to 2.8."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from matplotlib.axes import Axes
from pydantic import Field

from hmcs.arrays import Array
from hmcs_baselines.cluster_count import (
    ClusterSearch,
    CusumSettings,
    Elbow,
    cusum_elbow,
    search_clusters,
)
from hmcs_baselines.clustering import k_means
from hmcs_laboratory.data.hands import Count, NotNegative, Positive
from hmcs_laboratory.figures.drawing import (
    FAINT,
    INK,
    WRONG_COLOR,
    Drawn,
    Number,
    color_of,
    listed,
    mark_of,
    new_picture,
)
from hmcs_laboratory.study import StudySettings


class DirectionsSettings(StudySettings):
    """Of figures of direction vectors in the plane."""

    nominal: Annotated[int, Field(ge=2)] = 5
    """Nominal directions, evenly around the circle."""
    vectors: Count = 30
    """Direction vectors for each nominal direction."""
    noise: NotNegative = 0.1
    """κ: standard deviation of the error of each element of a vector, before it is made a unit
    vector again (3.3)."""
    restarts: Count = 30
    """Starts of k-means; the one with the least total distance is taken."""


class CentersSettings(DirectionsSettings):
    """Of figure 2.5."""

    clusters: tuple[Count, ...] = (2, 3, 4, 5)
    """k of the four panels."""


class ElbowSettings(DirectionsSettings):
    """Of figures 2.6 to 2.8."""

    most: Annotated[int, Field(ge=3)] = 15
    """K: so many clusters are searched at most."""
    drift: Positive = CusumSettings().drift
    """ν of (2.21)."""
    threshold: Positive = CusumSettings().threshold
    """h of (2.22)."""
    repeats: Count = 20
    """Other draws of the data in which the elbow is looked for too."""
    few_restarts: Count = 5
    """Starts of k-means with which it is looked for in them once more."""

    @property
    def cusum(self) -> CusumSettings:
        """The settings of the test."""
        return CusumSettings(self.drift, self.threshold)


def cluster_centers(settings: CentersSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 2.5: the centers that k-means finds among direction vectors."""
    drawing, starting = rng.spawn(2)
    vectors = _vectors(settings, drawing)
    picture = new_picture(9.2, 9.0)
    distances = []
    grid = picture.subplots(2, 2, sharex=True, sharey=True, squeeze=False)
    for ax, k in zip(grid.ravel(), settings.clusters, strict=True):
        found = k_means(vectors, k, starting, restarts=settings.restarts)
        distances.append(found.distance / len(vectors))
        _circle(ax)
        for cluster, center in enumerate(found.centers):
            own = vectors[found.members == cluster]
            color, mark = color_of(cluster), mark_of(cluster)
            ax.plot(*own.T, color=color, ls="", marker=mark, ms=5, mfc="none", mew=1.0)
            ax.plot([0, center[0]], [0, center[1]], color=color, linewidth=1.0)
            ax.plot(*center, color=color, ls="", marker=mark, ms=11, mec=INK, mew=1.2)
        ax.set_title(f"{k} clusters: mean distance to the center {distances[-1]:.3f}")
        ax.set_aspect("equal")
        ax.set_xticks([-1.0, -0.5, 0.0, 0.5, 1.0])
        ax.set_yticks([-1.0, -0.5, 0.0, 0.5, 1.0])
    for ax in grid[-1]:
        ax.set_xlabel("x of the direction (unit vector)")
    for ax in grid[:, 0]:
        ax.set_ylabel("y of the direction (unit vector)")
    numbers: dict[str, Number] = {
        "vectors": len(vectors),
        "clusters": list(settings.clusters),
        "mean_distance": distances,
    }
    errors = [f"{d:.3f} with {k}" for d, k in zip(distances, settings.clusters, strict=True)]
    found_text = (
        f"The mean distance of the {len(vectors)} vectors to their center is {listed(errors)} "
        "clusters. Large filled marks are the centers; they lie inside the circle, as means of "
        "unit vectors do."
    )
    differs = (
        "Same picture. How noisy its directions are, and how many, the thesis does not say: see "
        "the settings."
    )
    return Drawn(picture, numbers, found_text, differs)


def elbow_criterion(settings: ElbowSettings, rng: np.random.Generator) -> Drawn:
    """Draw figures 2.6 to 2.8: e(k), Δe(k) and g(k), with alarm line and elbow."""
    drawing, starting, repeating = rng.spawn(3)
    search = _search(settings, drawing, starting)
    elbow = cusum_elbow(search.error, settings.cusum)
    few = settings.model_copy(update={"restarts": settings.few_restarts})
    seeds = repeating.integers(2**63, size=settings.repeats)
    # The same draws with many and with few starts.
    others, hasty = ([_repeated(each, seed) for seed in seeds] for each in (settings, few))
    right, hasty_right = (
        sum(other == settings.nominal for other in found) for found in (others, hasty)
    )
    picture = new_picture(7.6, 8.0)
    _panels(picture.subplots(3, 1, sharex=True), search, elbow, settings)
    numbers: dict[str, Number] = {
        "nominal": settings.nominal,
        "searched": settings.most,
        "elbow": elbow.clusters,
        "alarm_at": elbow.alarm,
        "error": search.error.tolist(),
        "repeats": len(others),
        "repeats_right": right,
        "repeats_found": others,
        "repeats_right_from_few_starts": hasty_right,
    }
    alarm = "no alarm" if elbow.alarm is None else f"the alarm at k = {elbow.alarm}"
    found = (
        f"The elbow is put at k = {elbow.clusters} ({alarm}); there are {settings.nominal} nominal "
        f"directions. In {right} of {len(others)} other draws of such data the number found is "
        f"right, with {settings.few_restarts} starts of k-means instead of {settings.restarts} in "
        f"{hasty_right}."
    )
    return Drawn(picture, numbers, found, _differs(settings, elbow))


def _differs(settings: ElbowSettings, elbow: Elbow) -> str:
    if settings.most < settings.nominal:
        return (
            "Same failure: a number beyond the range searched cannot be found, and the strongest "
            "elbow within it is taken. Which one that is depends on the draw."
        )
    agree = "Same number." if elbow.clusters == settings.nominal else "The number found differs."
    return (
        f"{agree} ν, h, the data's noise and how often k-means is started are not in the "
        "thesis. From few starts it may stay in poor solutions at large k, and e(k) bends where "
        "it should not. e(k) is divided by max − min of v so that it lies in [0, 1], as the text "
        "says and its formula does not."
    )


def _search(
    settings: ElbowSettings, drawing: np.random.Generator, starting: np.random.Generator
) -> ClusterSearch:
    vectors = _vectors(settings, drawing)
    return search_clusters(vectors, settings.most, starting, restarts=settings.restarts)


def _repeated(settings: ElbowSettings, seed: int) -> int:
    rng = np.random.default_rng(seed)
    return cusum_elbow(_search(settings, *rng.spawn(2)).error, settings.cusum).clusters


def _vectors(settings: DirectionsSettings, rng: np.random.Generator) -> Array:
    """Noisy unit vectors about the nominal directions, shape (n, 2)."""
    angle_rad = 2 * np.pi * np.arange(settings.nominal) / settings.nominal + np.pi / 2
    nominal = np.stack([np.cos(angle_rad), np.sin(angle_rad)], axis=1)
    vectors = np.repeat(nominal, settings.vectors, axis=0)
    vectors += settings.noise * rng.standard_normal(vectors.shape)
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def _panels(
    axes: Sequence[Axes], search: ClusterSearch, elbow: Elbow, settings: ElbowSettings
) -> None:
    above, slope, below = axes
    k = np.arange(1, settings.most + 1)
    for ax, values in ((above, search.error), (slope, [np.nan, *search.slope])):
        ax.plot(k, values, color=color_of(0), marker="o", ms=5, linewidth=1.6)
    below.plot(k, elbow.statistic, color=color_of(0), marker="o", ms=5, linewidth=1.6)
    above.set_ylabel("error e(k)")
    slope.axhline(0, color=FAINT, linewidth=0.8)
    slope.set_ylabel("slope Δe(k)")
    below.axhline(settings.threshold, color=INK, linewidth=1.0, linestyle=(0, (4, 3)))
    below.annotate(
        f"alarm above h = {settings.threshold:g}",
        (settings.most, settings.threshold),
        xytext=(0, 4),
        textcoords="offset points",
        ha="right",
    )
    below.set_ylabel("CUSUM g(k), run from right to left")
    below.set_xlabel("number of clusters k")
    below.set_xticks(k)
    right = elbow.clusters == settings.nominal
    for ax in axes:
        color = color_of(2) if right else WRONG_COLOR
        ax.axvline(elbow.clusters, color=color, linewidth=1.6, linestyle=(0, (2, 2)))
    above.annotate(
        f"elbow found: {elbow.clusters}",
        (elbow.clusters, 0.9),
        xytext=(6, 0),
        textcoords="offset points",
        color=color_of(2) if right else WRONG_COLOR,
        fontweight="bold",
    )
    wrong = "" if right else ", wrong"
    above.set_title(
        f"{settings.nominal} directions, 1 to {settings.most} clusters searched: "
        f"{elbow.clusters} found{wrong}"
    )


def _circle(ax: Axes) -> None:
    angle_rad = np.linspace(0, 2 * np.pi, 200)
    ax.plot(np.cos(angle_rad), np.sin(angle_rad), color=FAINT, linewidth=0.8, zorder=0)
