"""The fixtures that are compared, each with the settings of its source."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from hmcs.fixtures.controller.rules import Rules, rules_of
from hmcs.recognition.registry import DEFAULT
from hmcs.task import FixtureSetup, Task

DEFAULT_LAW = "insistence"
"""What a task file gets that says nothing about its fixture."""


@dataclass(frozen=True)
class AssistLaw:
    """A fixture, and the recognizer it listens to."""

    name: str
    source: str
    fixture: FixtureSetup
    recognizer: str = DEFAULT
    recognizer_settings: Mapping[str, str] = field(default_factory=dict)
    dead_zone_m: float | None = None
    """δ of its recognizer; the study's where None."""

    def rules(self, task: Task) -> Rules:
        """Return the rules of a task whose fixture is this one."""
        return rules_of(task.model_copy(update={"fixture": self.fixture}))


_BELIEF: Mapping[str, Any] = {
    "compliance": "belief",
    "tremor": "none",
    "shift_beyond_m": 0.0,
    "maximum_factor": 0.8,
    "pull": 0.0,
}
_THESIS = FixtureSetup(law="thesis", **_BELIEF)

LAWS: tuple[AssistLaw, ...] = (
    AssistLaw(
        "none",
        "the operator alone: free motion, at the same speed limit",
        FixtureSetup(**{**_BELIEF, "maximum_factor": 0.0}),
    ),
    AssistLaw(
        "chapter-3",
        "Aarno 2007, chapter 3 whole: (3.6) on its recognizer as it is written, dead zone 20 mm",
        _THESIS,
        recognizer="chapter-3",
        dead_zone_m=0.02,
    ),
    AssistLaw(
        "directions",
        "HMCS: the same law, directions by chords, Gaussians and a counted chain",
        _THESIS,
        recognizer="directions",
        dead_zone_m=0.02,
    ),
    AssistLaw("thesis", "Aarno 2007, (3.6)-(3.8), on the default recognizer", _THESIS),
    AssistLaw("general", "Aarno 2007, (2.29) with c = 1", FixtureSetup(**_BELIEF)),
    AssistLaw(
        "hard",
        "Marayong et al. 2003: (2.29) with no compliance once sure, with pull (2.32)",
        FixtureSetup(**{**_BELIEF, "maximum_factor": 1.0, "pull": 0.5}),
    ),
    AssistLaw("pull", "Aarno 2007, (2.32) with c = 1", FixtureSetup(**{**_BELIEF, "pull": 0.5})),
    AssistLaw(
        "insistence", "HMCS: soft pull that lets go of an operator who insists", FixtureSetup()
    ),
)
"""In the order they are listed."""
