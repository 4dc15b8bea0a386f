"""What is written of the model that is followed: why a state is likely, and what the task asks."""

from __future__ import annotations

from collections.abc import Mapping

import viser

from hmcs.motion.paths import Path
from hmcs.recognition.model import Model
from hmcs.task import Task
from hmcs_console.seeing.seen import Picture
from hmcs_console.serving.writing import add_words, write
from hmcs_console.telling import spoken_reasons, spoken_rules
from hmcs_console.telling.reasons import reasons_of

_LAST = 1e9
"""In what order it stands among all in its container."""


class Explained:
    """Writes it into two containers of the panel; made and drawn on one thread."""

    def __init__(
        self,
        gui: viser.GuiApi,
        reasons: viser.GuiTabHandle,
        rules: viser.GuiTabHandle,
        task: Task | None = None,
    ) -> None:
        """Write into two tabs; `task` is what the stack is for, as long as no model is followed."""
        with reasons:
            # Below what is pressed there: its height changes.
            self._reasons = add_words(gui, order=_LAST)
        with rules:
            self._rules = add_words(gui)
        self._own_task = task
        self._model: Model | None = None
        self._paths: Mapping[str, Path] = {}

    def draw(self, picture: Picture, model: Model | None) -> None:
        """Write down a moment, of the model that is followed."""
        if model is not self._model:
            self._model = model
            self._paths = {} if model is None else model.paths
        task = None if model is None else model.task
        reasons = reasons_of(picture.belief, picture.evidence, picture.fixture, task, self._paths)
        state = "" if picture.fixture is None else picture.fixture.state
        write(self._reasons, spoken_reasons.reasons(reasons))
        if not picture.active:
            task = self._own_task
        write(self._rules, spoken_rules.rules(task, state))
