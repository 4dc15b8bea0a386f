"""How other `hmcs` commands reach a running `hmcs up`: a Unix socket only this user can open.

Not over the bus: who may publish there must not be able to start commands here. One JSON line
asks, one JSON line answers:

    {"start": SERVICE, "command": [...] or null}    {"instance": NAME}
    {"stop": INSTANCE}                              {"exit_code": N}
    {"runs": INSTANCE}                              {"runs": true or false, "command": [...]}

or `{"error": TEXT}`. Both sides see to it that the other is this user.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import socket
import stat
import struct
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from hmcs.errors import UserError
from hmcs_local.stack import LocalStack

LONGEST_BYTES = 64 * 2**10
"""Of a question or an answer."""
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


class _Request(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class _Start(_Request):
    start: str
    command: list[str] | None = Field(default=None, min_length=1)


class _Stop(_Request):
    stop: str


class _Runs(_Request):
    runs: str


_REQUESTS: TypeAdapter[_Start | _Stop | _Runs] = TypeAdapter(_Start | _Stop | _Runs)


class ControlServer:
    """Carries out what other commands ask of a stack; `serve` does it in the caller's thread."""

    def __init__(self, stack: LocalStack) -> None:
        self._stack = stack
        self._path = control_path(stack.folder)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)

    def __enter__(self) -> Self:
        folder = self._path.parent
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        _check_private(folder)
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
        """Wait at most so long for a request, and answer it; whatever comes, it goes on."""
        self._socket.settimeout(timeout_s)
        try:
            connection, _ = self._socket.accept()
        except OSError:  # nobody asks, or who did is gone again
            return
        # The asker may be gone before it has asked or heard the answer: that is its own affair.
        with connection, contextlib.suppress(OSError):
            if not _is_this_user(connection):
                return
            line = _line_from(connection, _REQUEST_TIMEOUT_S)
            if line:
                connection.settimeout(_REQUEST_TIMEOUT_S)
                connection.sendall(_as_line(self._answer(line)))

    def _answer(self, line: bytes) -> dict[str, Any]:
        try:
            request = _REQUESTS.validate_json(line)
        except ValidationError as error:
            return {"error": f"not understood: {error.errors(include_url=False)[0]['msg']}"}
        try:
            match request:
                case _Start():
                    process = self._stack.start(request.start, command=request.command)
                    return {"instance": process.instance}
                case _Runs():
                    known = self._stack.processes.get(request.runs)
                    if known is None or not known.running:
                        return {"runs": False, "command": []}
                    return {"runs": True, "command": list(known.command)}
                case _Stop():
                    if request.stop not in self._stack.processes:
                        return {"error": f"{request.stop!r} was not started here"}
                    return {"exit_code": self._stack.processes[request.stop].stop()}
        except Exception as error:  # of one request: the stack goes on
            message = str(error) if isinstance(error, (UserError, OSError)) else repr(error)
            return {"error": message}


class Control:
    """Asks the `hmcs up` that works in a folder. Raises ControlError where there is none."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def check_there(self) -> None:
        """Raise ControlError where no `hmcs up` works in the folder."""
        if not _is_answered(control_path(self._folder)):
            raise self._nobody()

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

    def command(self, instance: str) -> tuple[str, ...]:
        """Return the command of an instance it started and that still runs; empty for any other."""
        return tuple(self._ask({"runs": instance})["command"])

    def _ask(self, request: dict[str, Any]) -> dict[str, Any]:
        path = control_path(self._folder)
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
            connection.settimeout(_ANSWER_TIMEOUT_S)
            try:
                _check_private(path.parent)
                connection.connect(str(path))
                connection.sendall(_as_line(request))
                answer = json.loads(_line_from(connection, _ANSWER_TIMEOUT_S))
            except (OSError, ValueError):
                raise self._nobody() from None
        if "error" in answer:
            raise ControlError(answer["error"])
        return dict(answer)

    def _nobody(self) -> ControlError:
        return ControlError(
            f"no `hmcs up` works in {self._folder.resolve()}: start one, or name the folder of the "
            "one that runs with --folder"
        )


def _as_line(message: dict[str, Any]) -> bytes:
    return json.dumps(message).encode() + b"\n"


def _line_from(connection: socket.socket, timeout_s: float) -> bytes:
    """Return the line that comes within `timeout_s`; empty where none comes, or one too long."""
    deadline_s = time.monotonic() + timeout_s
    data = b""
    while not data.endswith(b"\n"):
        left_s = deadline_s - time.monotonic()
        if left_s <= 0:
            return b""
        connection.settimeout(left_s)
        more = connection.recv(LONGEST_BYTES - len(data))
        if not more:
            return b""
        data += more
    return data


def _check_private(folder: Path) -> None:
    """Raise ControlError where others than this user can use a folder, or have put it there."""
    status = folder.lstat()
    if (
        not stat.S_ISDIR(status.st_mode)
        or status.st_uid != os.getuid()
        or stat.S_IMODE(status.st_mode) & 0o077
    ):
        raise ControlError(f"{folder} can be used by others: remove it, or set XDG_RUNTIME_DIR")


def _is_this_user(connection: socket.socket) -> bool:
    """Whether who asks is this user, where the system tells; the folder keeps others out, too."""
    if not hasattr(socket, "SO_PEERCRED"):
        return True
    credentials = connection.getsockopt(
        socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i")
    )
    return bool(struct.unpack("3i", credentials)[1] == os.getuid())


def _is_answered(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        return probe.connect_ex(str(path)) == 0
