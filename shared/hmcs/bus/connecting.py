"""Waiting for a router, and saying so."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable

import zenoh

from hmcs.bus.config import BusSettings, client_config
from hmcs.errors import UserError

_ATTEMPT_MS = 200
_SAY_AFTER_S = 0.5
_SAY_EVERY_S = 3.0
_LOOK_EVERY_S = 0.05
_ADVICE = "start one with `hmcs router`, or name another with --router or HMCS_ROUTER"


class BusUnavailableError(UserError):
    """No router answered within the time set for it."""


class StoppedError(Exception):
    """The process was told to stop while it waited for something on the bus."""


def connect(
    settings: BusSettings, log: logging.Logger, stopping: Callable[[], bool]
) -> zenoh.Session:
    """Return a session with the router, once there is one; says every few seconds that it waits.

    Raises StoppedError once `stopping` is true, and BusUnavailableError after
    `settings.connect_timeout_s` where that is set.
    """
    began_s = time.monotonic()
    say_s = began_s + _SAY_AFTER_S
    limit_s = settings.connect_timeout_s
    while not stopping():
        try:
            return zenoh.open(client_config(settings, _ATTEMPT_MS))
        except zenoh.ZError as error:
            reason = str(error).split(" at /")[0]
        now_s = time.monotonic()
        if limit_s is not None and now_s - began_s >= limit_s:
            raise BusUnavailableError(
                f"no router at {settings.router} within {limit_s:g} s: {_ADVICE} ({reason})"
            )
        if now_s >= say_s:
            say_s = now_s + _SAY_EVERY_S
            log.warning(
                f"waiting for a router: {_ADVICE}",
                extra={"router": settings.router, "waited_s": round(now_s - began_s, 1)},
            )
        time.sleep(_LOOK_EVERY_S)
    raise StoppedError
