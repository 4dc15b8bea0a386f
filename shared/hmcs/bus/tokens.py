"""Liveliness tokens: one that this process shows, and those of others as they come and go."""

from __future__ import annotations

from collections.abc import Callable

import zenoh

from hmcs.bus.counters import Counters
from hmcs.bus.keys import Keys
from hmcs.bus.logs import RateLimitedLog
from hmcs.bus.presence import is_token

TOKENS_BOUND = 4096
"""Tokens that one watch follows: a cell has a few dozen processes, each with a handful."""


class Token:
    """A liveliness token: others see its key until it is withdrawn or this process is gone."""

    def __init__(self, token: zenoh.LivelinessToken) -> None:
        self._token: zenoh.LivelinessToken | None = token

    def withdraw(self) -> None:
        """Take it back; a second time does nothing."""
        if self._token is not None:
            self._token.undeclare()  # type: ignore[no-untyped-call]
            self._token = None


class TokenWatch:
    """Follows the tokens of others, and calls `handler` with each one that comes or goes."""

    def __init__(
        self,
        keys: Keys,
        handler: Callable[[str, bool], None],
        counters: Counters,
        log: RateLimitedLog,
    ) -> None:
        self._keys = keys
        self._handler = handler
        self._counters = counters
        self._log = log
        self._living: set[str] = set()

    def change(self, token: str, alive: bool) -> None:
        """Take in that a token is there (True) or gone (False); it may be known already."""
        if alive == (token in self._living):
            return
        if not is_token(self._keys, token):
            refuse_token(token, self._counters, self._log)
            return
        if alive and len(self._living) >= TOKENS_BOUND:
            self._log.warning("tokens", "too many tokens: one more is left out", token=token)
            return
        (self._living.add if alive else self._living.discard)(token)
        self._handler(token, alive)


def refuse_token(token: str, counters: Counters, log: RateLimitedLog) -> None:
    """Count and log a token with an impossible name."""
    counters.count_refused("presence", token)
    log.warning("token", "presence under an impossible name: refused", token=token)
