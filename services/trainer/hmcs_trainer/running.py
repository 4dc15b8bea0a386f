"""A training in a process of its own, and what that process says about it."""

from __future__ import annotations

import json
import logging
import math
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import IO

from hmcs_trainer.asked import Job

_JUDGING = "judging"
_LEARNED_SHARE = 0.5
"""Of the whole, where learning has ended and judging begins."""
LONGEST_DETAIL = 2_000
"""Characters of one published sentence."""
_COMMAND = (sys.executable, "-m", "hmcs_trainer.job")
_KILLED_WAIT_S = 10.0


class RunningJob:
    """A process that trains."""

    def __init__(self, job: Job, longest_s: float, log: logging.Logger) -> None:
        """Start it; raises OSError where no process can be started."""
        self.job = job
        self.stage = "learning"
        self.detail = ""
        self.share = 0.0
        self._error = ""
        self._log = log
        self._ends_s = time.monotonic() + longest_s
        self._longest_s = longest_s
        self._lines: SimpleQueue[str] = SimpleQueue()
        self._process = subprocess.Popen(
            _COMMAND,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            errors="replace",
        )
        stdin, stdout, stderr = self._process.stdin, self._process.stdout, self._process.stderr
        assert stdin is not None
        assert stdout is not None
        assert stderr is not None
        self._threads = [
            threading.Thread(target=_write, args=(stdin, job.model_dump_json())),
            threading.Thread(target=_read, args=(stdout, self._lines.put)),
            threading.Thread(target=_read, args=(stderr, self._note)),
        ]
        for thread in self._threads:
            thread.start()

    def news(self) -> list[str]:
        """Return what was said since the last time, and give it up once it takes too long."""
        said: list[str] = []
        while (fields := self._next()) is not None:
            if "error" in fields:
                self._error = _shortened(fields["error"])
            elif "detail" in fields:
                self.detail = _shortened(fields["detail"])
                if self.detail == _JUDGING:
                    self.stage, self.share = _JUDGING, _LEARNED_SHARE
                said.append(self.detail)
            elif self.stage == _JUDGING and fields.get("count"):
                done = float(fields["done"]) / float(fields["count"])
                done = min(max(done, 0.0), 1.0) if math.isfinite(done) else 0.0
                self.share = _LEARNED_SHARE + (1.0 - _LEARNED_SHARE) * done
                said.append(self.detail)
        if self._process.poll() is None and time.monotonic() > self._ends_s:
            self._error = f"given up: it took longer than {self._longest_s:g} s"
            self._process.kill()
        return said

    def ended(self) -> int | None:
        """Return the exit code once everything it said was read; None before."""
        code = self._process.poll()
        if code is None or any(thread.is_alive() for thread in self._threads):
            return None
        self.news()
        return code

    def error(self) -> str:
        """Return what was wrong, in one line."""
        code = self._process.returncode
        return self._error or (
            f"the process of the training ended with {code}: the trainer's log says why"
        )

    def cancel(self, grace_s: float) -> None:
        """End it."""
        self._process.terminate()
        try:
            self._process.wait(grace_s)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait(_KILLED_WAIT_S)
        for thread in self._threads:
            thread.join()

    def _next(self) -> dict[str, str] | None:
        while True:
            try:
                line = self._lines.get_nowait()
            except Empty:
                return None
            try:
                said = json.loads(line)
            except ValueError:
                said = None
            if isinstance(said, dict):
                return said
            # A library that prints something.
            self._note(line)

    def _note(self, line: str) -> None:
        if line.strip():
            self._log.info("of the training", extra={"model": self.job.name, "said": line})


def _shortened(text: object) -> str:
    one_line = " ".join(str(text).split())
    return one_line if len(one_line) <= LONGEST_DETAIL else f"{one_line[: LONGEST_DETAIL - 1]}…"


def _write(stream: IO[str], text: str) -> None:
    try:
        with stream:
            stream.write(text)
    except OSError:
        # It has ended already, and its exit code says how.
        return


def _read(stream: IO[str], take: Callable[[str], None]) -> None:
    with stream:
        for line in stream:
            take(line.rstrip("\n"))
