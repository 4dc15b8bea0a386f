"""Starting stages, each a process, and ending them all."""

from __future__ import annotations

import subprocess
import sys
from types import TracebackType
from typing import Self

from support.stack import clean_environment


class Stages:
    """Stages on raw sockets, ended with the `with`."""

    def __init__(self) -> None:
        self._processes: list[subprocess.Popen[str]] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        for process in self._processes:
            process.kill()
            process.communicate()

    def start(self, stage: str, to: int, *flags: object) -> subprocess.Popen[str]:
        """Start a stage that sends to port `to`."""
        process = subprocess.Popen(
            [sys.executable, "-m", "bench.stages", stage, "--to", str(to), *map(str, flags)],
            stdout=subprocess.PIPE,
            text=True,
            env=clean_environment(),
        )
        self._processes.append(process)
        return process

    def listening(self, stage: str, to: int, *flags: object) -> int:
        """Start a stage and return the port it listens on."""
        process = self.start(stage, to, *flags)
        assert process.stdout is not None
        return int(process.stdout.readline())
