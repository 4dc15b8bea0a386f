"""The process of one segmentation: a `SegmentJob` on standard input, a `Found` on output, as JSON.

Its output is published on the bus, so it quotes nothing from the recording.
"""

from __future__ import annotations

import sys
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from hmcs.errors import UserError
from hmcs.motion.demonstrations import Demonstration
from hmcs.recognition.demonstration_parts import Part, parts_of
from hmcs.recognition.model_file import load_model
from hmcs.recognition.registry import segmentation_of
from hmcs.recordings.demonstrations import performances_of
from hmcs.recordings.labels import labels_of
from hmcs.recordings.reading import RecordingContent, RecordingError, read
from hmcs.task import Task

MOST_SEGMENTS = 2_000
"""More cannot be told apart on a page."""
MOST_SAMPLES = 200_000
"""Of all its motion: more than half an hour of 100 Hz."""


class SegmentJob(BaseModel):
    """A segmentation, as the process that does it reads it on its standard input."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    recording: Path
    model: Path
    """Its file."""


class Segment(BaseModel):
    """One segment that was found."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    begin_s: float
    """Since the recording's first message."""
    end_s: float
    state: str
    """As in Label; empty for unknown motion."""
    probability: float


class Found(BaseModel):
    """What came of it."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    segments: tuple[Segment, ...] = ()
    error: str = ""
    """Why there are none; empty where there are."""


def found_in(job: SegmentJob) -> Found:
    """Return the segments of a recording by a model, those of all performances in it in order.

    Raises ModelFileError for a model that cannot be read, RecordingError for a recording, and
    UserError where the model is of a kind without offline segmentation, where labels of the
    recording are no states of its task, and where there is no or too much motion.
    """
    model = load_model(job.model)
    segmentation_of(model, ())
    content = read(job.recording)
    _check_labels(content, model.task)
    performances = performances_of(content)
    _check_motion(job.recording.name, performances)
    segments = [
        _segment(performance, part)
        for performance in performances
        for part in parts_of(model, performance)
    ]
    if len(segments) > MOST_SEGMENTS:
        raise UserError(
            f"{job.recording.name}: model {model.name!r} finds {len(segments)} segments in it, "
            f"more than the {MOST_SEGMENTS} that are shown: it is not of this motion; "
            f"`hmcs segment {job.recording} --model {job.model}` lists them"
        )
    return Found(segments=tuple(each for each in segments if each.begin_s < each.end_s))


def _check_labels(content: RecordingContent, task: Task) -> None:
    known = {state.name for state in task.states}
    if any(label.state.partition("/")[0] not in known for label in labels_of(content)):
        raise UserError(
            f"{content.path.name}: has labels that are no states of the model's task {task.name!r}"
            f" ({', '.join(sorted(known))}): choose a model of the recording's own task"
        )


def _check_motion(name: str, performances: list[Demonstration]) -> None:
    samples = sum(len(each.positions) for each in performances)
    if not samples:
        raise UserError(f"{name}: there is no motion of a hand in it that held on")
    if samples > MOST_SAMPLES:
        raise UserError(
            f"{name}: {samples} samples of the hand, more than the {MOST_SAMPLES} that are looked "
            "through for the page: use `hmcs segment`"
        )


def _segment(performance: Demonstration, part: Part) -> Segment:
    return Segment(
        begin_s=float(performance.time_s[part.begin]),
        end_s=float(performance.time_s[part.end]),
        state=part.label or "",
        probability=min(max(part.probability, 0.0), 1.0),
    )


def main() -> int:
    """Do the job that stands on standard input; return the exit code."""
    job = SegmentJob.model_validate_json(sys.stdin.buffer.read())
    try:
        found = found_in(job)
    except RecordingError:
        what = f"`hmcs segment {job.recording} --model {job.model}` says what is wrong"
        found = Found(error=f"{job.recording.name}: cannot be read: {what}")
    except UserError as error:
        found = Found(error=str(error))
    print(found.model_dump_json(), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
