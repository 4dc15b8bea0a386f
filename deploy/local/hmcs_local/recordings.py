"""`hmcs inspect` and `hmcs export`: recordings as tables on the screen and in files."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from rich.console import Console

from hmcs.errors import UserError
from hmcs.recordings.demonstrations import demonstrations_of
from hmcs.recordings.exporting import Format, export
from hmcs.recordings.foreign.bag_writing import write_bag
from hmcs.recordings.foreign.lerobot_writing import write_data_set
from hmcs.recordings.inspection import Inspection, inspected
from hmcs.recordings.json_codec import readable_as
from hmcs.recordings.labels import label_notes, labels_of
from hmcs.recordings.reading import RecordingContent, read
from hmcs.shown import plain
from hmcs_local.tables import show_table

LONGEST_LINE = 4000
"""Characters of a line; the settings of no process take as many."""
_NUMBERS = ("messages", "Hz", "lost", "longest gap, s")


def show_inspection(file: Path, console: Console, *, as_json: bool) -> bool:
    """Show what is in a recording; return whether nothing is missing."""
    content = read(file)
    inspection = inspected(content)
    problems = (*inspection.problems, *label_notes(content))
    if as_json:
        line = json.dumps(_told(content, inspection, problems))
        console.print(line, soft_wrap=True, highlight=False, markup=False)
        return not problems
    rows = [
        (
            "/".join(channel.key.split("/")[3:]),
            channel.schema,
            str(channel.messages),
            f"{channel.rate_hz:.1f}",
            str(channel.lost),
            f"{channel.longest_gap_s:.3f}",
        )
        for channel in inspection.channels
    ]
    title = f"{file.name}: {inspection.duration_s:.1f} s"
    show_table(console, title, ("key", "message", *_NUMBERS), rows, _NUMBERS)
    for name, facts in sorted(content.metadata.items()):
        shown = {key: value for key, value in facts.items() if key != "settings" and value}
        _say(console, f"{name}: " + ", ".join(f"{key} {value}" for key, value in shown.items()))
    labels = _labels(content)
    if labels:
        _say(console, f"labels: {', '.join(labels)}")
    if content.attachments:
        _say(console, f"kept with it: {', '.join(sorted(content.attachments))}")
    for problem in problems:
        _say(console, f"missing: {problem}")
    return not problems


def export_recording(file: Path, folder: Path, form: Format, console: Console) -> None:
    """Write a file for every channel of a recording; UserError where one cannot be written."""
    content = read(file)
    try:
        for written in export(content, folder, form):
            console.print(str(written), markup=False)
    except OSError as error:
        raise UserError(f"{folder}: cannot be written to: {error.strerror or error}") from error


def export_to_others(
    file: Path, folder: Path, form: Literal["lerobot", "rosbag2"], fps: int, console: Console
) -> None:
    """Write a recording as the folder of a LeRobot data set or of a bag of ROS 2.

    Raises UserError where there is such a folder, or it cannot be written.
    """
    content = read(file)
    try:
        if form == "rosbag2":
            said = f"{write_bag(content, folder)} messages"
        else:
            shown = demonstrations_of(content)
            frames = write_data_set(shown, folder, file.stem, fps=fps)
            said = f"{len(shown)} episode(s), {frames} frames"
    except OSError as error:
        raise UserError(f"{folder}: cannot be written to: {error.strerror or error}") from error
    console.print(f"{folder}: {said}", markup=False)


def _say(console: Console, line: str) -> None:
    """Print a line in which words from the file stand."""
    console.print(plain(line, LONGEST_LINE), markup=False, highlight=False)


def _told(
    content: RecordingContent, inspection: Inspection, problems: Sequence[str]
) -> dict[str, object]:
    return {
        "file": str(content.path),
        "whole": content.whole,
        "duration_s": inspection.duration_s,
        "channels": [channel._asdict() for channel in inspection.channels],
        "metadata": dict(content.metadata),
        "attachments": sorted(content.attachments),
        "labels": _labels(content),
        "problems": list(problems),
    }


def _labels(content: RecordingContent) -> list[str]:
    """The labeled states in order; none where another version of the contract keeps them unread."""
    readable = all(readable_as(schema) is not None for schema in content.schemas)
    return [label.state for label in labels_of(content)] if readable else []
