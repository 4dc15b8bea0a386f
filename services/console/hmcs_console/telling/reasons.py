"""Why a state is held likely, and what would change that: what numbers show of it.

Of evidence only what stands in messages counts, of directions only what learned paths say. What
no process reported is left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import log
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.bus.messages import Belief, Evidence, FixtureState
from hmcs.fixtures.guides.guidance import TANGENT_REACH_M
from hmcs.motion.paths import Path
from hmcs.task import Task

NOTABLE = 0.01
"""A state that is less probable is no rival, unless it may follow."""
MOST_RIVALS = 4
_LINE = 1e-6
"""Directions whose unit vectors lie so near one line have no side to turn to."""

Vector = NDArray[np.float64]


class Support(NamedTuple):
    """What the newest step says of a gesteme, begun where the segment is thought to have begun."""

    state: str
    """Whose gesteme it is."""
    gesteme: str
    log_ratio_nats: float | None
    """Of the step, against the background; None where the gesteme is ruled out by then."""


class Rival(NamedTuple):
    """A state that might take over."""

    state: str
    probability: float
    follows: bool
    """Whether it may follow the likely one."""
    odds_nats: float | None
    """ln(P(likely) / P(rival)): so much evidence is lacking; None where it has no probability."""
    turn_rad: float | None
    """From where the likely state's guide leads now to where the rival's does; None where one of
    them is not known."""
    toward: Vector | None
    """Which way the hand would turn: the unit vector across the guide, shape (3,); None where it is
    not known, and where the turn has no side."""


class Reasons(NamedTuple):
    """Why a state is likely, and what would change that."""

    likely: str
    gesteme: str
    progress: float | None
    """Along the guide, 0 to 1; None where it is unknown."""
    left_m: float | None
    """To the end of the guide, m of the hand; None where it is unknown."""
    support: tuple[Support, ...]
    rivals: tuple[Rival, ...]
    """The most probable first."""


def reasons_of(
    belief: Belief | None,
    evidence: tuple[Evidence, ...],
    fixture: FixtureState | None,
    task: Task | None,
    paths: Mapping[str, Path],
) -> Reasons | None:
    """Return what is known; None where there is no belief, or none of this task.

    `evidence` is what classifiers made of the step of the belief, each of the gestemes it holds;
    `paths` are the learned ones by gesteme, m of the hand.
    """
    if belief is None or task is None or not belief.states:
        return None
    if belief.states != tuple(state.name for state in task.states):
        return None
    likely = belief.likely_state
    gesteme = belief.likely_gesteme or task.state(likely).gestemes[0]
    path = paths.get(gesteme)
    leads = fixture is not None and (fixture.state, fixture.gesteme) == (likely, gesteme)
    progress = gone_m = left_m = now = None
    if path is not None and fixture is not None and leads:
        progress = fixture.progress
        gone_m = progress * path.length_m
        left_m, now = path.length_m - gone_m, path.tangent(gone_m, TANGENT_REACH_M)
    support = _support(belief, evidence, task)
    living = {each.state for each in support if each.log_ratio_nats is not None}
    rivals = []
    for name in _rivals(belief, task):
        then = _led_to(belief, task, paths, name, gone_m if name in living else None)
        rivals.append(_rival(belief, task, name, now, then))
    return Reasons(likely, gesteme, progress, left_m, support, tuple(rivals))


def log_ratio(
    evidence: tuple[Evidence, ...], gesteme: str, start: int
) -> tuple[bool, float | None]:
    """Return whether a classifier holds a gesteme, and its log ratio, begun at a step, nats.

    The latter is None where it holds it, but not with that beginning any more.
    """
    held = False
    for heard in evidence:
        if gesteme in heard.gestemes:
            held = True
            index = heard.gestemes.index(gesteme)
            found = np.flatnonzero((heard.pair_gesteme == index) & (heard.pair_start == start))
            if len(found):
                return True, float(heard.log_ratio[found[0]])
    return held, None


def turn(now: Vector, then: Vector) -> tuple[float, Vector | None]:
    """Return the angle between two unit vectors, (3,), rad, and which way the first is turned.

    The latter is the unit vector across it, (3,); None where they lie on one line.
    """
    along = float(now @ then)
    across = then - along * now
    size = float(np.linalg.norm(across))
    return float(np.arctan2(size, along)), (across / size if size > _LINE else None)


def _support(belief: Belief, evidence: tuple[Evidence, ...], task: Task) -> tuple[Support, ...]:
    """Of the likely state and its rivals, in that order, what is known."""
    found = []
    for name in (belief.likely_state, *_rivals(belief, task)):
        for gesteme in task.state(name).gestemes:
            held, ratio = log_ratio(evidence, gesteme, belief.segment_start)
            if held:
                found.append(Support(name, gesteme, ratio))
    return tuple(found)


def _rivals(belief: Belief, task: Task) -> list[str]:
    """States that might take over: notable ones, and those that follow; the most probable first."""
    likely = belief.likely_state
    follow = task.state(likely).next
    probable = dict(zip(belief.states, belief.probabilities.tolist(), strict=True))
    might = [
        name
        for name in belief.states
        if name != likely and (name in follow or probable[name] >= NOTABLE)
    ]
    might.sort(key=lambda name: (-probable[name], -follow.get(name, 0.0)))
    return might[:MOST_RIVALS]


def _rival(belief: Belief, task: Task, name: str, now: Vector | None, then: Vector | None) -> Rival:
    """`now` and `then` are where the guides of the likely state and of the rival lead."""
    probability = float(belief.probabilities[belief.states.index(name)])
    turned = turn(now, then) if now is not None and then is not None else (None, None)
    return Rival(
        name,
        probability,
        name in task.state(belief.likely_state).next,
        log(belief.confidence / probability) if probability > 0 else None,
        *turned,
    )


def _led_to(
    belief: Belief, task: Task, paths: Mapping[str, Path], name: str, gone_m: float | None
) -> Vector | None:
    """Return where a rival's guide leads the hand; None where it has none.

    What may follow begins. What the likely state follows has not ended yet. Any other explains the
    same segment otherwise: it is as far along as the hand, `gone_m`, where it lives since then.
    """
    path = paths.get(task.state(name).gestemes[0])
    if path is None:
        return None
    place_m = gone_m or 0.0
    if name in task.state(belief.likely_state).next:
        place_m = 0.0
    elif belief.likely_state in task.state(name).next:
        place_m = path.length_m
    return path.tangent(place_m, TANGENT_REACH_M)
