"""`hmcs up`: keeps a stack running and tells what happens in it, until it is told to stop."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from hmcs_local.control import ControlServer
from hmcs_local.log_lines import readable
from hmcs_local.processes import StackProcess
from hmcs_local.stack import LocalStack

USER_MISTAKE = 2
"""Exit code of a service that was given wrong settings: starting it again would not help."""

_LOOK_EVERY_S = 0.1
_FIRST_DELAY_S = 0.1
_LONGEST_DELAY_S = 10.0
_STEADY_AFTER_S = 10.0


class Launcher:
    """Looks after a stack: passes its logs on, tells unexpected ends, restarts as compose would.

    `say` gets one line at a time: who speaks (an instance, or `hmcs`) and what.
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
        self._told: set[int] = set()
        self._restarts: dict[str, int] = {}
        self._due_s: dict[str, float] = {}

    def run(self, control: ControlServer) -> int:
        """Look after the stack until nothing of it runs any more; returns an exit code.

        0 where every process ended by itself with 0. Leaves by KeyboardInterrupt on Ctrl-C.
        """
        while True:
            self.look()
            processes = self._stack.processes.values()
            if not self._due_s and not any(process.running for process in processes):
                self._say("hmcs", "nothing runs any more")
                return int(any(process.exit_code for process in processes))
            control.serve(_LOOK_EVERY_S)

    def look(self) -> None:
        """Do what is to be done now."""
        self.pass_logs_on()
        for process in list(self._stack.processes.values()):
            code = process.exit_code
            if code is not None and process.pid not in self._told:
                self._told.add(process.pid)
                self.pass_logs_on()
                self._tell_end(process, code)
        for instance, due_s in list(self._due_s.items()):
            if self._clock() >= due_s:
                del self._due_s[instance]
                self._stack.restart(instance)
                self._say("hmcs", f"{instance} started again")

    def pass_logs_on(self) -> None:
        """Say every new line of every process."""
        for process in self._stack.processes.values():
            for line in process.new_lines():
                self._say(process.instance, readable(line))

    def _tell_end(self, process: StackProcess, code: int) -> None:
        if process.stopping:
            self._say("hmcs", f"{process.instance} stopped ({_ending(code)})")
            return
        delay_s = self._restart_delay_s(process, code)
        fate = "not started again" if delay_s is None else f"starting again in {delay_s:.1f} s"
        lines = [line for line in process.last_lines() if line.strip()]
        said = f"; its last words: {readable(lines[-1])}" if lines else ""
        self._say("hmcs", f"{process.instance} ended ({_ending(code)}), {fate}{said}")
        if delay_s is not None:
            self._due_s[process.instance] = self._clock() + delay_s

    def _restart_delay_s(self, process: StackProcess, code: int) -> float | None:
        restart = self._stack.spec.service(process.service).restart
        if restart == "no" or code == USER_MISTAKE or (restart == "on-failure" and code == 0):
            return None
        if self._clock() - process.started_s > _STEADY_AFTER_S:
            self._restarts.pop(process.instance, None)
        count = self._restarts.get(process.instance, 0)
        self._restarts[process.instance] = count + 1
        return float(min(_FIRST_DELAY_S * 2**count, _LONGEST_DELAY_S))


def _ending(code: int) -> str:
    return f"exit code {code}" if code >= 0 else f"killed by {signal.Signals(-code).name}"


@contextmanager
def interruptible() -> Iterator[None]:
    """Turn SIGTERM and SIGHUP into KeyboardInterrupt, as Ctrl-C does; a second one changes nothing.

    Whoever stops the stack is not to be stopped half-way: its end is bounded by the graces.
    """

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        for each in numbers:
            signal.signal(each, signal.SIG_IGN)
        raise KeyboardInterrupt

    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = {number: signal.signal(number, interrupt) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def run_up(
    make_stack: Callable[[Callable[[], None]], LocalStack], say: Callable[[str, str], None]
) -> int:
    """Bring the stack up and look after it until Ctrl-C or SIGTERM (0) or its own end.

    `make_stack` is given what is to be called while one-shots run.
    """
    launchers: list[Launcher] = []
    with interruptible():
        stack = make_stack(lambda: launchers[0].pass_logs_on())
        launchers.append(Launcher(stack, say))
        try:
            with ControlServer(stack) as control, stack:
                say("hmcs", _greeting(stack))
                return launchers[0].run(control)
        except KeyboardInterrupt:
            launchers[0].pass_logs_on()
            say("hmcs", "stopped")
            return 0


def _greeting(stack: LocalStack) -> str:
    return (
        f"{len(stack.processes)} processes run, router at {stack.router}, logs in "
        f"{stack.folder / 'logs'}; Ctrl-C ends them all, `hmcs status` shows them"
    )
