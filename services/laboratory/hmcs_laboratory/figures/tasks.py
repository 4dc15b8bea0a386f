"""Figures of tasks followed by the layered HMM: 4.12, 4.13, 4.16 and 4.17."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.registry import recognizer_of
from hmcs.recognition.scoring import Scores, pooled, score
from hmcs_baselines.classifying import GestemeClassifier
from hmcs_baselines.gesteme_hmms import GestemeHmmSettings
from hmcs_baselines.observing import ObservationSettings
from hmcs_baselines.task_level import TaskLevelSettings
from hmcs_baselines.two_levels import LayeredHmmSettings, TwoLevels
from hmcs_laboratory.data.hands import Count, Share
from hmcs_laboratory.data.synthetic_tasks import five_states
from hmcs_laboratory.data.tasks import Performance, TaskSet
from hmcs_laboratory.figures.drawing import (
    INK,
    UNKNOWN_COLOR,
    Drawn,
    Number,
    change_handle,
    color_of,
    counted,
    draw_changes,
    listed,
    mark_of,
    new_picture,
)
from hmcs_laboratory.figures.drawn import DrawnOrderSettings, drawn_orders
from hmcs_laboratory.figures.trajectories import TaskFigureSettings
from hmcs_laboratory.study import StudySettings

Integers = NDArray[np.int64]

_LOWEST_NATS = -60.0
"""State likelihoods so far below the best are not drawn: they would hide the others."""


class LayeredSettings(StudySettings):
    """Of the layered HMM."""

    symbols: Count = 25
    """Cluster centers of the one-dimensional gesteme HMMs."""
    gesteme_states: Count = 5
    """N of each gesteme HMM, left to right."""
    emission_floor: Share = 0.001
    """Least probability of a symbol in a state of a gesteme HMM."""
    task_emission_floor: Share = 0.01
    """Least probability of a gesteme in a task state."""
    any_state: Share = 1e-6
    """In each step the task goes to any state whatever with this probability."""
    eager_any_state: Share = 1e-3
    """The same in a second layered HMM, which is measured but not drawn."""

    def layered(self, any_state: float) -> LayeredHmmSettings:
        """Return the settings of the layered HMM: as in the thesis, restarted where told to."""
        return LayeredHmmSettings(
            observing=ObservationSettings(symbols=self.symbols),
            gestemes=GestemeHmmSettings(
                states=self.gesteme_states, emission_floor=self.emission_floor
            ),
            restart="given",
            task=TaskLevelSettings(emission_floor=self.task_emission_floor, any_state=any_state),
        )


class FollowedSettings(TaskFigureSettings, LayeredSettings):
    """Of figures 4.12 and 4.13."""


class DrawnFollowedSettings(DrawnOrderSettings, LayeredSettings):
    """Of figures 4.16 and 4.17."""


class _Followed(NamedTuple):
    """What the layered HMM made of a performance, restart given."""

    log_alpha: Array
    """log P(all steps so far, state), nats, shape (T, S)."""
    states: Array
    """P(state | all steps so far), shape (T, S)."""
    winners: Integers
    """The most probable gesteme since the restart, shape (T,)."""
    margin_of_gestemes: float
    """Mean difference of the two most probable gestemes."""

    @property
    def falls(self) -> Array:
        """By how much the total likelihood falls with each step, nats, shape (T,)."""
        total = np.logaddexp.reduce(self.log_alpha, axis=1)
        return np.asarray(-np.diff(total, prepend=0.0))


class _Believed(NamedTuple):
    """What the segment filter made of it, no marks given."""

    states: Array
    """Shape (T, S)."""
    unknown: Array
    """Shape (T,)."""


class _Names(NamedTuple):
    states: tuple[str, ...]
    gestemes: tuple[str, ...]
    of_state: Integers
    """Index of the gesteme of each state."""


def five_states_followed(settings: FollowedSettings, rng: np.random.Generator) -> Drawn:
    """Draw figures 4.12 and 4.13: the five-state task followed, restart given."""
    data = five_states(settings, settings.noise, rng)
    return _drawn(data, data, settings, by_gesteme=False)


def trained_order_followed(settings: DrawnFollowedSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 4.16: a task of six segments in the order it was learned in."""
    trained, _ = drawn_orders(settings, rng)
    return _drawn(trained, trained, settings, by_gesteme=False)


def unseen_order_followed(settings: DrawnFollowedSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 4.17: the same gestemes in an order never seen."""
    trained, unseen = drawn_orders(settings, rng)
    return _drawn(trained, unseen, settings, by_gesteme=True)


def _drawn(
    learned: TaskSet, shown: TaskSet, settings: LayeredSettings, *, by_gesteme: bool
) -> Drawn:
    """Learn one task, follow all performances of the other, draw the first and tell of all.

    With `by_gesteme` a belief is right where its gesteme is: of a task in an order never seen, no
    more is true.
    """
    task, names = learned.task, _names(learned)
    layered, eager = (
        learn(task, learned.demonstrations, settings.layered(any_state), recognizer="lhmm")
        for any_state in (settings.any_state, settings.eager_any_state)
    )
    filtering = learn(task, learned.demonstrations)
    followed = [_follow(layered, performance) for performance in shown.performances]
    hurried = [_follow(eager, performance) for performance in shown.performances]
    believed = [_believe(filtering, performance) for performance in shown.performances]

    def judged(what: Sequence[_Followed] | Sequence[_Believed]) -> list[Scores]:
        truth = [performance.states for performance in shown.performances]
        likely = [each.states.argmax(axis=1) for each in what]
        if by_gesteme:
            truth, likely = (
                [names.of_state[states] for states in all_] for all_ in (truth, likely)
            )
        return [score(*pair) for pair in zip(truth, likely, strict=True)]

    scores = {
        "lhmm": judged(followed),
        "eager_lhmm": judged(hurried),
        "segment_filter": judged(believed),
    }
    truth = names.of_state[shown.performances[0].states]
    changes = np.flatnonzero(np.diff(shown.performances[0].states)) + 1
    first = {name: own[0] for name, own in scores.items()}
    picture = _panels(names, followed[0], believed[0], truth, changes, first)
    numbers: dict[str, Number] = {
        "steps": len(truth),
        "performances": len(shown.performances),
        "changes_at": changes.tolist(),
        **_level_numbers(followed[0], truth),
    }
    for name, own in scores.items():
        numbers |= _scored(name, own[0]) | _scored(f"all_{name}", pooled(own))
    what = "gestemes" if by_gesteme else "states"
    return Drawn(
        picture,
        numbers,
        _found(followed[0], truth, scores, what),
        _differs(settings, followed[0], truth, scores, by_gesteme=by_gesteme),
    )


def _names(data: TaskSet) -> _Names:
    return _Names(
        tuple(state.name for state in data.task.states),
        tuple(gesteme.name for gesteme in data.task.gestemes),
        data.gesteme_of_state,
    )


def _level_numbers(followed: _Followed, truth: Integers) -> dict[str, Number]:
    wrong = followed.winners != truth
    falls = followed.falls
    return {
        "winning_gesteme_right": float((~wrong).mean()),
        "lhmm_mean_margin": _margin(followed.states),
        "gesteme_hmms_mean_margin": followed.margin_of_gestemes,
        "mean_fall_nats_gesteme_right": float(falls[~wrong].mean()) if (~wrong).any() else None,
        "mean_fall_nats_gesteme_wrong": float(falls[wrong].mean()) if wrong.any() else None,
    }


def _found(
    followed: _Followed, truth: Integers, scores: Mapping[str, Sequence[Scores]], what: str
) -> str:
    wrong, falls = followed.winners != truth, followed.falls
    fall = (
        f"Where the wrong gesteme won, the total likelihood fell by {falls[wrong].mean():.1f} "
        f"nats a step, elsewhere by {falls[~wrong].mean():.1f}. "
        if wrong.any() and not wrong.all()
        else ""
    )
    layered, unmarked = scores["lhmm"], scores["segment_filter"]
    return (
        f"The winning gesteme HMM was right in {100 * (~wrong).mean():.0f} % of {len(truth)} "
        f"steps. The layered HMM, restarted at the true changes, had {_percent(layered[0])} of "
        f"{what} right and saw the changes {_delays(layered[0])} late. The two most probable "
        f"differed by {_margin(followed.states):.2f} on average for its states, by "
        f"{followed.margin_of_gestemes:.2f} for the gesteme HMMs. {fall}The segment filter, told "
        f"nothing, had {_percent(unmarked[0])} right and saw the changes {_delays(unmarked[0])} "
        f"late. Over all {len(layered)} performances: layered HMM {_pooled(layered)}; segment "
        f"filter {_pooled(unmarked)}."
    )


def _differs(
    settings: LayeredSettings,
    followed: _Followed,
    truth: Integers,
    scores: Mapping[str, Sequence[Scores]],
    *,
    by_gesteme: bool,
) -> str:
    wrong = int((followed.winners != truth).sum())
    told = [
        f"The wrong gesteme won in {counted(wrong, 'step')}."
        if wrong
        else "The thesis has the wrong gesteme win at times; here it never did."
    ]
    if by_gesteme:
        longest = pooled(scores["lhmm"]).switch_delays.max()
        hurried = pooled(scores["eager_lhmm"]).switch_delays.max()
        told.append(
            "The thesis sees a significant delay where the order leaves the trained one. Here the "
            f"longest in all performances is {counted(int(longest), 'step')}; were any state "
            f"allowed to follow with {settings.eager_any_state:g} a step instead of "
            f"{settings.any_state:g}, {counted(int(hurried), 'step')}. Right is a belief whose "
            "gesteme is right: each serves two states, and of an order never seen no more is true."
        )
    told.append(
        "Likelihoods are drawn on a logarithmic scale. The bottom panel is not in the thesis: it "
        "is a recognizer told nothing of changes, which therefore sees some before they come, as "
        "the hand rounds a corner, and some after."
    )
    return " ".join(told)


def _follow(model: Model, performance: Performance) -> _Followed:
    knowledge: TwoLevels = model.knowledge
    recognizer = recognizer_of(model)
    gestemes = GestemeClassifier(knowledge.gestemes, model.axes, knowledge.restart, knowledge.cusum)
    beliefs = [recognizer.step(step).belief for step in performance.steps]
    classified = np.array([gestemes.step(step).gestemes for step in performance.steps])
    states = np.array([belief.states for belief in beliefs])
    total = np.cumsum([belief.log_likelihood for belief in beliefs])
    with np.errstate(divide="ignore"):
        log_alpha = total[:, None] + np.log(states)
    return _Followed(log_alpha, states, classified.argmax(axis=1), _margin(classified))


def _believe(model: Model, performance: Performance) -> _Believed:
    recognizer = recognizer_of(model)
    beliefs = [recognizer.step(step).belief for step in performance.unmarked().steps]
    return _Believed(
        np.array([belief.states for belief in beliefs]),
        np.array([belief.unknown for belief in beliefs]),
    )


def _margin(rows: Array) -> float:
    """Mean difference between the largest and the next of each row."""
    ordered = np.sort(rows, axis=1)
    return float((ordered[:, -1] - ordered[:, -2]).mean())


def _scored(name: str, scores: Scores) -> dict[str, Number]:
    return {
        f"{name}_accuracy": scores.accuracy,
        f"{name}_switch_delays": scores.switch_delays.tolist(),
        f"{name}_missed_switches": scores.missed_switches,
        f"{name}_false_switches": int(scores.false_switches),
    }


def _percent(scores: Scores) -> str:
    return f"{100 * scores.accuracy:.1f} %"


def _delays(scores: Scores) -> str:
    missed = f" ({scores.missed_switches} never)" if scores.missed_switches else ""
    return f"{listed([str(d) for d in scores.switch_delays.tolist()])} steps{missed}"


def _pooled(scores: Sequence[Scores]) -> str:
    every = pooled(scores)
    return (
        f"{_percent(every)} right, 95 % of changes within {every.switch_delay(95):.0f} steps, "
        f"{every.false_switches_per_1000_steps:.1f} false switches in 1000 steps"
    )


def _panels(
    names: _Names,
    followed: _Followed,
    believed: _Believed,
    truth: Integers,
    changes: NDArray[np.intp],
    scores: Mapping[str, Scores],
) -> Picture:
    picture = new_picture(10.4)
    axes = picture.subplots(4, 1, sharex=True, height_ratios=[1.0, 1.0, 0.75, 1.0], squeeze=True)
    raw, normalized, gestemes, ours = axes
    at = np.arange(len(truth))
    for state in range(len(names.states)):
        style = _style(state)
        raw.plot(at, followed.log_alpha[:, state], **style)
        normalized.plot(at, followed.states[:, state], **style)
        ours.plot(at, believed.states[:, state], **style)
    ours.fill_between(at, believed.unknown, step="mid", color=UNKNOWN_COLOR, alpha=0.5, linewidth=0)
    lowest = followed.log_alpha.max(axis=1).min() + _LOWEST_NATS
    raw.set_ylim(max(float(followed.log_alpha.min()), float(lowest)) - 3.0, 3.0)
    raw.set_title("Layered HMM, restart given: likelihood of each state")
    raw.set_ylabel("log likelihood, nats")
    normalized.set_title("The same, normalized")
    for gesteme in range(len(names.gestemes)):
        own = at[truth == gesteme]
        left, right = own - 0.5, own + 0.5
        gestemes.hlines(np.full(len(own), gesteme), left, right, color="#bbbbbb", linewidth=9)
    gestemes.plot(at, followed.winners, color=INK, linestyle="", marker="o", ms=4)
    gestemes.set_yticks(range(len(names.gestemes)), names.gestemes)
    gestemes.set_ylim(-0.6, len(names.gestemes) - 0.4)
    gestemes.set_title("Winning gesteme HMM (dots) and true gesteme (gray): input of the task HMM")
    gestemes.set_ylabel("gesteme")
    ours.set_title("Segment filter, no marks given: probability of each state")
    ours.set_xlabel("step")
    for ax, scored in ((normalized, scores["lhmm"]), (ours, scores["segment_filter"])):
        ax.set_ylim(-0.03, 1.22)
        ax.set_yticks([0.0, 0.5, 1.0])
        ax.set_ylabel("probability")
        _mark_delays(ax, changes, scored.switch_delays)
    for ax in axes:
        draw_changes(ax, changes.tolist())
        ax.set_xlim(-0.5, len(at) - 0.5)
    picture.legend(
        handles=_legend(names),
        loc="outside lower center",
        ncols=len(names.states) + 2,
        columnspacing=1.2,
        handlelength=1.6,
    )
    return picture


def _style(state: int) -> dict[str, Any]:
    return {
        "color": color_of(state),
        "linewidth": 1.5,
        "marker": mark_of(state),
        "ms": 3.6,
        "markevery": (state, 6),
    }


def _mark_delays(ax: Axes, changes: NDArray[np.intp], delays: NDArray[np.int64]) -> None:
    for change, delay in zip(changes, delays, strict=True):
        ax.annotate(
            f"{delay:+d}".replace("-", "−") if delay else "0",
            (change - 0.5, 1.2),
            xytext=(3, 0),
            textcoords="offset points",
            va="top",
            fontsize=9.0,
        )


def _legend(names: _Names) -> Sequence[Line2D | Patch]:
    states = [
        Line2D([], [], **{**_style(s), "markevery": None}, label=f"{name} ({gesteme})")
        for s, (name, gesteme) in enumerate(
            (name, names.gestemes[names.of_state[s]]) for s, name in enumerate(names.states)
        )
    ]
    return [
        *states,
        Patch(color=UNKNOWN_COLOR, alpha=0.5, label="unknown"),
        change_handle("true change; above, its delay in steps"),
    ]
