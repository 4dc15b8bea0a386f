"""`hmcs up`: keeps a stack running and reports what happens in it, until it is stopped."""

from __future__ import annotations

import contextlib
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from hmcs_local.control import ControlServer
from hmcs_local.interrupts import interruptible
from hmcs_local.log_lines import readable
from hmcs_local.processes import StackProcess
from hmcs_local.stack import LocalStack

USER_MISTAKE = 2
"""Exit code of a service that was given wrong settings: starting it again would not help."""

_LOOK_EVERY_S = 0.1
_FIRST_DELAY_S = 0.1
_LONGEST_DELAY_S = 10.0
_STEADY_AFTER_S = 10.0
_MOST_DOUBLINGS = 16


class Launcher:
    """Looks after a stack: passes its logs on, reports unexpected ends, restarts as compose would.

    `say` gets one line at a time: who speaks (an instance, or `hmcs`) and what. Whatever goes wrong
    with one process, or with saying it, the others are looked after.
    """

    def __init__(
        self,
        stack: LocalStack,
        say: Callable[[str, str], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._stack = stack
        self._say = say
        self._clock = clock
        self._ended: dict[str, StackProcess] = {}
        """By instance, the last one whose end was reported."""
        self._restarts: dict[str, int] = {}
        self._due_s: dict[str, float] = {}
        self._troubles: dict[str, str] = {}
        """What went wrong last with each instance: it is said once."""

    def run(self, control: ControlServer) -> int:
        """Look after the stack until nothing of it runs any more; returns an exit code.

        0 where every process ended by itself with 0. Leaves by KeyboardInterrupt on Ctrl-C.
        """
        while True:
            self.look()
            processes = self._stack.processes.values()
            if not self._due_s and not any(process.running for process in processes):
                self.say("hmcs", "nothing runs any more")
                return int(any(process.exit_code for process in processes))
            control.serve(_LOOK_EVERY_S)

    def look(self) -> None:
        """Do what is to be done now."""
        self.pass_logs_on()
        for instance, process in list(self._stack.processes.items()):
            with self._said_if_wrong(instance, "looking after it"):
                self._judge(process)
        for instance, due_s in list(self._due_s.items()):
            if self._clock() >= due_s:
                del self._due_s[instance]
                self._start_again(instance)

    def pass_logs_on(self) -> None:
        """Say every new line of every process, as far as lines come no faster than can be read."""
        for process in list(self._stack.processes.values()):
            with self._said_if_wrong(process.instance, "reading its log"):
                for line in process.new_lines():
                    self.say(process.instance, readable(line))
                if process.bound_log():
                    self.say("hmcs", f"{process.instance} writes much: its log is begun anew")

    def say(self, who: str, what: str) -> None:
        """Print a line; a stack that moves a robot goes on where it cannot be printed."""
        with contextlib.suppress(OSError, ValueError):
            self._say(who, what)

    def _judge(self, process: StackProcess) -> None:
        code = process.exit_code
        if code is None or self._ended.get(process.instance) is process:
            return
        self.pass_logs_on()
        if process.stopping:
            self.say("hmcs", f"{process.instance} stopped ({_ending(code)})")
        else:
            delay_s = self._restart_delay_s(process, code)
            fate = "not started again" if delay_s is None else f"starting again in {delay_s:.1f} s"
            lines = [line for line in process.last_lines() if line.strip()]
            said = f"; its last words: {readable(lines[-1])}" if lines else ""
            self.say("hmcs", f"{process.instance} ended ({_ending(code)}), {fate}{said}")
            if delay_s is not None:
                self._due_s[process.instance] = self._clock() + delay_s
        self._ended[process.instance] = process

    def _start_again(self, instance: str) -> None:
        if self._stack.processes[instance].stopping:  # stopped by its user meanwhile
            return
        try:
            self._stack.restart(instance)
        except Exception as error:
            delay_s = self._back_off_s(instance)
            self._due_s[instance] = self._clock() + delay_s
            self.say(
                "hmcs", f"{instance} cannot be started: {error}; trying again in {delay_s:.1f} s"
            )
        else:
            self.say("hmcs", f"{instance} started again")

    def _restart_delay_s(self, process: StackProcess, code: int) -> float | None:
        restart = self._stack.spec.service(process.service).restart
        if restart == "no" or code == USER_MISTAKE or (restart == "on-failure" and code == 0):
            return None
        if self._clock() - process.started_s > _STEADY_AFTER_S:
            self._restarts.pop(process.instance, None)
        return self._back_off_s(process.instance)

    def _back_off_s(self, instance: str) -> float:
        """How long to wait before the next start, longer each time."""
        count = self._restarts.get(instance, 0)
        self._restarts[instance] = min(count + 1, _MOST_DOUBLINGS)
        return float(min(_FIRST_DELAY_S * 2**count, _LONGEST_DELAY_S))

    @contextmanager
    def _said_if_wrong(self, instance: str, doing: str) -> Iterator[None]:
        try:
            yield
        except Exception as error:
            trouble = f"{doing} failed: {type(error).__name__}: {error}"
            if self._troubles.get(instance) != trouble:
                self._troubles[instance] = trouble
                self.say("hmcs", f"{instance}: {trouble}; going on")


def _ending(code: int) -> str:
    if code >= 0:
        return f"exit code {code}"
    try:
        return f"killed by {signal.Signals(-code).name}"
    except ValueError:  # a real-time signal has a number alone
        return f"killed by signal {-code}"


def run_up(
    make_stack: Callable[[Callable[[], None]], LocalStack], say: Callable[[str, str], None]
) -> int:
    """Bring the stack up and look after it until Ctrl-C or SIGTERM (0) or its own end.

    `make_stack` is given what is to be called while one-shots run.
    """
    launchers: list[Launcher] = []
    with interruptible():
        stack = make_stack(lambda: launchers[0].pass_logs_on())
        launcher = Launcher(stack, say)
        launchers.append(launcher)
        try:
            with ControlServer(stack) as control, stack:
                launcher.say("hmcs", _greeting(stack))
                return launcher.run(control)
        except KeyboardInterrupt:
            launcher.pass_logs_on()
            launcher.say("hmcs", "stopped")
            return 0


def _greeting(stack: LocalStack) -> str:
    return (
        f"{len(stack.processes)} processes run, router at {stack.router}, logs in "
        f"{stack.folder / 'logs'}; Ctrl-C ends them all, `hmcs status` shows them"
    )
