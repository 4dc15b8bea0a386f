"""`hmcs label`: which part of the task each moment of a recording was, shown and set."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from rich.console import Console
from rich.text import Text

from hmcs.errors import UserError
from hmcs.recordings.labels import (
    how_labeled,
    label_notes,
    labels_of,
    write_labels,
)
from hmcs.recordings.reading import RecordingContent, read
from hmcs.recordings.stretches import (
    NS_PER_S,
    Stretch,
    check_within,
    of_seconds,
    relabeled,
    stretch_text,
)
from hmcs.shown import plain
from hmcs.task import Task
from hmcs.task.values import unknown_name_message
from hmcs_local.tables import show_table

_SET = re.compile(
    r"\s*(?P<begin>\d+(?:\.\d*)?|\.\d+)\s*[-–]\s*(?P<end>\d+(?:\.\d*)?|\.\d+)\s*=(?P<state>.*)"
)


def label_recording(
    file: Path, sets: Sequence[str], *, clear: bool, task: Task | None, console: Console
) -> None:
    """Set labels of a recording, where any are given, and show those that count now.

    Each of `sets` is BEGIN-END=STATE in seconds. Raises UserError for one that is none, or is not
    within the recording, and with `task` for any label that is no state of it; nothing is written
    then.
    """
    content = read(file)
    labels: Iterable[Stretch] = () if clear else labels_of(content)
    notes = [] if clear else list(label_notes(content))
    for item in sets:
        new = _stretch(item, content)
        labels = relabeled(labels, new)
    labels = tuple(labels)
    if task is not None:
        _check_names(task, labels, content)
    if sets or clear:
        aside = write_labels(content, labels)
        notes = [] if aside is None else [f"the labels of another recording are in {aside} now"]
    _show(content, labels, console)
    for note in notes:
        console.print(f"note: {plain(note)}", highlight=False, markup=False)


def _stretch(item: str, content: RecordingContent) -> Stretch:
    match = _SET.fullmatch(item)
    if match is None:
        raise UserError(f"--set {item}: write BEGIN-END=STATE in seconds, e.g. 1.2-3.9=take")
    (stretch,) = of_seconds(
        [float(match["begin"])], [float(match["end"])], [match["state"]], content.first_ns
    )
    check_within([stretch], content.first_ns, content.last_ns)
    return stretch


def _check_names(task: Task, labels: Iterable[Stretch], content: RecordingContent) -> None:
    known = {
        name
        for state in task.states
        for name in (
            *([state.name] if len(state.gestemes) == 1 else []),
            *(f"{state.name}/{gesteme}" for gesteme in state.gestemes),
        )
    }
    wrong = [label for label in labels if label.state not in known]
    if wrong:
        raise UserError(
            "\n".join(
                f"{content.path}: {stretch_text(label, content.first_ns)}: "
                f"{unknown_name_message(f'state of task {task.name}', label.state, known)}"
                for label in wrong
            )
        )


def _show(content: RecordingContent, labels: Sequence[Stretch], console: Console) -> None:
    title = f"{plain(content.path.name)}: {content.duration_s:.1f} s"
    if not labels:
        console.print(Text(f"{title}, no labels: set one by --set BEGIN-END=STATE"))
        return
    how = how_labeled(content)
    rows = []
    for label in labels:
        begin_s, end_s = ((at - content.first_ns) / NS_PER_S for at in label[:2])
        rows.append((f"{begin_s:.3f}", f"{end_s:.3f}", label.state, how))
    show_table(console, title, ("from, s", "to, s", "state", "how"), rows, ("from, s", "to, s"))
