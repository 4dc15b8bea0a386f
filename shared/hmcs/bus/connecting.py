"""Waiting for a router, and saying so."""

from __future__ import annotations

import atexit
import logging
import threading
import time
from collections.abc import Callable

import zenoh

from hmcs.bus.config import OPENING_MS, BusSettings, client_config
from hmcs.errors import UserError

_SAY_AFTER_S = 0.5
_SAY_EVERY_S = 3.0
_LOOK_EVERY_S = 0.05
_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.05, 0.25
_ATTEMPT_S = OPENING_MS / 1000 + 1.0
"""After so long another attempt is made beside one that has not ended. Where packets are lost
without a word, as those to a host that is coming up, the kernel asks for a connection ever more
seldom, for two minutes."""
_ENDING_S = 1.0
"""How long the interpreter may take to end; no attempt may end within that time."""
_ADVICE = "start one with `hmcs router`, or name another with --router or HMCS_ROUTER"


class BusUnavailableError(UserError):
    """No router answered within the time set for it."""


class StoppedError(Exception):
    """The process was stopped while it waited for something on the bus."""


def connect(
    settings: BusSettings, log: logging.Logger, stopping: Callable[[], bool]
) -> zenoh.Session:
    """Return a session with the router, once there is one; says every few seconds that it waits.

    An attempt may take as long as a far router needs, and is given up for another where it takes
    longer; stopping does not wait for it.
    Raises StoppedError once `stopping` is true, and BusUnavailableError after
    `settings.connect_timeout_s` where that is set.
    """
    waiting = _Waiting(settings, log, stopping)
    pause_s = _FIRST_PAUSE_S
    while True:
        attempt, reason = _Attempt(settings), "it does not answer"
        try:
            while not attempt.overdue:
                if attempt.ended(_LOOK_EVERY_S):
                    return attempt.session()
                waiting.go_on(reason)
        except zenoh.ZError as error:
            reason = str(error).split(" at /")[0]
        finally:
            attempt.give_up()
        again_s = time.monotonic() + pause_s
        pause_s = min(2 * pause_s, _LONGEST_PAUSE_S)
        while time.monotonic() < again_s:
            waiting.go_on(reason)
            time.sleep(_LOOK_EVERY_S)


class _Waiting:
    """How long a router has been waited for, and what is to be said of it."""

    def __init__(
        self, settings: BusSettings, log: logging.Logger, stopping: Callable[[], bool]
    ) -> None:
        self._settings, self._log, self._stopping = settings, log, stopping
        self._began_s = time.monotonic()
        self._say_s = self._began_s + _SAY_AFTER_S

    def go_on(self, reason: str) -> None:
        """Return while there is time to wait; `reason` says why there is no session yet.

        Raises StoppedError and BusUnavailableError as `connect` does.
        """
        if self._stopping():
            raise StoppedError
        now_s, limit_s = time.monotonic(), self._settings.connect_timeout_s
        if limit_s is not None and now_s - self._began_s >= limit_s:
            raise BusUnavailableError(
                f"no router at {self._settings.router} within {limit_s:g} s: {_ADVICE} ({reason})"
            )
        if now_s >= self._say_s:
            self._say_s = now_s + _SAY_EVERY_S
            self._log.warning(
                f"waiting for a router: {_ADVICE}",
                extra={
                    "router": self._settings.router,
                    "waited_s": round(now_s - self._began_s, 1),
                    "reason": reason,
                },
            )


class _Attempt:
    """One attempt to open a session, on a thread of its own: Zenoh cannot cancel it."""

    def __init__(self, settings: BusSettings) -> None:
        self._settings = settings
        self._began_s = time.monotonic()
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._session: zenoh.Session | None = None
        self._error: BaseException | None = None
        self._given_up = False
        self._thread = threading.Thread(target=self._open, name="connecting", daemon=True)
        self._thread.start()

    def ended(self, timeout_s: float) -> bool:
        """Wait at most so long; return whether it has come to an end."""
        return self._ended.wait(timeout_s)

    @property
    def overdue(self) -> bool:
        """Whether it was begun longer ago than a far router needs."""
        return time.monotonic() - self._began_s > _ATTEMPT_S

    def session(self) -> zenoh.Session:
        """Return the session of an attempt that has ended, the caller's own from now on.

        Raises what kept it from being opened, a ZError as a rule.
        """
        if self._error is not None:
            raise self._error
        assert self._session is not None
        session, self._session = self._session, None
        return session

    def give_up(self) -> None:
        """Close the session that nobody has taken, now or when it opens."""
        with self._lock:
            self._given_up = True
            session, self._session = self._session, None
            if not self._ended.is_set():
                atexit.register(self._end_before_exit)
        if session is not None:
            session.close()  # type: ignore[no-untyped-call]

    def _open(self) -> None:
        try:
            session = zenoh.open(client_config(self._settings))
        except BaseException as error:  # of whatever kind, it is for who waits
            self._error = error
            session = None
        with self._lock:
            if not self._given_up:
                self._session, session = session, None
        if session is not None:
            session.close()  # type: ignore[no-untyped-call]
        with self._lock:
            self._ended.set()
            # A process may wait for its router for days: what has ended is not kept until it exits.
            atexit.unregister(self._end_before_exit)

    def _end_before_exit(self) -> None:
        # A thread that comes back from Zenoh while the interpreter ends aborts the process. One
        # that is long overdue may come back at any time, and waiting for many would add up.
        left_s = self._began_s + OPENING_MS / 1000 - time.monotonic()
        if abs(left_s) < _ENDING_S:
            self._thread.join(max(0.0, left_s) + _ENDING_S)
