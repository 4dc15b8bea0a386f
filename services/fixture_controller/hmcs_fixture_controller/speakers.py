"""Which processes run a recognizer: nobody is to be assisted by one that is not there."""

from __future__ import annotations

from collections import OrderedDict
from typing import NamedTuple

from hmcs.bus.keys import Member
from hmcs.bus.messages import Source

SCORES_ONLY = "gesteme_classifier"
"""A member of a model that believes nothing by itself."""
REMEMBERED = 64
"""Recognizers of which it is remembered who spoke for them last."""
SPOKE_WITHIN_S = 10.0
"""A process that shows no presence runs its recognizer for so long after a belief."""


class _Spoke(NamedTuple):
    member: Member
    at_s: float
    was_present: bool


class Speakers:
    """Knows by liveliness tokens, and by beliefs, who runs which recognizer."""

    def __init__(self) -> None:
        self._members: dict[str, set[Member]] = {}
        self._present: set[Member] = set()
        self._spoke: OrderedDict[str, _Spoke] = OrderedDict()

    def at_work(self, model: str, member: Member, alive: bool) -> None:
        """Take in that a process works for a model, or does no more."""
        if member.service == SCORES_ONLY:
            return
        members = self._members.setdefault(model, set())
        (members.add if alive else members.discard)(member)
        if not members:
            del self._members[model]

    def present(self, member: Member, alive: bool) -> None:
        """Take in that a process is there, or is no more."""
        (self._present.add if alive else self._present.discard)(member)

    def heard(self, recognizer: str, source: Source, now_s: float) -> None:
        """Take in that a process published a belief of a recognizer."""
        member = Member(source.service, source.instance)
        self._spoke[recognizer] = _Spoke(member, now_s, member in self._present)
        self._spoke.move_to_end(recognizer)
        if len(self._spoke) > REMEMBERED:
            self._spoke.popitem(last=False)

    def living(self, recognizer: str, now_s: float) -> list[str]:
        """Return the instances that run a recognizer, sorted.

        Those are the members of its model, and the one that spoke for it last while it is present:
        a recognizer of somebody's own may show its presence alone, or none at all.
        """
        living = {member.instance for member in self._members.get(recognizer, ())}
        spoke = self._spoke.get(recognizer)
        if spoke is not None and (
            spoke.member in self._present
            if spoke.was_present
            else now_s - spoke.at_s <= SPOKE_WITHIN_S
        ):
            living.add(spoke.member.instance)
        return sorted(living)

    def lost(self, recognizer: str, now_s: float) -> bool:
        """Whether a recognizer that spoke once has no process any more."""
        return recognizer in self._spoke and not self.living(recognizer, now_s)

    def names(self, now_s: float) -> list[str]:
        """Return the recognizers that run, sorted."""
        every = {*self._members, *self._spoke}
        return sorted(name for name in every if self.living(name, now_s))
