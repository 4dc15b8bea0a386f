"""Who is there, and who works for which model, by the tokens they show.

The bus refuses and counts tokens of what is no name. But anybody may show any number of names.
"""

from __future__ import annotations

import logging
from collections.abc import Callable

from hmcs.bus.keys import ANY, Member
from hmcs.bus.logs import RateLimitedLog
from hmcs.bus.session import Bus
from hmcs_console.seeing.seen import Seen

REFUSED = "presence"
"""As what a token that is refused is counted."""
MOST_TOKENS = 256
"""Of either kind; of more than those only a fault or an attacker has need."""


class Presence:
    """Follows the tokens of all processes; all of it on the thread that pumps the bus."""

    def __init__(
        self, bus: Bus, seen: Seen, log: logging.Logger, came: Callable[[Member], None]
    ) -> None:
        """Begin to follow them; `came` is called with each process that comes, but of this one."""
        self._bus = bus
        self._seen = seen
        self._limited = RateLimitedLog(log)
        self._came = came
        self._working: set[tuple[str, Member]] = set()
        """Models, each with a process that works for it."""
        bus.watch(bus.keys.presence(ANY, ANY), self._on_presence)
        bus.watch(bus.keys.member(ANY), self._on_member)

    def _on_presence(self, key: str, alive: bool) -> None:
        member, members = self._bus.keys.member_of(key), self._seen.members
        if member == (self._bus.source.service, self._bus.source.instance):
            return
        if not alive:
            members.discard(member)
            self._seen.health.pop(member, None)
        elif len(members) >= MOST_TOKENS:
            self._refuse(key, f"{MOST_TOKENS} processes are there already")
        else:
            members.add(member)
            self._came(member)

    def _on_member(self, key: str, alive: bool) -> None:
        model, member = self._bus.keys.model_of(key), self._bus.keys.member_of(key)
        if not alive:
            if (model, member) in self._working:
                self._working.discard((model, member))
                self._seen.runners.went(model, member)
        elif len(self._working) >= MOST_TOKENS:
            self._refuse(key, f"{MOST_TOKENS} processes work for a model already")
        else:
            self._working.add((model, member))
            self._seen.runners.came(model, member)

    def _refuse(self, key: str, reason: str) -> None:
        self._bus.counters.count_refused(REFUSED, reason)
        self._limited.warning(REFUSED, "presence refused", key=key, reason=reason)
