"""One process of the stack: started bound to the launcher, logged to a file, ended for certain."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from hmcs_local import guard

LARGEST_LOG_BYTES = 32 * 2**20
"""A log that has grown beyond this becomes `NAME.log.1`, in place of an older one."""
SHOWN_AT_ONCE_BYTES = 16 * 2**10
"""Of what was written between two calls of `new_lines`, only the end is returned if it is more."""
_LAST_LINES, _LAST_BYTES = 12, 64 * 2**10
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
            # Between the look and the signal it may end, or become another user's.
            with contextlib.suppress(ProcessLookupError, PermissionError):
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
        code = self.exit_code
        # One that hangs within the kernel ends once that lets go of it, not now.
        return -signal.SIGKILL if code is None else code

    def kill(self) -> None:
        """Send SIGKILL and wait for the end, some seconds at most."""
        self.send(signal.SIGKILL)
        self.wait(_KILL_WAIT_S)

    def new_lines(self) -> list[str]:
        """Return whole lines written since the last call; all that is left once it ended.

        Of more than `SHOWN_AT_ONCE_BYTES` only the end comes, after a line that says so. A log that
        somebody has removed has no lines.
        """
        ended = not self.running
        with contextlib.suppress(FileNotFoundError), self.log_path.open("rb") as log:
            size = log.seek(0, os.SEEK_END)
            if size < self._read_to:  # cut by somebody
                self._read_to = self._log_begin = 0
            left_out = max(0, size - self._read_to - SHOWN_AT_ONCE_BYTES)
            log.seek(self._read_to + left_out)
            data = log.read(SHOWN_AT_ONCE_BYTES)
            first = data.find(b"\n") + 1 if left_out else 0
            whole = len(data) if ended else data.rfind(b"\n") + 1
            if whole == 0 and len(data) == SHOWN_AT_ONCE_BYTES:  # a line that never ends
                whole = len(data)
            self._read_to += left_out + whole
            lines = data[first:whole].decode(errors="replace").splitlines()
            if left_out:
                lines.insert(
                    0, f"… {left_out + first} bytes are left out here, see {self.log_path}"
                )
            return lines
        return []

    def last_lines(self) -> list[str]:
        """Return the last lines it has written, oldest first."""
        with contextlib.suppress(FileNotFoundError), self.log_path.open("rb") as log:
            size = log.seek(0, os.SEEK_END)
            log.seek(min(size, max(self._log_begin, size - _LAST_BYTES)))
            lines = log.read().decode(errors="replace").splitlines()
            return lines[-_LAST_LINES:]
        return []

    def bound_log(self) -> bool:
        """Begin the log anew where it has grown too large; returns whether it had.

        What it held stands in `NAME.log.1` then; a line written at that very moment may be lost.
        """
        with contextlib.suppress(FileNotFoundError):
            if self.log_path.stat().st_size <= LARGEST_LOG_BYTES:
                return False
            # The process holds the file itself: it can be emptied, not replaced.
            shutil.copyfile(self.log_path, self.log_path.with_name(f"{self.log_path.name}.1"))
            os.truncate(self.log_path, 0)
            self._read_to = self._log_begin = 0
            return True
        return False
