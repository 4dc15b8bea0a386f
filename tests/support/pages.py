"""Pages of the documents followed as they stand, in an empty folder."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from support.stack import CELL, clean_environment

ROOT = Path(__file__).parents[2]
WITHIN_S = 180.0


def blocks(page: str, language: str) -> list[str]:
    """Return the blocks of a language in a page, named from the root of the repository."""
    text = (ROOT / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def lines_of(page: str) -> list[list[str]]:
    """Return the commands in its shell blocks, block by block."""
    return [
        [line for line in block.replace("\\\n", " ").splitlines() if line.strip()]
        for block in blocks(page, "sh")
    ]


class Reader:
    """Somebody who types what a page says, in a folder where everything is done.

    What is started ends with the `with`.
    """

    def __init__(self, folder: Path, **environment: str) -> None:
        self.folder = folder
        bin_folder = str(Path(sys.executable).parent)
        self.environment = {
            **clean_environment(),
            "HMCS_CELL": CELL,
            "PATH": f"{bin_folder}{os.pathsep}{os.environ['PATH']}",
            **environment,
        }
        self._started: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.end_all()

    def run(self, line: str) -> str:
        """Run a command to its end; return what it printed; fails where it fails."""
        done = self.tried(line)
        assert done.returncode == 0, f"{line}\n{done.stderr}{done.stdout}"
        return done.stdout + done.stderr

    def tried(self, line: str) -> subprocess.CompletedProcess[str]:
        """Run a command to its end."""
        return subprocess.run(
            ["bash", "-c", line],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=WITHIN_S,
            check=False,
        )

    def start(self, line: str) -> Path:
        """Start a command that goes on; return the file of what it prints."""
        log = self.folder / f"started-{len(self._started)}.log"
        with log.open("wb") as stream:
            self._started.append(
                subprocess.Popen(
                    ["bash", "-c", line],
                    cwd=self.folder,
                    env=self.environment,
                    stdin=subprocess.DEVNULL,
                    stdout=stream,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                )
            )
        return log

    def check_all_run(self) -> None:
        """Fail where something that was started has ended."""
        ended = [k for k, process in enumerate(self._started) if process.poll() is not None]
        logs = [(self.folder / f"started-{k}.log").read_text(encoding="utf-8") for k in ended]
        assert not ended, "\n".join(logs)

    def end_all(self) -> None:
        """End what was started, the latest first."""
        for process in reversed(self._started):
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGTERM)
            try:
                process.wait(30)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        self._started.clear()
