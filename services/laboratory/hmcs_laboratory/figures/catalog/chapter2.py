"""Figures of chapter 2: clusters of directions, and virtual fixtures."""

from __future__ import annotations

from typing import Any

from hmcs_laboratory.figures.clusters import (
    CentersSettings,
    ElbowSettings,
    cluster_centers,
    elbow_criterion,
)
from hmcs_laboratory.figures.compliance import (
    ComplianceSettings,
    optimal_compliance_found,
    tasks_of_compliance,
)
from hmcs_laboratory.figures.figure import Figure
from hmcs_laboratory.figures.fixture_fields import (
    FieldSettings,
    cones,
    joined_volumes,
    kinds_of_fixture,
    stiffness_of_fixtures,
    tubes,
)
from hmcs_laboratory.figures.force_scaling import ForceSettings, force_scaling

_PEOPLE = (
    "Marayong et al. measured people at a steady-hand robot. Here a simulated operator who sees "
    "the robot with a delay performs the tasks."
)
_FAST_ELBOW = {"repeats": 3}

CHAPTER_2: tuple[Figure[Any], ...] = (
    Figure(
        "2.5",
        "Cluster centers of motion directions",
        "Centers that k-means finds among direction vectors on the unit circle, for 2, 3, 4 and 5 "
        "clusters; the vectors come from five nominal directions.",
        cluster_centers,
        CentersSettings(),
    ),
    Figure(
        "2.6",
        "The elbow criterion: 5 clusters",
        "The normalized error e(k), its slope and the test statistic g(k) of a CUSUM-RLS test "
        "that runs backward, with its alarm line: e(k) bends at 5, and the elbow found is 5.",
        elbow_criterion,
        ElbowSettings(),
        _FAST_ELBOW,
        data_of="2.5",
    ),
    Figure(
        "2.7",
        "The elbow criterion: 10 clusters",
        "The same for ten directions. There are two elbows, a weaker one at 5, where each center "
        "holds two directions, and one at 10; the test finds 10.",
        elbow_criterion,
        ElbowSettings(nominal=10),
        _FAST_ELBOW,
    ),
    Figure(
        "2.8",
        "The elbow criterion fails: 10 clusters, 8 searched",
        "The data of figure 2.7, but only up to 8 clusters are considered: the wrong elbow, at 5, "
        "is selected.",
        elbow_criterion,
        ElbowSettings(nominal=10, most=8),
        _FAST_ELBOW,
        data_of="2.7",
    ),
    Figure(
        "2.9",
        "Kinds of virtual fixtures",
        "(a) Forbidden regions keep the operator out of places; (b) guidance leads along a way.",
        kinds_of_fixture,
        FieldSettings(),
    ),
    Figure(
        "2.10",
        "Stiffness of virtual fixtures",
        "A hard fixture completely constrains the motion, a softer one allows some deviation.",
        stiffness_of_fixtures,
        FieldSettings(),
    ),
    Figure(
        "2.12",
        "Three tasks at a fixture",
        "Curve following, off-path targeting and obstacle avoidance: in the latter two the "
        "operator works against the fixture.",
        tasks_of_compliance,
        FieldSettings(),
        stand_in=_PEOPLE,
    ),
    Figure(
        "2.13",
        "Optimal compliance",
        "Error and time against compliance for following and leaving a path; the best compliance "
        "is where the lines cross.",
        optimal_compliance_found,
        ComplianceSettings(),
        {"repeats": 3, "compliances": 4},
        stand_in=_PEOPLE,
    ),
    Figure(
        "2.14",
        "Cues and force scaling",
        "Force over error for toggle, fade and hold; the mark is where the cue is given.",
        force_scaling,
        ForceSettings(),
        {"repeats": 3},
        stand_in=_PEOPLE,
    ),
    Figure(
        "2.15",
        "A virtual tube",
        "A safe volume around a reference curve: free within, brought back from outside.",
        tubes,
        FieldSettings(),
    ),
    Figure(
        "2.16",
        "A virtual cone",
        "A volume that guides toward a reference point.",
        cones,
        FieldSettings(),
    ),
    Figure(
        "2.17",
        "Tubes and cones joined",
        "Joined volumes provide a safe approach to a target, smooth where they meet.",
        joined_volumes,
        FieldSettings(),
    ),
)
