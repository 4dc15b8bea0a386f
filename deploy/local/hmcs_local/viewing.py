"""`hmcs view`: a recording in Rerun's viewer, or in a file that it opens."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from rich.console import Console

from hmcs.errors import UserError
from hmcs.recordings.reading import read
from hmcs.recordings.rerun_view.layout import layout
from hmcs.recordings.rerun_view.showing import new_stream, rerun_file, show
from hmcs.shown import plain
from hmcs.whole_files import written_whole
from hmcs.write_places import check_file_place
from hmcs_local.progress import progress_shown

SUFFIX = ".rrd"
_DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY")
_LONGEST_NOTE = 4000


def show_in_rerun(file: Path, console: Console) -> None:
    """Open Rerun's viewer with a recording; UserError where there is no display or no viewer."""
    content = read(file)
    stream = new_stream(content)
    if sys.platform.startswith("linux") and not any(map(os.environ.get, _DISPLAYS)):
        name = f"{file.stem}{SUFFIX}"
        raise UserError(
            f"there is no display here: write a file, --save {name}, and open it where there is "
            f"one: rerun {name}"
        )
    try:
        stream.spawn(default_blueprint=layout())
    except (RuntimeError, OSError) as error:
        raise UserError(f"Rerun's viewer does not start: {error}") from error
    with progress_shown("going over it") as update:
        _tell(show(content, stream, update), console)
    stream.disconnect()


def check_save_place(target: Path | None) -> None:
    """Raise UserError for a file that Rerun would not open, or that cannot be written there."""
    if target is None:
        return
    if target.suffix != SUFFIX:
        raise UserError(f"--save {target}: Rerun opens files that end in {SUFFIX}: name it so")
    check_file_place(target, "--save")


def save_for_rerun(file: Path, target: Path, console: Console) -> None:
    """Write a recording as a file that Rerun opens; UserError where that cannot be."""
    check_save_place(target)
    content = read(file)
    with progress_shown("going over it") as update:
        data, notes = rerun_file(content, update)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with written_whole(target) as unfinished:
            unfinished.write_bytes(data)
    except OSError as error:
        raise UserError(f"{target}: cannot be written: {error.strerror or error}") from error
    _tell(notes, console)
    console.print(f"{target}: open it with: rerun {target}", markup=False)


def _tell(notes: tuple[str, ...], console: Console) -> None:
    for note in notes:
        console.print(plain(note, _LONGEST_NOTE), markup=False)
