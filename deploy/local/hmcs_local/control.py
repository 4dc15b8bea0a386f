"""How other `hmcs` commands reach a running `hmcs up`: a Unix socket only this user can open.

Not over the bus: whoever may publish there must not be able to start commands here. One JSON line
asks, one JSON line answers:

    {"start": SERVICE, "command": [...] or null}    {"instance": NAME}
    {"stop": INSTANCE}                              {"exit_code": N}
    {"runs": INSTANCE}                              {"runs": true or false}

or `{"error": TEXT}`.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import socket
import tempfile
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from hmcs.errors import UserError
from hmcs_local.stack import LocalStack

_REQUEST_TIMEOUT_S = 2.0
_ANSWER_TIMEOUT_S = 20.0


class ControlError(UserError):
    """A running `hmcs up` that cannot be reached, or refuses."""


def control_path(folder: Path) -> Path:
    """Return where the `hmcs up` that works in `folder` listens.

    Not in the folder itself: a socket's path may have no more than about a hundred characters.
    """
    base = Path(os.environ.get("XDG_RUNTIME_DIR") or tempfile.gettempdir())
    name = hashlib.sha256(str(folder.resolve()).encode()).hexdigest()[:16]
    return base / f"hmcs-{os.getuid()}" / f"{name}.sock"


class ControlServer:
    """Carries out what other commands ask of a stack; `serve` does it in the caller's thread."""

    def __init__(self, stack: LocalStack) -> None:
        self._stack = stack
        self._path = control_path(stack.folder)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)

    def __enter__(self) -> Self:
        folder = self._path.parent
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.stat()
        if status.st_uid != os.getuid() or status.st_mode & 0o077:
            raise ControlError(f"{folder} can be used by others: remove it, or set XDG_RUNTIME_DIR")
        if _is_answered(self._path):
            raise ControlError(
                f"another `hmcs up` works in {self._stack.folder}: stop it, or choose another "
                "folder with --folder"
            )
        self._path.unlink(missing_ok=True)
        self._socket.bind(str(self._path))
        self._socket.listen()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._socket.close()
        self._path.unlink(missing_ok=True)

    def serve(self, timeout_s: float) -> None:
        """Wait at most so long for a request, and answer it."""
        self._socket.settimeout(timeout_s)
        try:
            connection, _ = self._socket.accept()
        except TimeoutError:
            return
        # The asker may be gone before it has asked or heard the answer: that is its own affair.
        with connection, contextlib.suppress(OSError):
            connection.settimeout(_REQUEST_TIMEOUT_S)
            with connection.makefile("rw", encoding="utf-8") as stream:
                line = stream.readline()
                if line:
                    stream.write(json.dumps(self._answer(line)) + "\n")

    def _answer(self, line: str) -> dict[str, Any]:
        try:
            request = json.loads(line)
            if "start" in request:
                process = self._stack.start(request["start"], command=request.get("command"))
                return {"instance": process.instance}
            if "runs" in request:
                known = self._stack.processes.get(request["runs"])
                return {"runs": known is not None and known.running}
            return {"exit_code": self._stack.processes[request["stop"]].stop()}
        except (UserError, OSError) as error:
            return {"error": str(error)}
        except (ValueError, TypeError, KeyError) as error:
            return {"error": f"not understood: {error}"}


class Control:
    """Asks the `hmcs up` that works in a folder. Raises ControlError where there is none."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def start(self, service: str, command: Sequence[str] | None = None) -> str:
        """Start one more instance of a service; returns its name."""
        request = {"start": service, "command": list(command) if command else None}
        return str(self._ask(request)["instance"])

    def stop(self, instance: str) -> int:
        """Stop an instance; returns its exit code."""
        return int(self._ask({"stop": instance})["exit_code"])

    def owns(self, instance: str) -> bool:
        """Return whether it started `instance` and that still runs."""
        return bool(self._ask({"runs": instance})["runs"])

    def _ask(self, request: dict[str, Any]) -> dict[str, Any]:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
            connection.settimeout(_ANSWER_TIMEOUT_S)
            try:
                connection.connect(str(control_path(self._folder)))
                with connection.makefile("rw", encoding="utf-8") as stream:
                    stream.write(json.dumps(request) + "\n")
                    stream.flush()
                    answer = json.loads(stream.readline())
            except (OSError, ValueError):
                raise ControlError(
                    f"no `hmcs up` works in {self._folder.resolve()}: start one, or name the "
                    "folder of the one that runs with --folder"
                ) from None
        if "error" in answer:
            raise ControlError(answer["error"])
        return dict(answer)


def _is_answered(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        return probe.connect_ex(str(path)) == 0
