"""Demonstrations as they are named on a command line: files, folders, patterns, drawings."""

from __future__ import annotations

import glob
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from hmcs.errors import UserError
from hmcs.recordings.file_rotation import SUFFIX as RECORDING
from hmcs.recordings.foreign.registry import ENDINGS as OTHER_PROGRAMS
from hmcs.recordings.foreign.registry import is_recording_folder
from hmcs_local.recorded_files import check_folder, found_elsewhere, unknown_file_message
from hmcs_trainer.references import DRAWINGS

ENDINGS = (".csv", RECORDING, *OTHER_PROGRAMS)
"""Of demonstrations in a folder."""
LABELS = ".labels.csv"
"""Ending of files that hold the labels of a recording beside them."""


def expanded(references: Sequence[str], folder: Path, tell: Callable[[str], None]) -> Iterator[str]:
    """Return references with folders and patterns replaced by the files they stand for, by name.

    Recordings of `hmcs up` in `folder` may be given by their bare names; `tell` is given a line for
    each. All references are looked up when the first is asked for, so that options can be checked
    before. A file that is named twice is left in twice: training says so. Raises UserError for a
    folder or a pattern without demonstrations, and for a file that is not there, with the names
    nearest to it; at once for a folder that is none.
    """
    check_folder(folder)
    return _looked_up(references, folder, tell)


def _looked_up(
    references: Sequence[str], folder: Path, tell: Callable[[str], None]
) -> Iterator[str]:
    yield from [file for each in references for file in _files_of(each, folder, tell)]


def _files_of(reference: str, folder: Path, tell: Callable[[str], None]) -> list[str]:
    path = Path(reference)
    if reference.startswith(DRAWINGS) or path.is_file() or is_recording_folder(path):
        return [reference]
    if path.is_dir():
        files = [str(file) for file in sorted(path.iterdir()) if _is_demonstration(file)]
        if not files:
            raise UserError(
                f"{reference}: no demonstration ({' or '.join('*' + each for each in ENDINGS)}) in "
                "this folder"
            )
        return files
    if glob.has_magic(reference):
        # Path.glob takes no absolute patterns.
        named = glob.glob(reference)  # noqa: PTH207
        files = sorted(each for each in named if not each.endswith(LABELS))
        if not files:
            raise UserError(f"{reference}: no file is named like this")
        return files
    found = found_elsewhere(path, folder)
    if found is None:
        raise UserError(unknown_file_message(path, folder, ENDINGS))
    tell(f"{reference}: {found}")
    return [str(found)]


def _is_demonstration(file: Path) -> bool:
    if file.is_dir():
        return is_recording_folder(file)
    return file.is_file() and file.name.endswith(ENDINGS) and not file.name.endswith(LABELS)
