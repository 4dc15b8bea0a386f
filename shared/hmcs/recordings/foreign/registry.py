"""Which format a recording of another program has, found by its content, and its demonstrations."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from hmcs.bounded_files import UnreadableFileError
from hmcs.motion.demonstrations import Demonstration
from hmcs.recordings.foreign.bags import BAG1_MAGIC, METADATA, SQLITE_MAGIC, bag_at
from hmcs.recordings.foreign.choices import Choices
from hmcs.recordings.foreign.lerobot import episodes_in
from hmcs.recordings.foreign.lerobot_tables import INFO
from hmcs.recordings.foreign.logs import Log, motion_in
from hmcs.recordings.foreign.mcap_files import McapLog
from hmcs.recordings.mcap_records import MAGIC as MCAP_MAGIC
from hmcs.recordings.reading import RecordingError, read
from hmcs.recordings.writing import PROFILE
from hmcs.shown import plain

ENDINGS = (".bag", ".db3")
"""Of files of these formats in a folder, beside MCAP; what they are their content says."""
PACKED = (".db3.zstd", ".mcap.zstd", ".bag.gz")


_PROFILE_AT = len(MCAP_MAGIC) + 9
"""Behind the head of the first record."""
_PROFILE = len(PROFILE).to_bytes(4, "little") + PROFILE.encode()
_LONGEST_NOTE = 4000


class Taken(NamedTuple):
    """The demonstrations in a recording of another program."""

    demonstrations: tuple[Demonstration, ...]
    """One at least."""
    notes: tuple[str, ...]
    """What was taken for what, a sentence each."""


class Format(NamedTuple):
    """A format of other programs."""

    name: str
    is_one: Callable[[Path], bool]
    """Whether a file or folder has it."""
    take: Callable[[Path, Choices], Taken]


def _of_log(open_log: Callable[[Path], Log]) -> Callable[[Path, Choices], Taken]:
    def take(path: Path, choices: Choices) -> Taken:
        found = motion_in(open_log(path), choices)
        return Taken((found.demonstration,), found.notes)

    return take


def _episodes(path: Path, choices: Choices) -> Taken:
    shown, notes = episodes_in(path, choices)
    return Taken(tuple(shown), notes)


def _begins(path: Path, magic: bytes) -> bool:
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        return stream.read(len(magic)) == magic


def _is_foreign_mcap(path: Path) -> bool:
    if not _begins(path, MCAP_MAGIC):
        return False
    with path.open("rb") as stream:
        # A recorder of our own says so at once; in a file that was merged or mended one looks.
        ours = stream.read(_PROFILE_AT + len(_PROFILE))[_PROFILE_AT:] == _PROFILE
    return not ours and not read(path).schemas


FORMATS = (
    Format("bag of ROS 1", lambda path: _begins(path, BAG1_MAGIC), _of_log(bag_at)),
    Format("bag of ROS 2", lambda path: _begins(path, SQLITE_MAGIC), _of_log(bag_at)),
    Format("bag of ROS 2", lambda path: (path / METADATA).is_file(), _of_log(bag_at)),
    Format("MCAP", _is_foreign_mcap, _of_log(McapLog)),
    Format("LeRobot", lambda path: (path / INFO).is_file(), _episodes),
)


def format_of(path: Path) -> Format | None:
    """Return the format of a file or folder; None where it is none of other programs.

    Raises RecordingError where it cannot be looked at, or is packed as a whole.
    """
    if path.name.endswith(PACKED):
        raise RecordingError(f"{path}: is packed as a whole: unpack it first, e.g. by unzstd")
    try:
        found = next((each for each in FORMATS if each.is_one(path)), None)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror or error}") from error
    if found is None and path.suffix in (".bag", ".db3") and path.is_file():
        raise RecordingError(
            f"{path}: does not begin as a bag of ROS does: was it copied whole, or is it a bag of "
            "another program?"
        )
    return found


def is_recording_folder(path: Path) -> bool:
    """Return whether a folder is one recording, and no folder of recordings."""
    return (path / METADATA).is_file() or (path / INFO).is_file()


def take(form: Format, path: Path, choices: Choices) -> Taken:
    """Return the demonstrations in a file or folder of a format.

    Raises RecordingError, which says where and what to do, for what cannot be used.
    """
    try:
        taken = form.take(path, choices)
        # They quote the file.
        return taken._replace(notes=tuple(plain(note, _LONGEST_NOTE) for note in taken.notes))
    except UnreadableFileError as error:
        raise RecordingError(str(error)) from error
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror or error}") from error
    except MemoryError as error:
        raise RecordingError(f"{path}: there is too little memory to read it") from error
