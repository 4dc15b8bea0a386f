"""Which recognizers are run by a process that is there."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Set

from hmcs.bus.keys import Member
from hmcs.recognizer_takeover import publishes_beliefs


class Runners:
    """Who works for which model, and who spoke for it last."""

    def __init__(self) -> None:
        self._members: defaultdict[str, set[Member]] = defaultdict(set)
        self._spoke: dict[str, Member] = {}

    def came(self, model: str, member: Member) -> None:
        """Take in that a process works for a model: its token came."""
        self._members[model].add(member)

    def went(self, model: str, member: Member) -> None:
        """Take in that it does no more: its token went."""
        self._members[model].discard(member)
        if not self._members[model]:
            del self._members[model]

    def spoke(self, model: str, member: Member) -> None:
        """Take in that a process published a belief for a model."""
        self._spoke[model] = member

    def forget(self, model: str) -> None:
        """Leave out who spoke for a model."""
        self._spoke.pop(model, None)

    def run(self, model: str, present: Set[Member]) -> bool:
        """Whether somebody who is there publishes beliefs for a model, once the hand moves.

        A process that announced no token for its model counts while it is `present`, if it was the
        last to publish.
        """
        works = any(publishes_beliefs(member) for member in self._members.get(model, ()))
        return works or self._spoke.get(model) in present
