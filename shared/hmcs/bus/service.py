"""How a process lives: settings, loop, health, shutdown.

A service is a class and one line, `raise SystemExit(run(TaskFilterService))`. `run` waits for
a router, constructs the service, starts it, answers `health`, `describe` and `settings` for it,
announces its presence, and pumps the bus until SIGTERM or SIGINT.

Only starting can fail for good: a UserError there is a mistake of the user and ends the process
with its message and exit code 2. Once it runs, a handler that raises does not end it: the failure
is logged and counted, the loop goes on, and health says unhealthy until `UNHEALTHY_FOR_S` have
passed without another one.
"""

from __future__ import annotations

import gc
import importlib.metadata
import logging
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from types import FrameType
from typing import Any, ClassVar

from hmcs.bus.answering import LoopHangsError
from hmcs.bus.keys import KeyNameError
from hmcs.bus.logs import RateLimitedLog, open_log
from hmcs.bus.messages import Ask, Description, Health, SettingsReport
from hmcs.bus.rights import rights_of, roles
from hmcs.bus.session import Bus, StoppedError
from hmcs.bus.settings import ServiceSettings, as_yaml, load_settings
from hmcs.bus.verbs import DESCRIBE, HEALTH, SETTINGS
from hmcs.errors import NothingToDoError, UserError

__all__ = ["CannotGoOnError", "Service", "ServiceSettings", "UserError", "run", "serve"]

UNHEALTHY_FOR_S = 10.0
"""How long a failed handler makes a process unhealthy."""
FAILURE_LETTERS = 500
"""How much of a failure health tells: an error may quote whatever somebody sent."""
SWITCH_S = 0.0005
"""How long a thread may keep the interpreter from the others."""
_PUMP_S = 0.5
_RATE_WINDOW_S = 1.0


class CannotGoOnError(Exception):
    """A process has lost what it cannot do without: it ends with code 1, to be started anew."""


class Service:
    """A process of the stack: messages in, one call into the science, messages out."""

    name: ClassVar[str]
    """Kind of process, as in its keys, e.g. `task_hmm`."""
    Settings: ClassVar[type[ServiceSettings]] = ServiceSettings

    def __init__(self, settings: Any, bus: Bus, log: logging.Logger) -> None:
        self.settings = settings
        self.bus = bus
        self.log = log

    def start(self) -> None:
        """Get ready; may ask others. When it returns the process is announced as present."""

    def health(self) -> tuple[bool, str]:
        """Return whether it does what it is for, and one line: what it does or waits for."""
        return True, "running"

    def facts(self) -> dict[str, str]:
        """Return what else is worth knowing about it, for `describe`."""
        return {}

    def close(self) -> None:
        """Let go of what it holds; the bus is still open, and nobody sees it as present."""


def run(service_type: type[Service], argv: Sequence[str] | None = None) -> int:
    """Live as a service of `service_type`; return the exit code.

    0 after SIGTERM, SIGINT, `--help` or `--print-settings`, and where starting found nothing to do;
    1 where starting failed unexpectedly; 2 for a mistake of the user, with one message on stderr.
    """
    try:
        settings, print_only = load_settings(service_type.Settings, service_type.name, argv)
        if print_only:
            sys.stdout.write(as_yaml(settings))
            return 0
        log = open_log(f"{service_type.name}/{settings.instance}", settings.log_level, sys.stderr)
        # What libraries have loaded stays. Looking through all of it for garbage holds up every
        # thread at once, up to 0.2 s on a busy machine: a robot would stop for it.
        gc.freeze()
        # What runs beside the loop gives way to it soon: the usual 5 ms at every turn add up.
        sys.setswitchinterval(SWITCH_S)
        with _stop_on_signals() as stop:
            return _run(service_type, settings, log, stop)
    except (UserError, KeyNameError) as error:
        sys.stderr.write(f"{service_type.name}: {error}\n")
        return 2
    except SystemExit as after_help:
        return int(after_help.code or 0)


def serve(
    service_type: type[Service],
    settings: ServiceSettings,
    bus: Bus,
    log: logging.Logger,
    stopping: Callable[[], bool],
) -> None:
    """Live as a service on an open bus until `stopping` (after it turns true, wake the bus)."""
    name = service_type.name
    if name in roles():
        bus.rights = rights_of(name, bus.keys, bus.source.instance)
    service = service_type(settings, bus, log)
    life = _Life(service)
    try:
        service.start()
        life.answer_questions()
        presence = bus.announce(bus.keys.presence(service.name, bus.source.instance))
        log.info("ready")
        try:
            while not stopping():
                life.pump()
        finally:
            presence.withdraw()
    except StoppedError:
        pass
    finally:
        life.close()
        service.close()


class Stop:
    """The request that a process ends: made once, from a signal handler or another thread."""

    def __init__(self) -> None:
        self._set = False
        self._wake: Callable[[], None] = lambda: None

    def __call__(self) -> bool:
        """Return whether it was made."""
        return self._set

    def set(self) -> None:
        """Request the stop and wake the bus."""
        self._set = True
        self._wake()

    def wakes(self, bus: Bus) -> None:
        """Wake `bus` with the request."""
        self._wake = bus.wake


def _run(
    service_type: type[Service], settings: ServiceSettings, log: logging.Logger, stop: Stop
) -> int:
    try:
        with Bus.open(
            settings.bus, service_type.name, settings.instance, log=log, stopping=stop
        ) as bus:
            stop.wakes(bus)
            serve(service_type, settings, bus, log, stop)
    except StoppedError:
        pass
    except NothingToDoError as reason:
        log.info("nothing to do", extra={"reason": str(reason)})
    except (UserError, KeyNameError):
        raise
    except Exception:
        log.exception("ended by an unexpected error")
        return 1
    log.info("stopped")
    return 0


class _Life:
    """A service in its loop: what its health is made of."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._bus = service.bus
        self._limited = RateLimitedLog(service.log)
        self._beside = ThreadPoolExecutor(2, thread_name_prefix="health")
        self._began_s = time.monotonic()
        self._failures = 0
        self._failed_s = -float("inf")
        self._failure = ""
        self._rate_hz = 0.0
        self._counted = (self._began_s, 0)

    def answer_questions(self) -> None:
        """Answer what every service answers."""
        self._bus.every(_RATE_WINDOW_S, self._measure_rate)
        HEALTH.answer(self._bus, self._health, aside=self._beside)
        DESCRIBE.answer(self._bus, self._describe)
        SETTINGS.answer(self._bus, self._settings)

    def pump(self) -> None:
        """Handle what is pending; outlive a handler that fails."""
        try:
            self._bus.pump(_PUMP_S)
        except (StoppedError, CannotGoOnError):
            raise
        except Exception as error:
            self._failures += 1
            self._failed_s = time.monotonic()
            self._failure = f"{type(error).__name__}: {error}"[:FAILURE_LETTERS]
            self._limited.warning(
                type(error).__name__,
                "a handler failed: going on",
                exc_info=not isinstance(error, UserError),
                reason=self._failure,
                failures=self._failures,
            )

    def close(self) -> None:
        """Answer no more."""
        self._beside.shutdown(wait=False, cancel_futures=True)

    def _measure_rate(self) -> None:
        then_s, then = self._counted
        now_s, now = time.monotonic(), self._bus.counters.handled
        self._rate_hz = (now - then) / (now_s - then_s)
        self._counted = (now_s, now)

    def _health(self, _: Ask) -> Health:
        # Beside the loop, so that one that hangs is reported as well.
        try:
            healthy, detail = self._bus.in_loop(self._service.health)
        except LoopHangsError as error:
            healthy, detail = False, str(error)
        now_s = time.monotonic()
        if now_s - self._failed_s < UNHEALTHY_FOR_S:
            healthy = False
            detail = f"a handler failed ({self._failures} in all), see the log: {self._failure}"
        counters = self._bus.counters
        return Health(
            healthy=healthy,
            detail=detail,
            uptime_s=now_s - self._began_s,
            loop_rate_hz=self._rate_hz,
            cpu_s=time.process_time(),
            received=dict(counters.received),
            sent=dict(counters.sent),
            lost=dict(counters.lost),
            refused=dict(counters.refused),
            late=dict(counters.late),
        )

    def _describe(self, _: Ask) -> Description:
        bus = self._bus
        return Description(
            version=importlib.metadata.version("hmcs"),
            publishes=tuple(bus.publishes),
            subscribes=tuple(bus.subscribes),
            answers=tuple(bus.answers),
            facts=self._service.facts(),
        )

    def _settings(self, _: Ask) -> SettingsReport:
        return SettingsReport(settings=self._service.settings.model_dump(mode="json"))


@contextmanager
def _stop_on_signals() -> Iterator[Stop]:
    stop = Stop()

    def on_signal(_number: int, _frame: FrameType | None) -> None:
        stop.set()

    if threading.current_thread() is not threading.main_thread():
        yield stop
        return
    before = {name: signal.signal(name, on_signal) for name in (signal.SIGTERM, signal.SIGINT)}
    try:
        yield stop
    finally:
        for name, handler in before.items():
            signal.signal(name, handler)
