"""One process of the stack: started bound to the launcher, logged to a file, ended for certain."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path

from hmcs_local import guard

_LAST_LINES = 12
_KILL_WAIT_S = 5.0


class StackProcess:
    """A running (or ended) service instance.

    It leads a process group of its own, so that Ctrl-C reaches the launcher alone and a signal to
    the group reaches whatever the service started. It dies with the launcher, see `guard`.
    """

    def __init__(
        self,
        service: str,
        instance: str,
        command: Sequence[str],
        environment: Mapping[str, str],
        log_path: Path,
        stop_grace_s: float,
    ) -> None:
        self.service = service
        self.instance = instance
        self.command = tuple(command)
        self.log_path = log_path
        self.stop_grace_s = stop_grace_s
        self.stopping = False
        """True once the launcher has asked it to end: its end is then expected."""
        self.started_s = time.monotonic()
        log_path.parent.mkdir(parents=True, exist_ok=True)
        with log_path.open("ab") as log:
            self._log_begin = log.tell()
            self._read_to = self._log_begin
            self._popen = subprocess.Popen(
                [sys.executable, "-S", "-E", guard.__file__, str(os.getpid()), *command],
                env=dict(environment),
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    @property
    def pid(self) -> int:
        """Process id, and id of its process group."""
        return self._popen.pid

    @property
    def exit_code(self) -> int | None:
        """None while it runs; negative: the signal that ended it."""
        return self._popen.poll()

    @property
    def running(self) -> bool:
        """Whether it has not ended yet."""
        return self.exit_code is None

    def send(self, signal_number: int) -> None:
        """Send a signal to it and whatever it started; nothing where it has ended."""
        if self.running:
            os.killpg(self.pid, signal_number)

    def ask_to_stop(self) -> None:
        """Send SIGTERM; also to one that was stopped with SIGSTOP."""
        self.stopping = True
        self.send(signal.SIGTERM)
        self.send(signal.SIGCONT)

    def wait(self, timeout_s: float) -> int | None:
        """Wait for its end; returns the exit code, or None when it still runs after `timeout_s`."""
        try:
            return self._popen.wait(max(0.0, timeout_s))
        except subprocess.TimeoutExpired:
            return None

    def stop(self) -> int:
        """End it: SIGTERM, and SIGKILL after its grace; returns the exit code."""
        self.ask_to_stop()
        return self.finish(time.monotonic() + self.stop_grace_s)

    def finish(self, deadline_s: float) -> int:
        """Wait until `deadline_s` (monotonic) for its end, then kill it; returns the exit code."""
        if self.wait(deadline_s - time.monotonic()) is None:
            self.kill()
        return self._popen.wait(_KILL_WAIT_S)

    def kill(self) -> None:
        """Send SIGKILL and wait for the end."""
        self.send(signal.SIGKILL)
        self._popen.wait(_KILL_WAIT_S)

    def new_lines(self) -> list[str]:
        """Return whole lines written since the last call; all that is left once it ended."""
        ended = not self.running
        with self.log_path.open("rb") as log:
            log.seek(self._read_to)
            data = log.read()
        whole = len(data) if ended else data.rfind(b"\n") + 1
        self._read_to += whole
        return data[:whole].decode(errors="replace").splitlines()

    def last_lines(self) -> list[str]:
        """Return the last lines it has written, oldest first."""
        with self.log_path.open("rb") as log:
            log.seek(self._log_begin)
            lines = deque(log, maxlen=_LAST_LINES)
        return [line.decode(errors="replace").rstrip("\n") for line in lines]
