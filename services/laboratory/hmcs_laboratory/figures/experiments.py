"""Figures 3.8 to 3.10: the three experiments of chapter 3, with its own recognizer and law."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from hmcs.arrays import Array
from hmcs.motion.closed_loop_operators import STEADY, ClosedLoopOperator
from hmcs.motion.demonstrations import Demonstration
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.registry import kind_named, settings_of
from hmcs.task import Workspace
from hmcs_baselines.direction_states import DirectionFilter, unit_rows
from hmcs_baselines.svm import state_probabilities
from hmcs_laboratory.assistance.laws import LAWS
from hmcs_laboratory.assistance.loop import Run, assisted, demonstrated
from hmcs_laboratory.assistance.measures import off_path
from hmcs_laboratory.assistance.scenarios import (
    Scenario,
    Sphere,
    Taught,
    as_taught,
    changed_obstacle,
    taught_lines,
    unexpected_obstacle,
)
from hmcs_laboratory.data.hands import Count, Positive
from hmcs_laboratory.figures.drawing import (
    COLORS,
    FAINT,
    INK,
    WRONG_COLOR,
    Drawn,
    color_of,
    label_space,
    mark_of,
    new_picture,
)
from hmcs_laboratory.study import StudySettings

_PERIOD_S = 0.01
_MOST_S = 120.0
_LAG_S = 0.03
_EVERY = 12
"""So many samples to a mark."""


class ExperimentSettings(StudySettings):
    """Of figures 3.8 to 3.10."""

    demonstrations: Count = 5
    """Performances without a fixture that are learned from."""
    dead_zone_m: Positive = 0.02
    """Of chapter 3's recognizer."""
    robot: str = "physics"
    """`physics` is a PUMA 560 among the obstacles, `lag` a tool that follows with a delay."""


class _Experiments(NamedTuple):
    taught: Taught
    shown: tuple[Demonstration, ...]
    model: Model
    scenarios: tuple[Scenario, Scenario, Scenario]
    """As taught, with a changed workspace, with an unexpected obstacle."""
    runs: tuple[Run, Run, Run]


def workspace(settings: ExperimentSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 3.8: the workspace of pick and place, and the path expected."""
    taught = taught_lines(rng, settings.dead_zone_m)
    picture = new_picture(5.6, 7.5)
    ax: Any = picture.add_subplot(projection="3d")
    _draw_obstacles(ax, taught.task.workspace)
    ax.plot(*taught.path.points.T, color=COLORS[0], linewidth=2.2)
    ax.plot(*taught.path.points[0], marker="o", color=INK, ms=7, linestyle="")
    ax.view_init(elev=24, azim=-150)
    label_space(ax, 3)
    handles = [
        Line2D([], [], color=COLORS[0], linewidth=2.2),
        Line2D([], [], color=INK, marker="o", ms=7, linestyle=""),
        Line2D([], [], color=WRONG_COLOR, linewidth=1.0),
    ]
    names = ["expected path of the tool", "start", "obstacles"]
    picture.legend(handles, names, loc="outside lower center", ncols=3)
    lengths = taught.lengths_m
    return Drawn(
        picture,
        {"lines_m": [float(length) for length in lengths]},
        f"Four lines of {', '.join(f'{length:.2f}' for length in lengths)} m lead a part over a "
        "wall into a bay.",
        "The thesis shows a photograph of its workspace; this is the shipped task "
        "lines-through-obstacles.",
    )


def paths_of_experiments(settings: ExperimentSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 3.9: training, following, a changed workspace, an unexpected obstacle."""
    done = _experiments(settings, rng)
    picture = new_picture(9.0)
    names = done.model.state_names
    titles = (
        "(a) a training example",
        "(b) following with the fixture",
        "(c) a changed workspace",
        "(d) an unexpected obstacle",
    )
    axes: list[Any] = [picture.add_subplot(2, 2, k + 1, projection="3d") for k in range(4)]
    shown = done.shown[0]
    _draw_states(axes[0], shown.positions, [str(state) for state in shown.states], names)
    _draw_obstacles(axes[0], done.taught.task.workspace)
    for ax, run, scenario in zip(axes[1:], done.runs, done.scenarios, strict=True):
        ax.plot(*scenario.meant.points.T, color=FAINT, linewidth=0.8)
        _draw_states(ax, run.robot, list(run.states), names)
        _draw_obstacles(ax, scenario.workspace or done.taught.task.workspace)
        if scenario.obstacle is not None:
            _draw_sphere(ax, scenario.obstacle)
    for ax, title in zip(axes, titles, strict=True):
        ax.set_title(title)
        ax.view_init(elev=24, azim=-150)
        label_space(ax, 3)
        # Across the wall there is little way.
        ax.xaxis.set_major_locator(MaxNLocator(2))
    handles = [
        Line2D([], [], color=color_of(k), marker=mark_of(k), ms=5, linestyle="", label=name)
        for k, name in enumerate(names)
    ]
    handles.append(Line2D([], [], color=WRONG_COLOR, linewidth=1.0, label="obstacle"))
    picture.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    errors = [
        1e3 * float(np.sqrt((off_path(run.robot, s.meant, run.progress_m) ** 2).mean()))
        for run, s in zip(done.runs, done.scenarios, strict=True)
    ]
    obstacle = done.scenarios[2].obstacle
    assert obstacle is not None
    gap = np.linalg.norm(done.runs[2].robot - obstacle.center, axis=1).min() - obstacle.radius_m
    return Drawn(
        picture,
        {
            "rms_error_mm": errors,
            "arrived": [run.arrived for run in done.runs],
            "touched": [", ".join(sorted(run.touched)) for run in done.runs],
            "clearance_mm": 1e3 * float(gap),
        },
        "RMS error to the path meant: "
        + ", ".join(f"{error:.1f} mm" for error in errors)
        + f"; the obstacle is passed at {1e3 * gap:.1f} mm.",
        "The thesis had a PUMA 560 led by a tracker on a glove. Here a simulated operator who sees "
        "the robot with a delay leads a simulated PUMA 560; recognizer, dead zone and law are "
        "those of chapter 3. In (c) the wall is higher or lower than taught.",
    )


def probabilities_of_experiments(settings: ExperimentSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 3.10: probabilities of SVM and HMM and the fixturing factor, step by step."""
    done = _experiments(settings, rng)
    directions = done.model.knowledge.directions
    # Lines of several directions never make a single class, which alone would have no machine.
    machines = directions.estimator.machines
    picture = new_picture(7.0)
    axes = picture.subplots(3, 2, sharex="col", sharey="row")
    changes: dict[str, list[int]] = {"svm": [], "hmm": []}
    for column, (title, run) in enumerate(
        zip(("experiment 1", "experiment 3"), (done.runs[0], done.runs[2]), strict=True)
    ):
        moves = np.array([step.displacement for step in run.steps])
        follow = DirectionFilter(directions)
        hmm = np.array([follow.step(move) for move in moves])
        svm = state_probabilities(machines, unit_rows(moves))
        for ax, rows in zip(axes[:2, column], (svm, hmm), strict=True):
            for state, own in enumerate(rows.T):
                ax.plot(
                    own,
                    color=color_of(state),
                    marker=mark_of(state),
                    ms=3.5,
                    linewidth=1.3,
                    label=f"state {state + 1}",
                )
        axes[2, column].plot(run.factor[run.step_at], color=INK, linewidth=1.5)
        axes[2, column].set_ylim(0.48, 0.85)
        axes[0, column].set_title(title)
        axes[2, column].set_xlabel("step")
        for name, rows in (("svm", svm), ("hmm", hmm)):
            changes[name].append(int((np.diff(rows.argmax(axis=1)) != 0).sum()))
    for ax, name in zip(
        axes[:, 0], ("SVM probability", "HMM probability", "fixturing factor k"), strict=True
    ):
        ax.set_ylabel(name)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    picture.legend(handles, labels, loc="outside lower center", ncols=len(handles))
    found = (
        f"{len(directions.initial)} directions were found, the rarest in "
        f"{100 * machines.priors.min():.1f} % of the demonstrated steps. The most probable state "
        f"changes {changes['svm'][0]} times for the SVM and {changes['hmm'][0]} times for the HMM "
        f"in experiment 1, {changes['svm'][1]} and {changes['hmm'][1]} times in experiment 3, "
        "where the operator leaves the fixture for the obstacle."
    )
    return Drawn(
        picture,
        {
            "svm_changes_of_state": changes["svm"],
            "hmm_changes_of_state": changes["hmm"],
            "directions": len(directions.initial),
            "rarest_direction": float(machines.priors.min()),
        },
        found,
        f"{_verdict(changes)} The HMM needs P(x | state), which is (3.2) divided by P(state): a "
        "state that is rare in the demonstrations gains by it. Which number a state has is chance; "
        "the factor is read at each step.",
    )


def _verdict(changes: Mapping[str, Sequence[int]]) -> str:
    if not all(changes["hmm"]):
        return (
            "In the thesis the SVM fluctuates and the HMM follows the lines. Here the HMM stays in "
            "one state throughout an experiment: it does not recognize this task."
        )
    if all(hmm < svm for svm, hmm in zip(changes["svm"], changes["hmm"], strict=True)):
        return "The SVM fluctuates more than the HMM, as in the thesis."
    return "In the thesis the SVM fluctuates more than the HMM; here it does not in both."


def _experiments(settings: ExperimentSettings, rng: np.random.Generator) -> _Experiments:
    seed = int(rng.integers(2**32))

    def stream(*key: int) -> np.random.Generator:
        return np.random.default_rng([seed, *key])

    taught = taught_lines(stream(0), settings.dead_zone_m)
    (law,) = (law for law in LAWS if law.name == "chapter-3")
    shown = tuple(
        demonstrated(
            ClosedLoopOperator(STEADY, taught.path, stream(1, k), period_s=_PERIOD_S),
            taught,
            f"demonstration-{k}",
            period_s=_PERIOD_S,
            most_s=_MOST_S,
        )
        for k in range(settings.demonstrations)
    )
    kind = kind_named(law.recognizer)
    model = learn(taught.task, shown, settings_of(kind, {}), recognizer=law.recognizer)
    scenarios = (
        as_taught(taught, stream(2)),
        changed_obstacle(taught, stream(3)),
        unexpected_obstacle(taught, stream(4)),
    )
    first, second, third = (
        assisted(
            ClosedLoopOperator(STEADY, scenario.meant, stream(5, k), period_s=_PERIOD_S),
            taught,
            scenario,
            model,
            law.rules(taught.task),
            robot=settings.robot,
            robot_lag_s=_LAG_S,
            period_s=_PERIOD_S,
            most_s=_MOST_S,
        )
        for k, scenario in enumerate(scenarios)
    )
    return _Experiments(taught, shown, model, scenarios, (first, second, third))


def _draw_states(ax: Axes, positions: Array, states: list[str], names: tuple[str, ...]) -> None:
    ax.plot(*positions.T, color=FAINT, linewidth=0.7)
    believed = np.array(states)
    for k, name in enumerate(names):
        own = positions[::_EVERY][believed[::_EVERY] == name]
        if len(own):
            ax.plot(*own.T, color=color_of(k), marker=mark_of(k), ms=4, linestyle="")


def _draw_obstacles(ax: Any, workspace: Workspace) -> None:
    for obstacle in workspace.obstacles:
        if obstacle.size_m is not None and obstacle.name != "table":
            draw_box(ax, np.array(obstacle.position_m), np.array(obstacle.size_m), WRONG_COLOR)


def _draw_sphere(ax: Any, obstacle: Sphere) -> None:
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 18), np.linspace(0, np.pi, 10))
    ball = np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)])
    surface = obstacle.center[:, None, None] + obstacle.radius_m * ball
    ax.plot_wireframe(*surface, color=WRONG_COLOR, linewidth=0.5)


def draw_box(ax: Any, center: Array, size: Array, color: str) -> None:
    """Draw the edges of a box, m, both of shape (3,)."""
    low, high = center - size / 2, center + size / 2
    corners = np.array([[low[k], high[k]] for k in range(3)])
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        for a in (0, 1):
            for b in (0, 1):
                edge = np.zeros((3, 2))
                edge[axis] = corners[axis]
                edge[others[0]], edge[others[1]] = corners[others[0]][a], corners[others[1]][b]
                ax.plot(*edge, color=color, linewidth=1.0)
