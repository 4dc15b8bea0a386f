"""`hmcs inspect`, `export` and `replay`: recordings as tables on the screen and in files."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
from rich.table import Table

from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model
from hmcs.recordings.exporting import Format, export
from hmcs.recordings.inspection import Inspection, inspected
from hmcs.recordings.labels import labels_of
from hmcs.recordings.reading import RecordingContent, read
from hmcs.recordings.replaying import Comparison, compared, kept_model, replayed, rows_of
from hmcs.whole_files import written_whole


def show_inspection(file: Path, console: Console, *, as_json: bool) -> bool:
    """Show what is in a recording; return whether nothing is missing."""
    content = read(file)
    inspection = inspected(content)
    if as_json:
        console.print(json.dumps(_told(content, inspection)), soft_wrap=True, highlight=False)
        return not inspection.problems
    table = Table(title=f"{file.name}: {inspection.duration_s:.1f} s", title_justify="left")
    for name in ("key", "message", "messages", "Hz", "lost", "longest gap, s"):
        table.add_column(name, justify="left" if name in ("key", "message") else "right")
    for channel in inspection.channels:
        table.add_row(
            "/".join(channel.key.split("/")[3:]),
            channel.schema,
            str(channel.messages),
            f"{channel.rate_hz:.1f}",
            str(channel.lost),
            f"{channel.longest_gap_s:.3f}",
        )
    console.print(table)
    for name, facts in sorted(content.metadata.items()):
        shown = {key: value for key, value in facts.items() if key != "settings" and value}
        console.print(f"{name}: " + ", ".join(f"{key} {value}" for key, value in shown.items()))
    labels = labels_of(content)
    if labels:
        console.print(f"labels: {', '.join(label.state for label in labels)}")
    if content.attachments:
        console.print(f"kept with it: {', '.join(sorted(content.attachments))}")
    for problem in inspection.problems:
        console.print(f"missing: {problem}")
    return not inspection.problems


def export_recording(file: Path, folder: Path, form: Format, console: Console) -> None:
    """Write a file for every channel of a recording."""
    for written in export(read(file), folder, form):
        console.print(str(written))


def replay_in_process(
    file: Path, model: Path | None, out: Path | None, console: Console, *, as_json: bool
) -> Comparison:
    """Replay a recording, show how it stands to what was recorded, and write the steps to `out`."""
    content = read(file)
    chosen = kept_model(content) if model is None else load_model(model)
    with Progress(
        TextColumn("replaying"), BarColumn(), MofNCompleteColumn(), console=Console(stderr=True)
    ) as progress:
        task = progress.add_task("", total=100)
        replay = replayed(content, chosen, _whole_percents(progress, task))
    comparison = compared(replay)
    if out is not None:
        rows = list(rows_of(replay))
        with (
            written_whole(out) as unfinished,
            unfinished.open("w", encoding="utf-8", newline="") as stream,
        ):
            writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    if as_json:
        told = {"model": chosen.name, "model_hash": chosen.hash, **comparison._asdict()}
        told = {k: None if v != v else v for k, v in told.items()}
        console.print(json.dumps(told), soft_wrap=True, highlight=False)
    else:
        _show(comparison, chosen, replay.compared_with, console)
        if replay.first_step:
            console.print(
                f"it begins with step {replay.first_step}: what was known from the steps before "
                "is not in it, so that beliefs may differ"
            )
    return comparison


def replay_live(file: Path, rate: float, task: str, router: str, cell: str) -> int:
    """Be the input device of a cell that plays a recording; return its exit code."""
    read(file)
    command = [sys.executable, "-m", "hmcs_input_device", "--source", "recording"]
    command += ["--demonstration", str(file), "--speed", str(rate), "--task", task]
    command += ["--router", router, "--cell", cell]
    try:
        return subprocess.run(command, check=False).returncode
    except KeyboardInterrupt:
        return 0


def _show(comparison: Comparison, model: Model, other: str, console: Console) -> None:
    console.print(
        f"{model.name} {model.hash}: {comparison.steps} steps, "
        f"{comparison.times_real:.0f} times as fast as they were made"
    )
    if comparison.compared:
        console.print(
            f"beside the recorded {other}: the same likely state in {comparison.agreement:.1%} of "
            f"{comparison.compared} steps, the very same belief in {comparison.same_bits}"
        )
        if comparison.later_steps == comparison.later_steps:
            console.print(f"changes of state come {comparison.later_steps:+.0f} steps later")
    else:
        console.print("no recorded belief to compare with")
    if comparison.replayed_right == comparison.replayed_right:
        console.print(
            f"right by the labels: {comparison.replayed_right:.1%} of the steps, recorded "
            f"{comparison.recorded_right:.1%}"
        )


def _told(content: RecordingContent, inspection: Inspection) -> dict[str, object]:
    return {
        "file": str(content.path),
        "whole": content.whole,
        "duration_s": inspection.duration_s,
        "channels": [channel._asdict() for channel in inspection.channels],
        "metadata": content.metadata,
        "attachments": sorted(content.attachments),
        "labels": [label.state for label in labels_of(content)],
        "problems": list(inspection.problems),
    }


def _whole_percents(progress: Progress, task: object) -> Callable[[float], None]:
    def tell(share: float) -> None:
        progress.update(task, completed=int(100 * share))  # type: ignore[arg-type]

    return tell
