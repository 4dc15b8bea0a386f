"""Judge and take apart what was demonstrated: `check`, `segment`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

FILES = "CSV files, MCAP recordings, folders of them, patterns, lasa:SHAPE/NUMBER."


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
) -> None:
    """Find the segments of whole motions: which part of the task each moment was.

    What came after a moment counts as well as what came before. The probability is that of the
    state, all of the motion given, in the mean over the segment.
    """
    from hmcs_local.demonstration_files import expanded
    from hmcs_local.segmenting import segment_files

    segment_files(expanded(files), model, out=out, anywhere=anywhere, console=Console())


def check(
    files: Annotated[list[str], typer.Argument(help=FILES)],
    task: Annotated[
        str, typer.Option(metavar="TASK", help="A shipped task's name or a task file, if known.")
    ] = "",
) -> None:
    """Judge demonstrations: units, rate, length, extent, workspace, states, and what to do.

    The exit code is 2 where `hmcs train` would refuse one.
    """
    from hmcs_local.checking import show_check
    from hmcs_local.demonstration_files import expanded

    raise typer.Exit(0 if show_check(expanded(files), task, Console()) else 2)
