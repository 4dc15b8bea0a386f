"""Recordings in the recorder's folder, renamed, deleted and noted for processes that see no files.

What is beside a recording, its labels and its note, goes along.
"""

from __future__ import annotations

from pathlib import Path

from hmcs.bus.keys import check_name
from hmcs.bus.messages import ChangeRecording, Done
from hmcs.bus.session import RequestRefusedError
from hmcs.recordings.labels import labels_beside
from hmcs.recordings.outlining import recording_named
from hmcs.whole_files import written_whole
from hmcs_recorder.settings import RecorderSettings

LONGEST_NOTE = 2_000
"""Characters."""


def note_beside(recording: Path) -> Path:
    """Return where the note of a recording is written."""
    return recording.with_name(f"{recording.stem}.note.txt")


def note_of(recording: Path) -> str:
    """Return what was noted of a recording; nothing where there is no note to be read."""
    try:
        return note_beside(recording).read_text(encoding="utf-8")[:LONGEST_NOTE]
    except (OSError, UnicodeDecodeError):
        return ""


def changed(settings: RecorderSettings, asked: ChangeRecording, running: Path | None) -> Done:
    """Rename, delete or note a recording; `running` is the file that is being written.

    Raises RecordingError where there is none of that name, RequestRefusedError where it is being
    written, where the new name is taken, or the note too long, and KeyNameError for a new name that
    cannot be one. Nothing is changed then.
    """
    if not asked.recording:
        raise RequestRefusedError("say which recording is to be changed")
    path = recording_named(settings.folder, asked.recording)
    if running is not None and path.resolve() == running.resolve():
        raise RequestRefusedError(f"{path.name} is being recorded: end it first")
    try:
        match asked.change:
            case "rename":
                return _renamed(path, asked.text.strip())
            case "delete":
                return _deleted(path)
            case "note":
                return _noted(path, asked.text.strip())
    except OSError as error:
        raise RequestRefusedError(f"{path.name}: {error.strerror}") from error


def _renamed(path: Path, name: str) -> Done:
    check_name("recording", name)
    target = path.with_name(f"{name}{path.suffix}")
    pairs = [(path, target)] + [
        (beside(path), beside(target)) for beside in (labels_beside, note_beside)
    ]
    for _, taken in pairs:
        if taken.exists():
            raise RequestRefusedError(f"there is a {taken.name} already: choose another name")
    for source, goal in pairs:
        if source.exists():
            source.rename(goal)
    return Done(detail=f"{path.name} is {target.name} now")


def _deleted(path: Path) -> Done:
    for file in (path, labels_beside(path), note_beside(path)):
        file.unlink(missing_ok=True)
    return Done(detail=f"deleted {path.name}")


def _noted(path: Path, note: str) -> Done:
    if len(note) > LONGEST_NOTE:
        raise RequestRefusedError(f"a note has at most {LONGEST_NOTE} characters")
    target = note_beside(path)
    if not note:
        target.unlink(missing_ok=True)
        return Done(detail=f"{path.name} has no note now")
    with written_whole(target) as unfinished:
        unfinished.write_text(note, encoding="utf-8")
    return Done(detail=f"noted in {target.name}")
