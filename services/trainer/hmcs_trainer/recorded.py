"""What should be known of a recording before anything is learned from it."""

from __future__ import annotations

from collections.abc import Iterator

from hmcs.bus.messages import Motion
from hmcs.recordings.inspection import damages, losses_of, unread
from hmcs.recordings.labels import label_notes
from hmcs.recordings.reading import RecordingContent
from hmcs.task import Task
from hmcs_trainer.plausibility import Finding

_WITH_A_TASK = ("input_device/", "robot/")
"""Prefix of the metadata of processes that work on a task."""


def recording_findings(task: Task | None, content: RecordingContent) -> Iterator[Finding]:
    """Yield what may be wrong with a recording: its end, what was lost, whose task it was."""
    name = content.path.name
    tasks = {
        facts["task"]
        for member, facts in content.metadata.items()
        if member.startswith(_WITH_A_TASK) and facts.get("task")
    }
    own = "" if task is None else task.name
    others = tasks - {own} if own else set[str]()
    for other in sorted(others):
        yield Finding(
            False,
            f"{name}: was recorded with task {other!r}, not {own!r}: see that its labels and "
            "its workspace are those of the task you train for",
        )
    losses = losses_of(content, Motion)
    if losses:
        first = losses[0]
        yield Finding(
            False,
            f"{name}: {sum(loss.messages for loss in losses)} samples of the hand were lost, the "
            f"first {first.messages} of them before {first.at_s:.2f} s: the way is straight there; "
            "leave it out, if that was not meant",
        )
    for sentence in (*damages(content), *unread(content, Motion), *label_notes(content)):
        yield Finding(False, f"{name}: {sentence}")
