"""What other processes say they do: what the input device hears, and what is being recorded."""

from __future__ import annotations

from collections.abc import Callable

from hmcs.bus.messages import Ask, Description
from hmcs.bus.session import Answer
from hmcs.bus.verbs import DESCRIBE
from hmcs_console.asking import Asking, first_of
from hmcs_console.seeing.seen import Seen

_ANSWER_WITHIN_S = 0.5


class Describing:
    """Asks them now and then; called on the bus' own thread."""

    def __init__(self, asking: Asking, seen: Seen, recorded: Callable[[], None]) -> None:
        """Call `recorded` when there is a new list of recordings to be asked for."""
        self._asking = asking
        self._seen = seen
        self._recorded = recorded

    def ask(self) -> None:
        """Ask once; a process that is not there says nothing."""
        self._ask("input_device", self._on_device)
        self._ask("recorder", self._on_recorder)

    def _ask(self, service: str, then: Callable[[dict[str, str]], None]) -> None:
        member = first_of(service, self._seen.members)
        if member is None:
            then({})
            return

        def come(answers: list[Answer[Description]]) -> None:
            for answer in answers[:1]:
                then(answer.body.facts)

        self._asking.ask(DESCRIBE, member, Ask(), come, timeout_s=_ANSWER_WITHIN_S)

    def _on_device(self, facts: dict[str, str]) -> None:
        self._seen.device = facts.get("source", "")

    def _on_recorder(self, facts: dict[str, str]) -> None:
        before, now = self._seen.recording, facts.get("recording", "")
        self._seen.recording = now
        folder, self._seen.folder = self._seen.folder, facts.get("folder", "")
        if self._seen.folder and (folder != self._seen.folder or (before and before != now)):
            self._recorded()
