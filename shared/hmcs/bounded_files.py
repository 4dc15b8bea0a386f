"""Files of unknown origin: ordinary files only, and no more of each than was agreed on."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

from hmcs.errors import UserError

_CHUNK_BYTES = 1 << 20


class UnreadableFileError(UserError):
    """A file that is not read; says which, why, and what to do."""

    def __init__(self, file: str | Path, what: str) -> None:
        super().__init__(f"{file}: {what}")
        self.what = what
        """Without the name of the file."""


def read_bounded(file: str | Path, most_bytes: int) -> bytes:
    """Return the content of an ordinary file.

    A pipe or a device is never waited for. Raises UnreadableFileError where there is no such file,
    it is a folder, a pipe, a socket or a device, it must not be read, or it holds more than
    `most_bytes`.
    """
    try:
        _check_ordinary(file, Path(file).stat())
        # Without O_NONBLOCK a pipe put in its place meanwhile would be waited for.
        descriptor = os.open(file, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        try:
            _check_ordinary(file, os.fstat(descriptor))
            return _content(file, descriptor, most_bytes)
        finally:
            os.close(descriptor)
    except OSError as error:
        missing = error.errno in (errno.ENOENT, errno.ENOTDIR)
        what = "no such file" if missing else f"cannot be read: {error.strerror}"
        raise UnreadableFileError(file, what) from error
    except ValueError as error:
        # A null byte is not part of any path.
        raise UnreadableFileError(repr(str(file)), f"cannot be a path: {error}") from error


def _check_ordinary(file: str | Path, status: os.stat_result) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise UnreadableFileError(file, "a folder, expected a file")
    if not stat.S_ISREG(status.st_mode):
        raise UnreadableFileError(file, "a pipe, socket or device, expected an ordinary file")


def _content(file: str | Path, descriptor: int, most_bytes: int) -> bytes:
    parts, left = list[bytes](), most_bytes + 1
    while left > 0 and (part := os.read(descriptor, min(left, _CHUNK_BYTES))):
        parts.append(part)
        left -= len(part)
    if left <= 0:
        raise UnreadableFileError(file, f"larger than {most_bytes:,} bytes, the most that is read")
    return b"".join(parts)
