"""Read, judge and take apart what was demonstrated: `import`, `check`, `segment`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hmcs_local.commands.options import (
    Columns,
    Folder,
    Link,
    Marks,
    Times,
    Topics,
    Units,
    Urdf,
    file_choices,
    note,
)
from hmcs_local.stack import DEFAULT_FOLDER
from hmcs_local.tables import screen

FILES = (
    "CSV files, recordings, bags of ROS, LeRobot data sets, folders of them, patterns, "
    "lasa:SHAPE/NUMBER."
)


def segment(
    files: Annotated[list[str], typer.Argument(help=FILES)],
    model: Annotated[
        Path, typer.Option(metavar="FILE", help="A model of a recognizer that segments offline.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Write labels as `hmcs train` reads them, NAME.labels.csv beside NAME; a folder "
            "for several files.",
        ),
    ] = None,
    anywhere: Annotated[
        bool, typer.Option("--anywhere", help="The motion may begin in any state of the task.")
    ] = False,
    topics: Topics = None,
    columns: Columns = "",
    units: Units = None,
    time: Times = "",
    urdf: Urdf = None,
    link: Link = "",
    marks: Marks = "",
    folder: Folder = DEFAULT_FOLDER,
) -> None:
    """Find the segments of whole motions: which part of the task each moment was.

    What came after a moment counts as well as what came before. The probability is that of the
    state, all of the motion given, in the mean over the segment.
    """
    from hmcs_local.demonstration_files import expanded
    from hmcs_local.segmenting import segment_files

    choices = file_choices(topics, columns, units, time, urdf, link, marks)
    segment_files(
        expanded(files, folder, note),
        model,
        out=out,
        anywhere=anywhere,
        console=screen(),
        choices=choices,
    )


def check(
    files: Annotated[list[str], typer.Argument(help=FILES)],
    task: Annotated[
        str, typer.Option(metavar="TASK", help="A shipped task's name or a task file, if known.")
    ] = "",
    topics: Topics = None,
    columns: Columns = "",
    units: Units = None,
    time: Times = "",
    urdf: Urdf = None,
    link: Link = "",
    marks: Marks = "",
    folder: Folder = DEFAULT_FOLDER,
) -> None:
    """Judge demonstrations: units, rate, length, extent, workspace, states, and what to do.

    The exit code is 2 where `hmcs train` would refuse one.
    """
    from hmcs_local.checking import show_check
    from hmcs_local.demonstration_files import expanded

    choices = file_choices(topics, columns, units, time, urdf, link, marks)
    named = expanded(files, folder, note)
    raise typer.Exit(0 if show_check(named, task, screen(), choices) else 2)


def import_files(
    sources: Annotated[list[str], typer.Argument(help=FILES)],
    to: Annotated[
        Path,
        typer.Option(metavar="CSV|DIR", help="A file for one demonstration; a folder for several."),
    ],
    topics: Topics = None,
    columns: Columns = "",
    units: Units = None,
    time: Times = "",
    urdf: Urdf = None,
    link: Link = "",
    marks: Marks = "",
    folder: Folder = DEFAULT_FOLDER,
) -> None:
    """Make CSV files, as `hmcs train` reads them, of what other programs recorded.

    Bags of ROS 1 and 2, MCAP files, LeRobot data sets, CSV files with other columns. What is taken
    for what is said on stderr. Files that are there already are not replaced.
    """
    from hmcs_local.demonstration_files import expanded
    from hmcs_local.importing import import_as_csv

    choices = file_choices(topics, columns, units, time, urdf, link, marks)
    for taken in import_as_csv(expanded(sources, folder, note), to, choices, typer.echo):
        note(taken)
