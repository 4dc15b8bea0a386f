"""A recording in parts: a new file by size and time, and an end before the disk is full."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from errno import ENOENT
from pathlib import Path
from typing import Any, NamedTuple

from hmcs.errors import UserError
from hmcs.recordings.foxglove import FoxgloveConverter
from hmcs.recordings.json_codec import Fields
from hmcs.recordings.writing import RecordingFile

SUFFIX = ".mcap"
_NS_PER_S = 1_000_000_000
_MB = 1_000_000


class NoRoomError(OSError):
    """There is no more room for recordings; says which limit was met."""


class Limits(NamedTuple):
    """How large recordings grow."""

    part_mb: float
    part_s: float
    limit_mb: float
    """Of the folder."""
    free_mb: float
    """Left on the disk."""


class Preface(NamedTuple):
    """What every part begins with."""

    metadata: Mapping[str, Mapping[str, str]]
    attachments: Mapping[str, bytes]


class Recording:
    """One recording. Every method but `abandon` may raise OSError; it is to be abandoned then."""

    def __init__(
        self,
        folder: Path,
        name: str,
        limits: Limits,
        preface: Callable[[], Preface],
        now_ns: int,
        library: str,
        *,
        next_free: bool = False,
    ) -> None:
        """Begin it; `preface` is asked at the beginning of each part, times are ns since 1970.

        Raises UserError where there is one of that name already; with `next_free` a number is added
        to the name instead, as for the second part.
        """
        self._folder, self._name, self._limits = folder, name, limits
        self._preface, self._library = preface, library
        self._number = 0
        self._showing = FoxgloveConverter()
        self.messages = 0
        """Written so far; what is shown to viewers besides does not count."""
        folder.mkdir(parents=True, exist_ok=True)
        self._begin(now_ns, next_free=next_free)

    @property
    def path(self) -> Path:
        """The file that is being written."""
        return self._file.path

    @property
    def undescribed(self) -> frozenset[str]:
        """Robots in it of which nobody said how they look; see `name_joints`."""
        return frozenset(self._showing.undescribed)

    def write(self, key: str, fields: Fields, log_ns: int, captured_ns: int | None) -> None:
        """Add a message by its fields, as `fields_of` gives them.

        Raises ValueError for what `RecordingFile.write` cannot write.
        """
        if self._is_full(log_ns):
            self.next_part(log_ns)
        captured = log_ns if captured_ns is None else captured_ns
        self._file.write(key, fields["schema"], fields, log_ns, captured)
        self.messages += 1
        for shown in self._showing.of(fields, log_ns):
            self._file.write(shown.topic, shown.schema, shown.fields, log_ns, captured)

    def next_part(self, now_ns: int) -> None:
        """Go on in a new file; where its name is taken, in the next one whose name is free."""
        self._file.finish()
        self._begin(now_ns, next_free=True)

    def name_joints(self, robot: str, joints: tuple[str, ...]) -> None:
        """Show the joints of a robot from now on, by the names its description has for them."""
        self._showing.name_joints(robot, joints)

    def add(self, preface: Preface, now_ns: int) -> None:
        """Keep some more with the part that is being written."""
        for name, facts in preface.metadata.items():
            self._file.tell(name, facts)
        for name, content in preface.attachments.items():
            self._file.attach(name, content, now_ns)

    def flush(self) -> None:
        """Make sure of what came until now.

        Raises NoRoomError where a limit is met, FileNotFoundError where somebody deleted the file.
        """
        self._file.flush()
        if not self._file.is_there:
            raise FileNotFoundError(ENOENT, "it was deleted while it was written", str(self.path))
        self._check_room()

    def finish(self) -> None:
        """End it; a second time does nothing."""
        self._file.finish()

    def abandon(self) -> None:
        """Leave it as it is on the disk."""
        self._file.abandon()

    def _begin(self, now_ns: int, *, next_free: bool) -> None:
        self._check_room()
        while True:
            self._number += 1
            part = "" if self._number == 1 else f"-{self._number:03}"
            path = self._folder / f"{self._name}{part}{SUFFIX}"
            try:
                file = RecordingFile(path, self._library)
                break
            except FileExistsError as error:
                if not next_free:
                    raise UserError(
                        f"{path}: there is a recording already: choose another name"
                    ) from error
        self._file = file
        self._began_ns = now_ns
        try:
            self.add(self._preface(), now_ns)
        except BaseException:
            file.abandon()
            raise

    def _is_full(self, now_ns: int) -> bool:
        return (
            self._file.size_bytes >= self._limits.part_mb * _MB
            or now_ns - self._began_ns >= self._limits.part_s * _NS_PER_S
        )

    def _check_room(self) -> None:
        used = sum(map(_size_bytes, self._folder.glob(f"*{SUFFIX}")))
        if used >= self._limits.limit_mb * _MB:
            raise NoRoomError(
                f"{self._folder}: recordings fill {used / _MB:.0f} MB of {self._limits.limit_mb:g} "
                "(limit_mb): move some away, or raise it"
            )
        free = shutil.disk_usage(self._folder).free
        if free < self._limits.free_mb * _MB:
            raise NoRoomError(
                f"{self._folder}: {free / _MB:.0f} MB are free on the disk, fewer than "
                f"{self._limits.free_mb:g} (free_mb): make room"
            )


def _size_bytes(file: Path) -> int:
    try:
        return file.stat().st_size
    except OSError:
        # It was moved away a moment ago, or leads nowhere.
        return 0


def as_fields(facts: Mapping[str, Any]) -> dict[str, str]:
    """Return facts as metadata has them: text."""
    return {name: str(value) for name, value in facts.items()}
