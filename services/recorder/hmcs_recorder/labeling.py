"""Recordings in the recorder's folder, outlined and labeled for processes that see no files."""

from __future__ import annotations

from pathlib import Path

from pydantic import ValidationError

from hmcs.bus.messages import Done, Outline, OutlineQuestion, SetLabels
from hmcs.bus.session import RequestRefusedError
from hmcs.errors import first_problem
from hmcs.recordings.outlining import outlined, recording_named, recordings_in, set_labels
from hmcs.recordings.reading import RecordingContent, read
from hmcs_recorder.changing import note_of
from hmcs_recorder.settings import RecorderSettings

_MB = 1_000_000


def outline_of(settings: RecorderSettings, asked: OutlineQuestion) -> Outline:
    """Return the outline of a recording, as much as there is of one that is being written.

    Raises RecordingError where there is none or it cannot be read, RequestRefusedError where it is
    too large, or holds what no message can say.
    """
    path = recording_named(settings.folder, asked.recording)
    outline = outlined(_read(settings, path))
    try:
        return Outline(
            recordings=tuple(file.name for file in recordings_in(settings.folder)),
            recording=path.name,
            path=str(path.resolve()),
            duration_s=outline.duration_s,
            time_s=outline.time_s,
            position=outline.positions,
            begin_s=outline.begin_s,
            end_s=outline.end_s,
            states=outline.states,
            note=note_of(path),
        )
    except ValidationError as error:
        where, why = first_problem(error)
        raise RequestRefusedError(
            f"{path.name} cannot be shown, its {where} is no hand's: {why}; record it "
            f"again, or look at it by `hmcs inspect {path}`"
        ) from None


def labels_set(settings: RecorderSettings, asked: SetLabels) -> Done:
    """Write labels beside a recording, in place of those there are.

    Raises as `outline_of`, and LabelError for labels that cannot be of it; nothing is written then.
    """
    if not asked.recording:
        raise RequestRefusedError("say which recording the labels are of")
    content = _read(settings, recording_named(settings.folder, asked.recording))
    file = set_labels(content, asked.begin_s.tolist(), asked.end_s.tolist(), asked.states)
    count = len(asked.states)
    return Done(detail=f"{count} {'label' if count == 1 else 'labels'} written to {file}")


def _read(settings: RecorderSettings, path: Path) -> RecordingContent:
    size_mb = path.stat().st_size / _MB
    if size_mb > settings.outline_mb:
        raise RequestRefusedError(
            f"{path.name} has {size_mb:.0f} MB, more than {settings.outline_mb:g} (outline_mb): "
            f"label it by `hmcs label {path}`"
        )
    return read(path)
