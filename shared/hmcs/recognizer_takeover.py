"""One recognizer takes over from another: what the operator's page and `hmcs deploy` do alike.

The newcomer runs as a shadow of the active recognizer first: the fixture loads its model, its
beliefs are compared with those of the active one for a while, and only then does the fixture follow
it. Who asks the processes and how they wait is each side's own. No clock and no bus is used here.
"""

from __future__ import annotations

from collections import defaultdict
from typing import Any, NamedTuple

from hmcs.bus.keys import Member
from hmcs.bus.messages import ActivateRecognizer, Done, LoadModel, Message
from hmcs.bus.verbs import ACTIVATE, LOAD_MODEL, Verb
from hmcs.errors import UserError

_SILENT = ("gesteme_classifier",)
"""Services that work for a model and publish no belief."""


class SameNameError(UserError):
    """A newcomer that bears the name of the active recognizer; says what to do."""


class Question(NamedTuple):
    """A request that a process carries out."""

    service: str
    verb: Verb[Any, Done]
    body: Message


class Agreement(NamedTuple):
    """What a recognizer has in common with the one that is followed."""

    same: int
    """Steps both took the same state for the likely one."""
    compared: int
    """Steps both said something of."""

    def __str__(self) -> str:
        if not self.compared:
            return "nothing was compared"
        return f"the same likely state in {self.same / self.compared:.0%} of {self.compared} steps"


NOTHING_COMPARED = Agreement(0, 0)


class Shadows:
    """Compares what recognizers said of steps, whichever of them is followed.

    Of each recognizer the newest `steps` count; all of them where it is None.
    """

    def __init__(self, steps: int | None = 200) -> None:
        self._steps = steps
        self._said: defaultdict[str, dict[tuple[str, int], str]] = defaultdict(dict)

    def heard(self, recognizer: str, clock: str, step: int, state: str) -> None:
        """Write down which state a recognizer holds likely after step `step` of a device."""
        said = self._said[recognizer]
        said[clock, step] = state
        if self._steps is not None and len(said) > self._steps:
            del said[next(iter(said))]

    def forget(self, recognizer: str) -> None:
        """Leave out what was said so far under a name."""
        self._said.pop(recognizer, None)

    @property
    def recognizers(self) -> tuple[str, ...]:
        """Who was heard, by name."""
        return tuple(sorted(self._said))

    def agreement(self, active: str) -> dict[str, Agreement]:
        """Return how every other recognizer agrees with the active one, by name."""
        if active not in self._said:
            return {}
        truth = self._said[active]
        found = {}
        for name in self.recognizers:
            if name != active:
                said = self._said[name]
                both = truth.keys() & said.keys()
                found[name] = Agreement(sum(truth[at] == said[at] for at in both), len(both))
        return found


def check_names_differ(newcomer: str, active: str) -> None:
    """Raise SameNameError where two recognizers could not be distinguished by their names."""
    if newcomer == active:
        raise SameNameError(
            f"it is called {newcomer!r}, as the active one is: train it under another name, so "
            "that both can run side by side"
        )


def load_into_fixture(path: str) -> Question:
    """Return the request that the fixture learns the guides of a model file.

    It comes before the recognizer runs: a belief of a model that is not loaded there is refused.
    """
    return Question("fixture_controller", LOAD_MODEL, LoadModel(path=path))


def load_into_recognizer(path: str) -> Question:
    """Return the request that a recognizer process runs a model file as well."""
    return Question("recognizer", LOAD_MODEL, LoadModel(path=path))


def activate(recognizer: str) -> Question:
    """Return the request that the fixture follows a recognizer."""
    return Question("fixture_controller", ACTIVATE, ActivateRecognizer(model=recognizer))


def publishes_beliefs(member: Member) -> bool:
    """Whether a process that works for a model publishes beliefs: others only help one that does.

    A recognizer that no such process runs is not activated: the fixture would wait for its beliefs.
    """
    return member.service not in _SILENT
