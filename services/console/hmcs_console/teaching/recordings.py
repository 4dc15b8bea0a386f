"""Recordings as the recorder lists them, and labels it is to write down."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Literal

from hmcs.bus.keys import Keys, Member
from hmcs.bus.messages import (
    ChangeRecording,
    Outline,
    OutlineQuestion,
    Segmentation,
    SegmentQuestion,
)
from hmcs.bus.session import Answer
from hmcs.bus.verbs import CHANGE_RECORDING, OUTLINE, SEGMENT, SET_LABELS
from hmcs.errors import UserError
from hmcs_console.asking import Asking
from hmcs_console.seeing import takes
from hmcs_console.seeing.found import with_found
from hmcs_console.seeing.takes import Take

READ_S = 30.0
"""A recorder has so long to read a recording."""


class Recordings:
    """What is shown of recordings; requests come on the page's threads, the rest on the bus'."""

    def __init__(
        self,
        asking: Asking,
        keys: Keys,
        first: Callable[[str], Member | None],
        put: Callable[[Callable[[], None]], None],
    ) -> None:
        """Begin with none; `put` has something done on the bus' thread.

        `first` returns the process of a kind that is asked, None where none is there.
        """
        self._asking = asking
        self._keys = keys
        self._first = first
        self._put = put
        self._asked = 0
        self.take = Take()
        """What is shown now."""

    # --- what the page asks for; on its threads ---------------------------------------------------

    def open(self, name: str) -> None:
        """Show a recording, the newest where `name` is empty; it is read anew."""
        self._put(lambda: self._open(name))

    def refresh(self) -> None:
        """Have the recorder tell anew what there is."""
        self._put(lambda: self._open(self.take.name))

    def hide(self) -> None:
        """Show none."""
        self._put(self._hide)

    def choose(self, begin_s: float, end_s: float) -> None:
        """Choose a stretch to be labeled."""
        self._put(lambda: self._show(self.take._replace(chosen_s=(begin_s, end_s))))

    def label(self, state: str) -> None:
        """Label the chosen stretch."""
        self._put(lambda: self._edit(lambda take: takes.labeled(take, state)))

    def remove(self) -> None:
        """Take labels away from the chosen stretch."""
        self._put(lambda: self._edit(takes.unlabeled))

    def play(self) -> None:
        """Show in the scene how the hand moved, at its own speed."""

        def begin() -> None:
            self._edit(lambda take: take._replace(playing_since_s=time.monotonic()))

        self._put(begin)

    def segment(self, model: str, model_hash: str) -> None:
        """Have the trainer find the parts of the recording that is shown, by a model."""
        self._put(lambda: self._segment(model, model_hash))

    def rename(self, name: str) -> None:
        """Have the recorder call the recording that is shown something else."""
        self._put(lambda: self._change("rename", name))

    def delete(self) -> None:
        """Have the recorder delete the recording that is shown, with what is beside it."""
        self._put(lambda: self._change("delete", ""))

    def note(self, text: str) -> None:
        """Have the recorder write down a note about the recording that is shown."""
        self._put(lambda: self._change("note", text))

    def save(self) -> None:
        """Have the recorder write the labels down."""
        self._put(self._save)

    # --- on the bus' thread -----------------------------------------------------------------------

    def list(self) -> None:
        """Have the recorder tell what recordings there are; what is shown stays as it is."""
        member = self._first("recorder")
        if member is None:
            return

        def come(answers: list[Answer[Outline]]) -> None:
            for answer in answers[:1]:
                self.take = self.take._replace(recordings=answer.body.recordings)

        def none(_: str) -> None:
            self.take = self.take._replace(recordings=())

        self._asking.ask(OUTLINE, member, OutlineQuestion(), come, none, timeout_s=READ_S)

    def _show(self, take: Take) -> None:
        self.take = take

    def _say(self, said: str) -> None:
        self.take = self.take._replace(said=said)

    def _hide(self) -> None:
        # What is still being read is not wanted any more.
        self._asked += 1
        self.take = takes.hidden(self.take)

    def _open(self, name: str) -> None:
        member = self._first("recorder")
        if member is None:
            self._say("no recorder is there: start one")
            return
        self._say("reading …")
        self._asked += 1
        number = self._asked

        def come(answers: list[Answer[Outline]]) -> None:
            if number != self._asked:
                return
            if not answers:
                self._say(f"the recorder gave no answer within {READ_S:g} s")
                return
            try:
                self.take = takes.opened(self.take, answers[0].body)
            except UserError as error:
                self._say(str(error))

        self._asking.ask(
            OUTLINE,
            member,
            OutlineQuestion(recording=name),
            come,
            lambda reason: self._say(f"the recorder refused: {reason}"),
            timeout_s=READ_S,
        )

    def _segment(self, model: str, model_hash: str) -> None:
        member, name = self._first("trainer"), self.take.name
        if not name or member is None:
            self._say("open a recording first" if member else "no trainer is there: start one")
            return
        self._say(f"{model} is looking for the parts …")

        def come(answers: list[Answer[Segmentation]]) -> None:
            if self.take.name != name:
                return
            if not answers:
                self._say(f"the trainer gave no answer within {READ_S:g} s")
                return
            try:
                self.take = with_found(self.take, answers[0].body)
            except UserError as error:
                self._say(str(error))

        self._asking.ask(
            SEGMENT,
            member,
            SegmentQuestion(recording=self.take.path, model=model, model_hash=model_hash),
            come,
            lambda reason: self._say(f"the trainer refused: {reason}"),
            timeout_s=READ_S,
        )

    def _change(self, change: Literal["rename", "delete", "note"], text: str) -> None:
        member, name = self._first("recorder"), self.take.name
        if not name or member is None:
            self._say("open a recording first" if member else "no recorder is there: start one")
            return

        def done(said: str) -> None:
            if change == "note":
                self._show(self.take._replace(note=text, said=said))
                return
            if self.take.name == name:
                self._hide()
            unsaved = {each: labels for each, labels in self.take.unsaved.items() if each != name}
            self._show(self.take._replace(unsaved=unsaved))
            self._say(said)
            self.list()

        self._asking.request(
            member,
            CHANGE_RECORDING,
            ChangeRecording(recording=name, change=change, text=text),
            done,
            self._say,
        )

    def _edit(self, edit: Callable[[Take], Take]) -> None:
        if self.take.name:
            self.take = edit(self.take)
        else:
            self._say("open a recording first")

    def _save(self) -> None:
        member = self._first("recorder")
        if not self.take.name or member is None:
            self._say("open a recording first" if member else "no recorder is there: start one")
            return
        asked = takes.saving(self.take)
        self._say("saving …")
        self._asking.request(
            member,
            SET_LABELS,
            asked,
            lambda said: self._show(takes.saved(self.take, asked, said)),
            self._say,
            timeout_s=READ_S,
        )
