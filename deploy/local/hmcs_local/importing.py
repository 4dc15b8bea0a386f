"""`hmcs import`: demonstrations that other programs recorded, as CSV files of our own."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from hmcs.errors import UserError
from hmcs.motion.demonstrations import Demonstration, write_csv
from hmcs.recordings.foreign.choices import Choices
from hmcs.shown import plain
from hmcs.whole_files import written_whole
from hmcs.write_places import check_file_place, check_folder_place
from hmcs_trainer.references import is_drawing, read_sources

_CSV = ".csv"
_LONGEST_NAME = 100
_LONGEST_NOTE = 4000
_ENDING = re.compile(r"\.(csv|bag|db3|mcap)$", re.IGNORECASE)
_NOT_IN_NAMES = re.compile(r"[^A-Za-z0-9._-]")


def import_as_csv(
    references: Iterable[str], to: Path, choices: Choices, progress: Callable[[str], None]
) -> Iterator[str]:
    """Write each demonstration as a CSV file; yield what was taken for what.

    `to` is a file where its name ends in .csv, which takes one demonstration, else a folder.
    `progress` is given each file. Raises UserError where a place is taken or cannot be written to,
    before anything is read where that is known, and for what is no demonstration.
    """
    one = to.suffix.lower() == _CSV and not to.is_dir()
    if one:
        check_file_place(to, "--to")
        _check_free(to)
    else:
        check_folder_place(to, "--to")
    references = list(references)
    for reference in references:
        if is_drawing(reference):
            raise UserError(f"{reference}: is a drawing, which `hmcs train` reads as it is")
    shown = list[Demonstration]()
    for source in read_sources(references, None, choices=choices):
        yield from (plain(note, _LONGEST_NOTE) for note in source.notes)
        shown += source.demonstrations
    if one and len(shown) > 1:
        raise UserError(f"--to {to}: there are {len(shown)} demonstrations: name a folder for them")
    targets = [to] if one else [to / name for name in _names([each.name for each in shown])]
    for target in targets:
        _check_free(target)
    for demonstration, target in zip(shown, targets, strict=True):
        target.parent.mkdir(parents=True, exist_ok=True)
        with written_whole(target) as unfinished:
            write_csv(unfinished, demonstration)
        labels = ", ".join(dict.fromkeys(filter(None, demonstration.states))) or "no labels"
        progress(
            f"{target}: {len(demonstration.time_s)} samples, "
            f"{demonstration.time_s[-1] - demonstration.time_s[0]:.1f} s, {plain(labels)}"
        )


def _check_free(target: Path) -> None:
    if target.exists():
        raise UserError(f"{target}: is there already: move it away, or name another --to")


def _names(wanted: Sequence[str]) -> Iterator[str]:
    """Yield a file's name for each demonstration, each another one."""
    taken = set[str]()
    for each in wanted:
        stem = _ENDING.sub("", each.rpartition("/")[2])
        base = _NOT_IN_NAMES.sub("-", stem).strip(".")[:_LONGEST_NAME] or "demonstration"
        name, number = base, 1
        # Some file systems do not tell capitals from small letters.
        while name.lower() in taken:
            number += 1
            name = f"{base}-{number}"
        taken.add(name.lower())
        yield name + _CSV
