"""Which parts of the task a model finds in the recording that is shown, and who learned from it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import viser

from hmcs.shown import Markdown, linked
from hmcs_console.seeing.found import agreement
from hmcs_console.seeing.reports import address_of
from hmcs_console.seeing.shelf import Shelved, labels_of, learned_from
from hmcs_console.seeing.takes import Take
from hmcs_console.serving.buttons import FIND, PLAIN, on_click
from hmcs_console.serving.writing import Choice, add_drawing, add_words, draw, write
from hmcs_console.teaching.strips import strips

MOST_LEARNED = 12
"""Of the models that were learned from a recording so many are named."""


class Finding(Protocol):
    """Who has the parts of a recording found; called on the page's threads."""

    def segment(self, model: str, model_hash: str) -> None:
        """Find the parts of the recording that is shown by a model."""


class Parts:
    """The controls, in the container that is open now; drawn on one thread."""

    def __init__(self, gui: viser.GuiApi, finding: Finding) -> None:
        self._finding = finding
        self._models: dict[str, Shelved] = {}
        self._chosen_by_hand = False
        self._strips = add_drawing(gui, order=2.0)
        self._agrees = add_words(gui, order=2.1)
        self._learned = add_words(gui, order=2.2)
        self._choice = Choice(gui, "Model", order=2.3)
        self._choice.on_choice(self._choose)
        find = gui.add_button(
            "Segment",
            order=2.4,
            color=PLAIN,
            icon=FIND,
            hint="Which part each moment was, found afterwards by this model",
        )
        on_click(find, self._find)

    def draw(self, take: Take, states: Sequence[str], models: Sequence[Shelved]) -> None:
        """Draw what was found in a recording; of the models the first one is active."""
        shown = "" if take.found is None else strips(take, take.found, states)
        draw(self._strips, shown)
        write(self._agrees, agreed(take))
        self._agrees.visible = bool(self._agrees.content)
        write(self._learned, learned(learned_from(models, take.name)))
        self._learned.visible = bool(self._learned.content)
        self._offer(labels_of(models))

    def _offer(self, models: dict[str, Shelved]) -> None:
        first = next(iter(models), "")
        before = next(iter(self._models), "")
        self._models = models
        self._choice.offer(tuple(models), none_too=False)
        if first != before and not (self._chosen_by_hand and self._choice.chosen in models):
            self._choice.choose(first)

    def _choose(self, _: str) -> None:
        self._chosen_by_hand = True

    def _find(self) -> None:
        model = self._models.get(self._choice.chosen)
        if model is not None:
            self._finding.segment(model.name, model.hash)


def agreed(take: Take) -> Markdown:
    """Return how much of the labeled time was found as it is labeled; nothing where nothing is."""
    share = agreement(take)
    if share is None or take.found is None:
        return Markdown("")
    return Markdown("**{}** finds {:.0%} of the labeled time as it is labeled").format(
        take.found.model, share
    )


def learned(models: Sequence[Shelved]) -> Markdown:
    """Return which models were learned from a recording, with their reports."""
    if not models:
        return Markdown("")
    named = Markdown(", ").join(map(_with_report, models[:MOST_LEARNED]))
    more = len(models) - MOST_LEARNED
    ending = Markdown(" and {} more").format(more) if more > 0 else Markdown("")
    return Markdown("Learned from it: {}{}").format(named, ending)


def _with_report(model: Shelved) -> Markdown:
    if not model.report:
        return Markdown("**{}**").format(model.name)
    return Markdown("**{}** ({})").format(model.name, linked("report", address_of(model.report)))
