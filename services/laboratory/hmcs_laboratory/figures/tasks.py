"""Figures of tasks followed by the layered HMM: 4.12, 4.13, 4.16 and 4.17."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hmcs.recognition.learning import learn
from hmcs.recognition.scoring import Scores, pooled, score
from hmcs_baselines.gesteme_hmms import GestemeHmmSettings
from hmcs_baselines.observing import ObservationSettings
from hmcs_baselines.task_level import TaskLevelSettings
from hmcs_baselines.two_levels import Confusions, LayeredHmmSettings
from hmcs_laboratory.data.hands import Count, Share
from hmcs_laboratory.data.synthetic_tasks import five_states
from hmcs_laboratory.data.tasks import TaskSet
from hmcs_laboratory.figures.drawing import Drawn, Number, counted, listed
from hmcs_laboratory.figures.drawn import DrawnOrderSettings, drawn_orders
from hmcs_laboratory.figures.task_following import (
    Believed,
    Followed,
    Integers,
    Names,
    believe,
    follow,
    margin_of,
    names_of,
)
from hmcs_laboratory.figures.task_panels import draw_panels
from hmcs_laboratory.figures.trajectories import TaskFigureSettings
from hmcs_laboratory.study import StudySettings


class LayeredHmmFigureSettings(StudySettings):
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
    confusions: Confusions = "training"
    """Of which demonstrations the task HMM learns how gestemes are confused."""

    def lhmm_settings(
        self, any_state: float, confusions: Confusions | None = None
    ) -> LayeredHmmSettings:
        """Return the settings of the layered HMM: as in the thesis, restarted at given marks."""
        return LayeredHmmSettings(
            confusions=confusions or self.confusions,
            observing=ObservationSettings(symbols=self.symbols),
            gestemes=GestemeHmmSettings(
                states=self.gesteme_states, emission_floor=self.emission_floor
            ),
            restart="given",
            task=TaskLevelSettings(emission_floor=self.task_emission_floor, any_state=any_state),
        )


class FollowedSettings(TaskFigureSettings, LayeredHmmFigureSettings):
    """Of figures 4.12 and 4.13."""


class DrawnFollowedSettings(DrawnOrderSettings, LayeredHmmFigureSettings):
    """Of figures 4.16 and 4.17."""


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
    learned: TaskSet, shown: TaskSet, settings: LayeredHmmFigureSettings, *, by_gesteme: bool
) -> Drawn:
    """Learn one task, follow all performances of the other, draw a typical one and tell of all.

    Typical is the one in which the layered HMM has the median share of its steps right.

    With `by_gesteme` a belief is right where its gesteme is: of a task in an order never seen, no
    more is true.
    """
    task, names = learned.task, names_of(learned)
    other_confusions: Confusions = "training" if settings.confusions == "held-out" else "held-out"
    lhmm, eager, other = (
        learn(task, learned.demonstrations, chosen, recognizer="lhmm")
        for chosen in (
            settings.lhmm_settings(settings.any_state),
            settings.lhmm_settings(settings.eager_any_state),
            settings.lhmm_settings(settings.any_state, other_confusions),
        )
    )
    filtering = learn(task, learned.demonstrations)
    followed = [follow(lhmm, performance) for performance in shown.performances]
    hurried = [follow(eager, performance) for performance in shown.performances]
    by_other = [follow(other, performance) for performance in shown.performances]
    believed = [believe(filtering, performance) for performance in shown.performances]

    def judged(what: Sequence[Followed] | Sequence[Believed]) -> list[Scores]:
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
        "other_confusions_lhmm": judged(by_other),
        "segment_filter": judged(believed),
    }
    typical = int(np.argsort([each.accuracy for each in scores["lhmm"]])[len(followed) // 2])
    truth = names.of_state[shown.performances[typical].states]
    changes = np.flatnonzero(np.diff(shown.performances[typical].states)) + 1
    own_scores = {name: own[typical] for name, own in scores.items()}
    picture = draw_panels(names, followed[typical], believed[typical], truth, changes, own_scores)
    winners_right = _winners_right(followed, shown, names)
    numbers: dict[str, Number] = {
        "steps": len(truth),
        "performances": len(shown.performances),
        "changes_at": changes.tolist(),
        **_level_numbers(followed[typical], truth),
        "all_winning_gesteme_right": winners_right,
    }
    for name, own in scores.items():
        numbers |= _scored(name, own[typical]) | _scored(f"all_{name}", pooled(own))
    what = "gestemes" if by_gesteme else "states"
    drawn = _found(followed[typical], truth, typical, scores, what)
    accuracies = {
        settings.confusions: pooled(scores["lhmm"]).accuracy,
        other_confusions: pooled(scores["other_confusions_lhmm"]).accuracy,
    }
    return Drawn(
        picture,
        numbers,
        f"{drawn} {_headline(winners_right, accuracies, what)}",
        _differs(settings, followed[typical], truth, scores, by_gesteme=by_gesteme),
    )


def _winners_right(followed: Sequence[Followed], shown: TaskSet, names: Names) -> float:
    """Share of all steps in which the winning gesteme HMM is that of the true gesteme."""
    right = [
        each.winners == names.of_state[performance.states]
        for each, performance in zip(followed, shown.performances, strict=True)
    ]
    return float(np.concatenate(right).mean())


def _headline(winners_right: float, accuracies: Mapping[Confusions, float], what: str) -> str:
    """What the task level makes of a gesteme level that errs, however it learned of that."""
    held_out, training = accuracies["held-out"], accuracies["training"]
    return (
        f"In all performances the winning gesteme was right in {100 * winners_right:.1f} % of the "
        f"steps. The task level had {100 * held_out:.1f} % of {what} right where it had learned "
        "the confusions from demonstrations that the gesteme HMMs had not seen, and "
        f"{100 * training:.1f} % where, as in the thesis, from those they were learned from."
    )


def _level_numbers(followed: Followed, truth: Integers) -> dict[str, Number]:
    wrong = followed.winners != truth
    falls = followed.falls
    return {
        "winning_gesteme_right": float((~wrong).mean()),
        "lhmm_mean_margin": margin_of(followed.states),
        "gesteme_hmms_mean_margin": followed.margin_of_gestemes,
        "mean_fall_nats_gesteme_right": float(falls[~wrong].mean()) if (~wrong).any() else None,
        "mean_fall_nats_gesteme_wrong": float(falls[wrong].mean()) if wrong.any() else None,
    }


def _found(
    followed: Followed,
    truth: Integers,
    typical: int,
    scores: Mapping[str, Sequence[Scores]],
    what: str,
) -> str:
    wrong, falls = followed.winners != truth, followed.falls
    fall = (
        f"Where the wrong gesteme won, the total likelihood fell by {falls[wrong].mean():.1f} "
        f"nats a step, elsewhere by {falls[~wrong].mean():.1f}. "
        if wrong.any() and not wrong.all()
        else ""
    )
    lhmm, unmarked = scores["lhmm"], scores["segment_filter"]
    return (
        f"The winning gesteme HMM was right in {100 * (~wrong).mean():.0f} % of {len(truth)} "
        f"steps. The layered HMM, restarted at the true changes, had {_percent(lhmm[typical])} of "
        f"{what} right and saw the changes {_delays(lhmm[typical])} late. The two most probable "
        f"differed by {margin_of(followed.states):.2f} on average for its states, by "
        f"{followed.margin_of_gestemes:.2f} for the gesteme HMMs. {fall}The segment filter, given "
        f"no changes, had {_percent(unmarked[typical])} right and saw the changes "
        f"{_delays(unmarked[typical])} late. Over all {len(lhmm)} performances: "
        f"layered HMM {_pooled(lhmm)}; segment filter {_pooled(unmarked)}."
    )


def _differs(
    settings: LayeredHmmFigureSettings,
    followed: Followed,
    truth: Integers,
    scores: Mapping[str, Sequence[Scores]],
    *,
    by_gesteme: bool,
) -> str:
    wrong = int((followed.winners != truth).sum())
    sentences = [
        f"The wrong gesteme won in {counted(wrong, 'step')}."
        if wrong
        else "The thesis has the wrong gesteme win at times; here it never did."
    ]
    if by_gesteme:
        longest = pooled(scores["lhmm"]).switch_delays.max()
        hurried = pooled(scores["eager_lhmm"]).switch_delays.max()
        sentences.append(
            "The thesis sees a significant delay where the order leaves the trained one. Here the "
            f"longest in all performances is {counted(int(longest), 'step')}; were any state "
            f"allowed to follow with {settings.eager_any_state:g} a step instead of "
            f"{settings.any_state:g}, {counted(int(hurried), 'step')}. Right is a belief whose "
            "gesteme is right: each serves two states, and of an order never seen no more is true."
        )
    sentences.append(
        "Drawn is the performance of median accuracy, likelihoods on a logarithmic scale. The "
        "bottom panel is not in the thesis: it is a recognizer given no changes, which therefore "
        "sees some before they come, as the hand rounds a corner, and some after."
    )
    return " ".join(sentences)


def _scored(name: str, scores: Scores) -> dict[str, Number]:
    return {
        f"{name}_accuracy": scores.accuracy,
        f"{name}_switch_delays": scores.switch_delays.tolist(),
        f"{name}_missed_switches": scores.missed_switches,
        f"{name}_false_switches": int(scores.false_switches),
        f"{name}_false_switches_per_1000": scores.false_switches_per_1000_steps,
        f"{name}_delay_p95_steps": scores.switch_delay(95),
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
