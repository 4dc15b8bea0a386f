"""`hmcs segment`: which part of the task each moment of whole motions was, found afterwards."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from rich.console import Console

from hmcs.errors import UserError
from hmcs.motion.demonstrations import Demonstration
from hmcs.recognition.demonstration_parts import parts_of
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model
from hmcs.recognition.registry import segmentation_of
from hmcs.recordings.csv_labels import write_csv_labels
from hmcs.recordings.demonstrations import stretches_of
from hmcs.recordings.foreign.choices import AS_IT_IS, Choices
from hmcs.recordings.generated_marker import is_unchanged_generated
from hmcs.recordings.labels import labels_beside, write_labels
from hmcs.shown import plain
from hmcs.write_places import check_file_place, check_folder_place
from hmcs_local.tables import show_table
from hmcs_trainer.references import Source, is_drawing, read_sources

UNKNOWN = "(unknown)"
LEAST_STEPS = 2
"""A segment of fewer is no label: nothing can be learned from one step."""
_COLUMNS = ("state", "from, s", "to, s", "probability")


class Segmented(NamedTuple):
    """A demonstration with the segments found in it."""

    rows: tuple[tuple[str, str, str, str], ...]
    """State, from and to in s, probability."""
    labeled: Demonstration
    """With a label for each sample; None in unknown motion and in segments of one step."""
    short: int
    """Segments that are too short to be labels."""


def segment_files(
    references: Iterable[str],
    model_file: Path,
    *,
    out: Path | None,
    anywhere: bool,
    console: Console,
    choices: Choices = AS_IT_IS,
) -> None:
    """Show the segments of each motion and write them as labels, where `out` says where to.

    Raises UserError for a model of a kind without offline segmentation and for a file that labels
    cannot be written to, before any motion is read; and for what is no motion.
    """
    model = load_model(model_file)
    segmentation_of(model, ())
    if out is not None:
        check_folder_place(out.parent, "--out")
    references = list(references)
    targets = [None] * len(references) if out is None else _targets(references, out)
    for reference, target in zip(references, targets, strict=True):
        (source,) = read_sources([reference], model.task, labels_count=False, choices=choices)
        found = [segmented(model, each, anywhere=anywhere) for each in source.demonstrations]
        for each in found:
            shown = f"{each.labeled.name}: {_length_s(each.labeled):.1f} s"
            if each.rows:
                show_table(console, shown, _COLUMNS, each.rows, _COLUMNS[1:])
            else:
                console.print(
                    f"{plain(shown)}, no step of {model.task.dead_zone_m:g} m", markup=False
                )
        if target is not None and not source.labels_beside:
            raise UserError(
                f"{reference}: is a recording of another program: labels are not written beside "
                "it; make CSV files of it by `hmcs import`, and segment those"
            )
        if target is not None:
            _write(source, [each.labeled for each in found], target)
            console.print(f"labels written to {plain(str(target))}", markup=False, highlight=False)
            short = sum(each.short for each in found)
            if short:
                console.print(f"note: {short} too short to be a label, of one step each, left out")


def segmented(model: Model, demonstration: Demonstration, *, anywhere: bool) -> Segmented:
    """Return the segments of a whole demonstration; labels that it has do not count."""
    states: list[str | None] = [None] * len(demonstration.positions)
    rows, short = [], 0
    for label, begin, end, steps, probability in parts_of(model, demonstration, anywhere=anywhere):
        kept = label if steps >= LEAST_STEPS else None
        short += kept != label
        states[begin : end + 1] = [kept] * (end + 1 - begin)
        begin_s, end_s = (f"{demonstration.time_s[sample]:.3f}" for sample in (begin, end))
        rows.append((label or UNKNOWN, begin_s, end_s, f"{probability:.3f}"))
    return Segmented(tuple(rows), demonstration._replace(states=tuple(states)), short)


def _length_s(demonstration: Demonstration) -> float:
    return float(demonstration.time_s[-1] - demonstration.time_s[0])


def _targets(references: Sequence[str], out: Path) -> list[Path]:
    """Where the labels of each file go: a file for one, a folder for several."""
    for reference in references:
        if is_drawing(reference):
            raise UserError(f"{reference}: is a drawing: its labels have no file to be beside")
    if len(references) == 1 and not out.is_dir():
        targets = [out]
    else:
        targets = [out / labels_beside(Path(reference)).name for reference in references]
    for target in targets:
        if targets.count(target) > 1:
            raise UserError(f"{target}: would have the labels of two files: segment them apart")
        if target.exists() and not is_unchanged_generated(target):
            raise UserError(
                f"{target}: is there already, and nobody says that it was found by hmcs: move it "
                "away, or name another --out"
            )
        check_file_place(target, "--out")
    return targets


def _write(source: Source, labeled: Sequence[Demonstration], target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    content = source.recording
    if content is None:
        write_csv_labels(target, stretches_of(labeled, 0), Path(source.reference), found=True)
    else:
        stretches = stretches_of(labeled, content.first_ns)
        write_labels(content, stretches, found=True, target=target)
