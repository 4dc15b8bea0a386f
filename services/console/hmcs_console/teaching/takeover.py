"""A newcomer takes over: loaded, compared with who is active, activated. A function of time.

As `hmcs deploy` does it: the newcomer runs beside the active recognizer for a while first, and
whatever is refused on the way leaves active what was active.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

from hmcs.bus.messages import TrainingProgress
from hmcs.recognizer_takeover import (
    NOTHING_COMPARED,
    Agreement,
    Question,
    SameNameError,
    activate,
    check_names_differ,
    load_into_fixture,
    load_into_recognizer,
)
from hmcs.shown import Markdown

Stage = Literal["loading", "comparing", "activating", "done", "failed"]
_LINES = Markdown("  \n")
UNDER_WAY: tuple[Stage, ...] = ("loading", "comparing", "activating")


class Takeover(NamedTuple):
    """How far a newcomer is."""

    model: str
    before: str
    """Who was active as it began; empty where nobody was."""
    stage: Stage
    to_ask: tuple[Question, ...] = ()
    """What is still to be carried out before it is compared, the first of it being asked now."""
    loaded: tuple[str, ...] = ()
    """What those said who have loaded it."""
    hurried: bool = False
    """Nothing is to be compared."""
    until_s: float = math.inf
    """It is compared until then, by the local monotonic clock."""
    agreed: Agreement = NOTHING_COMPARED
    """With who is active, so far."""
    detail: str = ""
    """What came of it in the end."""

    @property
    def under_way(self) -> bool:
        """Whether it has not ended yet."""
        return self.stage in UNDER_WAY


class Advance(NamedTuple):
    """A takeover after something happened."""

    takeover: Takeover
    ask: Question | None = None
    """To be asked now; its answer is what `answered` or `refused` receives."""


class Followed(NamedTuple):
    """Which recognizers have been active."""

    now: str = ""
    before: str = ""
    """Empty where only one has been."""


def begun(trained: TrainingProgress | None, active: str) -> Advance:
    """Return the takeover of what was trained last, beside the active recognizer, if any."""
    if trained is None or trained.stage != "done":
        name = "what was trained" if trained is None else trained.model
        return _failed(Takeover(name, active, "failed"), "nothing was trained yet: train first")
    takeover = Takeover(trained.model, active, "loading")
    try:
        check_names_differ(trained.model, active)
    except SameNameError as error:
        return _failed(takeover, str(error))
    to_ask = (load_into_fixture(trained.path), load_into_recognizer(trained.path))
    return Advance(takeover._replace(to_ask=to_ask), to_ask[0])


def answered(takeover: Takeover, detail: str, now_s: float, compare_s: float) -> Advance:
    """Return what follows once what was asked is carried out; `detail` says what is so now."""
    if takeover.stage == "activating":
        return Advance(takeover._replace(stage="done", detail=detail))
    to_ask = takeover.to_ask[1:]
    takeover = takeover._replace(to_ask=to_ask, loaded=(*takeover.loaded, detail))
    if to_ask:
        return Advance(takeover, to_ask[0])
    if takeover.hurried or not takeover.before or compare_s == 0:
        return _activated(takeover)
    return Advance(takeover._replace(stage="comparing", until_s=now_s + compare_s))


def refused(takeover: Takeover, reason: str) -> Advance:
    """Return what follows where what was asked was not carried out."""
    return _failed(takeover, reason)


def at(takeover: Takeover, now_s: float, agreed: Agreement, *, there: bool) -> Advance:
    """Return what follows from the time that went by.

    `agreed` is how the newcomer and the active one agree; `there` whether a recognizer is there.
    """
    if takeover.stage != "comparing":
        return Advance(takeover)
    if not there:
        return _failed(takeover, "the recognizer that was to run it is gone")
    takeover = takeover._replace(agreed=agreed)
    return _activated(takeover) if now_s >= takeover.until_s else Advance(takeover)


def hurried(takeover: Takeover) -> Advance:
    """Return what follows where nothing more is to be compared."""
    if takeover.stage == "comparing":
        return _activated(takeover)
    return Advance(takeover._replace(hurried=True) if takeover.stage == "loading" else takeover)


def called_off(takeover: Takeover) -> Advance:
    """Return what follows where the newcomer is not wanted after all."""
    return _failed(takeover, "called off") if takeover.stage == "comparing" else Advance(takeover)


def followed(known: Followed, active: str) -> Followed:
    """Return which recognizers have been active, as one is now; nobody is empty."""
    return known if active in ("", known.now) else Followed(active, known.now)


def said(takeover: Takeover | None, now_s: float) -> Markdown:
    """Return how far a newcomer is, in words; nothing where there is none."""
    if takeover is None:
        return Markdown("")
    name, before = Markdown("**{}**").format(takeover.model), takeover.before
    match takeover.stage:
        case "loading":
            return Markdown("{} is being loaded …").format(name)
        case "comparing":
            left_s = math.ceil(max(takeover.until_s - now_s, 0.0))
            text = Markdown("{} runs beside {}: {}, active in {} s")
            text = text.format(name, before, _agreed(takeover), left_s)
            return _LINES.join([text, *takeover.loaded])
        case "activating":
            return Markdown("{} is being activated …").format(name)
        case "done":
            lines = [Markdown("{} took over: {}").format(name, takeover.detail)]
            if before:
                lines.append(Markdown("beside {}: {}").format(before, _agreed(takeover)))
            return _LINES.join([*lines, *takeover.loaded])
        case "failed":
            still = Markdown(", {} is active still" if before else "").format(before)
            text = Markdown("{} did not take over{}: {}")
            return text.format(name, still, takeover.detail)


def _agreed(takeover: Takeover) -> str:
    if takeover.stage == "comparing" and not takeover.agreed.compared:
        return "the hand does not move: nothing is compared"
    return str(takeover.agreed)


def _activated(takeover: Takeover) -> Advance:
    question = activate(takeover.model)
    return Advance(takeover._replace(stage="activating"), question)


def _failed(takeover: Takeover, reason: str) -> Advance:
    return Advance(takeover._replace(stage="failed", detail=reason))
