"""The process of one training: a `Job` on standard input, its progress as lines of JSON on output.

No part of the question is a word of its command line. Its output is published on the bus, so it
quotes nothing from the files it reads; the complete error goes to standard error, for the log.
"""

from __future__ import annotations

import json
import sys

from hmcs.errors import UserError
from hmcs.motion.demonstrations import DemonstrationError
from hmcs.recognition.segments import LearningError
from hmcs.recordings.reading import RecordingError
from hmcs.task import TaskFileError
from hmcs_trainer.asked import Job
from hmcs_trainer.references import DRAWINGS, NoMotionError
from hmcs_trainer.training import train

FAILED = 2
"""Exit code where what was asked cannot be done."""


def public_message(error: UserError, job: Job) -> str:
    """Return what was wrong, without quoting a file that could not be read."""
    if isinstance(error, LearningError):
        return error.unquoted
    if isinstance(error, TaskFileError):
        lines = ", ".join(dict.fromkeys(str(problem.line) for problem in error.problems[:3]))
        return f"{job.task}, line {lines}: no task: `hmcs task check` with it says what is wrong"
    if isinstance(error, (DemonstrationError, RecordingError)) and _quotes(error):
        named = [name for name in job.demonstrations if str(error).startswith(f"{name}:")]
        what = named[0] if named else "a demonstration, or the labels beside it"
        return f"{what}: cannot be read: `hmcs task check` with the task and it says what is wrong"
    return str(error)


def _quotes(error: UserError) -> bool:
    return not (isinstance(error, NoMotionError) or str(error).startswith(DRAWINGS))


def main() -> int:
    """Do the job that stands on standard input; return the exit code."""
    job = Job.model_validate_json(sys.stdin.buffer.read())
    try:
        train(
            job.task,
            list(job.demonstrations),
            job.model,
            name=job.name,
            recognizer=job.recognizer,
            find_states=job.find_states,
            report=job.report,
            progress=lambda detail: _tell({"detail": detail}),
            fits=lambda done, count: _tell({"done": done, "count": count}),
        )
    except UserError as error:
        print(error, file=sys.stderr)
        _tell({"error": public_message(error, job)})
        return FAILED
    return 0


def _tell(what: dict[str, object]) -> None:
    print(json.dumps(what), flush=True)


if __name__ == "__main__":
    raise SystemExit(main())
