"""Figures of what the thesis leaves open: B.1, reliability, and B.2, unknown intent."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture
from numpy.typing import NDArray
from pydantic import Field

from hmcs.arrays import Array
from hmcs.motion.steps import steps_of
from hmcs.recognition.learning import learn
from hmcs.recognition.registry import recognizer_of
from hmcs.recognition.segment_filter.recognizer import segment_filter_model
from hmcs_laboratory.calibration import BINS, Reliability, reliability
from hmcs_laboratory.data.drawn_tasks import fixed_order
from hmcs_laboratory.data.hands import Count, NotNegative, Positive
from hmcs_laboratory.data.synthetic_tasks import TaskSettings, five_states
from hmcs_laboratory.data.unknown_motions import after, other_drawings
from hmcs_laboratory.figures.drawing import (
    FAINT,
    INK,
    UNKNOWN_COLOR,
    WRONG_COLOR,
    Drawn,
    Number,
    change_handle,
    color_of,
    counted,
    draw_changes,
    draw_path,
    label_space,
    mark_of,
    new_picture,
)
from hmcs_laboratory.study import StudySettings, stream_of

_NAMES = {
    "hmcs-segment-filter": "segment filter",
    "hmcs-lhmm-network-winner": "layered HMM, network",
    "concatenated-hmm": "one HMM of all states",
}


class ReliabilitySettings(TaskSettings):
    """Of figure B.1: the task of fig. 4.11, no marks given."""

    performances: Count = 10
    """Of each task, to recognize."""
    tasks: Count = 10
    """Random ones; their steps are counted together."""
    noise: Annotated[tuple[NotNegative, ...], Field(min_length=1)] = (0.15, 0.3)
    """κ of (3.3)."""


class UnknownFigureSettings(StudySettings):
    """Of figure B.2."""

    training: Annotated[int, Field(ge=1, le=5)] = 5
    """Drawings of each shape to learn from; the task is performed with another."""
    drawings_dead_zone_m: Positive = 0.0023
    """On the tablet."""
    unknown_shapes: Count = 2
    """Drawn after the task's first half, one after another; they are none of its own."""


class _Watched(NamedTuple):
    """What the segment filter said of a hand that leaves its task."""

    states: Array
    """Shape (T, S)."""
    unknown: Array
    """Shape (T,)."""
    fits: Array
    """Mean log-likelihood of the last steps, nats, shape (T,)."""
    alarms: NDArray[np.bool_]


def reliability_diagram(settings: ReliabilitySettings, rng: np.random.Generator) -> Drawn:
    """Draw figure B.1: what was said to be probable against what came true."""
    judged = _judged(settings, rng)
    picture = new_picture(5.4)
    rows = picture.subplots(2, len(_NAMES), sharex=True, sharey="row", height_ratios=(3, 1))
    for column, method in enumerate(_NAMES):
        above, below = rows[:, column]
        for k, noise in enumerate(settings.noise):
            _draw_reliability(above, below, judged[method, noise], k, f"κ = {noise:g}")
        above.plot([0, 1], [0, 1], color=FAINT, linewidth=1.0, ls=":")
        above.set_title(_NAMES[method])
        above.set_aspect("equal")
        below.set_yscale("log")
        below.set_xlabel("probability of the most probable state")
    rows[0][0].set_ylabel("share of steps at which it was right")
    rows[1][0].set_ylabel("share of steps")
    handles, labels = rows[0][0].get_legend_handles_labels()
    handles.append(rows[0][0].lines[-1])
    labels.append("as often as said")
    picture.legend(handles, labels, loc="outside lower center", ncols=len(handles))
    numbers: dict[str, Number] = {"noise": list(settings.noise)}
    lines = []
    for method, name in _NAMES.items():
        errors = [judged[method, noise].error for noise in settings.noise]
        numbers[f"{method}_calibration_error"] = errors
        lines.append(f"{name} {', '.join(f'{error:.3f}' for error in errors)}")
    values = " and ".join(f"{noise:g}" for noise in settings.noise)
    found = (
        f"Expected calibration error, {BINS} bins, at κ = {values}: {'; '.join(lines)}. Steps of "
        f"{settings.performances} performances of each of {counted(settings.tasks, 'task')}; a "
        "point is drawn where a bin holds 20 steps at least."
    )
    return Drawn(picture, numbers, found, "The thesis normalizes likelihoods and does not ask.")


def unknown_intent(settings: UnknownFigureSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure B.2: a hand leaves its task halfway, and the filter says so."""
    learning, performing, leaving = rng.spawn(3)
    zone_m = settings.drawings_dead_zone_m
    data = fixed_order(settings.training, 2, zone_m, performing)
    model = learn(data.task, data.demonstrations, rng=learning)
    performance = data.performances[0].unmarked()
    half = len(performance.steps) // 2
    known = [gesteme.name for gesteme in data.task.gestemes]
    other = steps_of(other_drawings(known, settings.unknown_shapes, leaving), zone_m)
    steps = (*performance.steps[:half], *after(performance.steps[:half], tuple(other)))
    recognizer = recognizer_of(model)
    recognitions = [recognizer.step(step) for step in steps]
    watched = _Watched(
        np.array([each.belief.states for each in recognitions]),
        np.array([each.belief.unknown for each in recognitions]),
        np.array([each.mean_log_likelihood for each in recognitions]),
        np.array([each.unknown_alarm for each in recognitions]),
    )
    alarm = segment_filter_model(model).alarm
    picture = new_picture(6.4)
    # Typed as one subfigure, whatever is asked for.
    halves: Any = picture.subfigures(1, 2, width_ratios=(2, 3))
    left, right = halves
    path = left.subplots()
    places = 1e3 * np.array([step.position[:2] for step in steps])
    draw_path(path, places[: half + 1], color=color_of(0), linewidth=1.6, label="part of the task")
    draw_path(path, places[half:], color=UNKNOWN_COLOR, linewidth=1.6, label="none of it")
    alarmed = places[watched.alarms]
    draw_path(path, alarmed, color=WRONG_COLOR, ls="", marker=".", ms=4, label="alarm")
    label_space(path, 2, "mm")
    path.set_title("The hand")
    path.legend(loc="best")
    probable, fitting = right.subplots(2, 1, sharex=True)
    at = np.arange(len(steps))
    for k, name in enumerate(known):
        style = {"color": color_of(k), "marker": mark_of(k), "markevery": 9, "ms": 4}
        probable.plot(at, watched.states[:, k], linewidth=1.3, label=name, **style)
    probable.fill_between(
        at, watched.unknown, step="mid", color=UNKNOWN_COLOR, alpha=0.5, lw=0, label="unknown"
    )
    probable.set_title("Probability of each state and of none")
    probable.set_ylabel("probability")
    fitting.plot(at, watched.fits, color=INK, linewidth=1.3)
    fitting.axhline(alarm.threshold, color=WRONG_COLOR, ls="--", lw=1.2, label="alarm below this")
    fitting.set_title(f"How well the last {alarm.window_steps} steps fit the task")
    fitting.set_ylabel("log-likelihood, nats a step")
    fitting.set_xlabel("step")
    fitting.legend(loc="best")
    for ax in (probable, fitting):
        draw_changes(ax, [half])
    handles, labels = probable.get_legend_handles_labels()
    right.legend(
        [*handles, change_handle()],
        [*labels, "the hand leaves the task"],
        loc="outside lower center",
        ncols=3,
    )
    return _told(picture, watched, half, alarm.window_steps)


def _told(picture: Picture, watched: _Watched, half: int, window_steps: int) -> Drawn:
    to_unknown, to_alarm = _first(watched.unknown[half:] > 0.5), _first(watched.alarms[half:])
    numbers: dict[str, Number] = {
        "leaves_at_step": half,
        "steps": len(watched.unknown),
        "steps_to_unknown": to_unknown,
        "steps_to_alarm": to_alarm,
        "unknown_in_task": float(watched.unknown[:half].mean()),
        "unknown_after": float(watched.unknown[half:].mean()),
        "false_alarms": int(watched.alarms[:half].sum()),
    }
    found = (
        f"The hand leaves the task at step {half}. Unknown is more probable than all states "
        f"together {_after(to_unknown)}, the alarm, a mean over {window_steps} "
        f"steps, comes {_after(to_alarm)}; {numbers['false_alarms']} alarms "
        f"before. P(unknown) is {numbers['unknown_in_task']:.3f} on average before, "
        f"{numbers['unknown_after']:.3f} after."
    )
    differs = (
        "The thesis sees the total likelihood drop and stops there. Here a background model "
        "competes with the gestemes as a state of the filter, and the drop has a threshold "
        "learned from demonstrations left out."
    )
    return Drawn(picture, numbers, found, differs)


def _first(happens: NDArray[np.bool_]) -> int | None:
    """How many steps there are to the first at which it happens, that one included."""
    return int(np.argmax(happens)) + 1 if happens.any() else None


def _after(steps: int | None) -> str:
    return "never" if steps is None else f"after {counted(steps, 'step')}"


def _judged(
    settings: ReliabilitySettings, rng: np.random.Generator
) -> Mapping[tuple[str, float], Reliability]:
    # Peers take seconds to import, which figures without them need not wait for.
    from hmcs_laboratory.methods.online import followed, learned
    from hmcs_laboratory.methods.registered import online
    from hmcs_laboratory.studies.calibration import predictions

    judged: dict[tuple[str, float], Reliability] = {}
    for noise, streams in zip(settings.noise, rng.spawn(len(settings.noise)), strict=True):
        tasks = [
            (five_states(settings, noise, stream), int(stream.integers(2**32)))
            for stream in streams.spawn(settings.tasks)
        ]
        for method in online(tuple(_NAMES)):
            able = [(learned(method, data, stream_of(method.name, k)), data) for data, k in tasks]
            said = [predictions(followed(one, data.performances), data) for one, data in able]
            probabilities, true = (np.concatenate(part) for part in zip(*said, strict=True))
            judged[method.name, noise] = reliability(probabilities, true)
    return judged


def _draw_reliability(
    above: Axes, below: Axes, reliability: Reliability, index: int, label: str
) -> None:
    shares = reliability.counts / reliability.counts.sum()
    enough = reliability.counts >= 20
    style: dict[str, Any] = {
        "color": color_of(index),
        "marker": mark_of(index),
        "linewidth": 1.4,
    }
    above.plot(reliability.said[enough], reliability.came_true[enough], label=label, ms=5, **style)
    filled = reliability.counts > 0
    below.plot(reliability.said[filled], shares[filled], ms=3, **style)
