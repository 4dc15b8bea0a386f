"""The laboratory's command line; `hmcs study` and `hmcs figures` pass through to it."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from hmcs.errors import UserError
from hmcs.task.values import unknown_name_message
from hmcs.write_places import check_file_place
from hmcs_laboratory.report import as_json, as_table, progress_shown, studies_table
from hmcs_laboratory.running import measure
from hmcs_laboratory.studies import STUDIES
from hmcs_laboratory.study import Study, StudySettings

USER_MISTAKE = 2
INTERRUPTED = 130

PICTURES = (".png", ".svg")
"""Endings of pictures that can be drawn."""

_WIDTH = 160
"""Of tables that go to no terminal, characters."""


def find_study(name: str) -> Study[StudySettings]:
    """Return the study of that name; raises UserError naming all where there is none."""
    for study in STUDIES:
        if study.name == name:
            return study
    raise UserError(unknown_name_message("study", name, [study.name for study in STUDIES]))


def list_studies() -> int:
    """Print all studies; return the exit code."""
    _stdout().print(studies_table(STUDIES))
    return 0


def run_study(
    name: str,
    *,
    seed: int = 1,
    trials: int | None = None,
    workers: int | None = None,
    assignments: Sequence[str] = (),
    as_json_line: bool = False,
    cluster: str | None = None,
    picture: Path | None = None,
) -> int:
    """Run a study and print its table, or one line of JSON; return the exit code.

    `assignments` are the settings to change, `NAME=VALUE` each; `picture` is a file to draw the
    result to, of the studies that have a picture. Progress goes to standard error.
    Ctrl-C ends with 130. Raises UserError as `measure` and `Study.settings_from` do.
    """
    study = find_study(name)
    settings = study.settings_from(assignments)
    if picture is not None and not study.picture:
        drawn = ", ".join(each.name for each in STUDIES if each.picture)
        raise UserError(f"--picture: study {name!r} has none; those that have: {drawn}")
    if picture is not None:
        _check_picture(picture)
    console = Console(stderr=True)
    if absent := study.left_out(settings):
        console.print(absent, highlight=False)
    try:
        with progress_shown(console, name, trials or study.trials) as report_progress:
            result = measure(
                study,
                settings,
                seed=seed,
                trials=trials,
                workers=workers,
                cluster=cluster,
                progress=report_progress,
            )
    except KeyboardInterrupt:
        console.print(f"{name}: interrupted")
        return INTERRUPTED
    if picture is not None:
        from hmcs_laboratory.figures.run import draw_study

        draw_study(study, result.rows, picture)
        console.print(f"{picture}: drawn", highlight=False)
    if as_json_line:
        print(as_json(result))
    else:
        _stdout().print(as_table(result, study.table))
    return 0


def run_figures(
    folder: Path,
    *,
    numbers: Sequence[str] = (),
    fast: bool = False,
    seed: int = 1,
    workers: int | None = None,
) -> int:
    """Make the figures of the thesis, or those of these numbers; return the exit code.

    Says on standard output where their page is. Progress goes to standard error where it is a
    terminal. Ctrl-C ends with 130. Raises UserError as `make_figures` does.
    """
    # Drawing takes a second to import, and studies do not need it.
    from hmcs_laboratory.figures.drawing import counted
    from hmcs_laboratory.figures.progress import figures_shown
    from hmcs_laboratory.figures.run import PAGE, make_figures

    console = Console(stderr=True)
    try:
        with figures_shown(console) as report_progress:
            made = make_figures(
                folder,
                numbers=numbers,
                fast=fast,
                seed=seed,
                workers=workers,
                progress=report_progress,
            )
    except KeyboardInterrupt:
        console.print("figures: interrupted")
        return INTERRUPTED
    print(f"{folder / PAGE}: {counted(len(made), 'figure')}, seed {seed}")
    return 0


def numbers_of(only: str) -> list[str]:
    """Return the numbers of figures in a text with commas between them."""
    return [number.strip() for number in only.split(",") if number.strip()]


def main(argv: Sequence[str] | None = None) -> int:
    """Run with these arguments; return the exit code, 2 for a mistake of the user."""
    parser = argparse.ArgumentParser(prog="hmcs_laboratory", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    _add_study(commands.add_parser("study", help="measure methods of recognition"))
    _add_figures(commands.add_parser("figures", help="make the figures of the thesis anew"))
    given = parser.parse_args(argv)
    try:
        return _figures(given) if given.command == "figures" else _study(given, parser)
    except UserError as error:
        print(f"hmcs_laboratory: {error}", file=sys.stderr)
        return USER_MISTAKE


def _check_picture(file: Path) -> None:
    if file.suffix not in PICTURES:
        raise UserError(f"--picture {file}: expected a name that ends in {' or '.join(PICTURES)}")
    check_file_place(file, "--picture")
    if not file.parent.is_dir():
        raise UserError(f"--picture {file}: there is no folder {file.parent}: make it")


def _stdout() -> Console:
    console = Console()
    return console if console.is_terminal else Console(width=_WIDTH)


def _add_study(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", nargs="?", metavar="NAME", help="which study; --list shows all")
    parser.add_argument("--list", action="store_true", help="list the studies and end")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--trials", type=int, metavar="N", help="how many; the study's by default")
    parser.add_argument(
        "--workers", type=int, metavar="N", help="processes; one a processor by default"
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        dest="assignments",
        metavar="NAME=VALUE",
        help="change a setting; may be repeated",
    )
    parser.add_argument("--json", action="store_true", help="print one line of JSON")
    parser.add_argument(
        "--picture", type=Path, metavar="FILE", help="draw the result; .png or .svg"
    )
    parser.add_argument("--cluster", metavar="ADDRESS", help="of a Dask scheduler to run on")


def _study(given: argparse.Namespace, parser: argparse.ArgumentParser) -> int:
    if given.list:
        return list_studies()
    if given.name is None:
        parser.error("name a study, or --list them")
    return run_study(
        given.name,
        seed=given.seed,
        trials=given.trials,
        workers=given.workers,
        assignments=given.assignments,
        as_json_line=given.json,
        cluster=given.cluster,
        picture=given.picture,
    )


def _add_figures(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--fast", action="store_true", help="fewer trials and settings")
    parser.add_argument(
        "--output",
        type=Path,
        default=Path("out/figures"),
        metavar="DIR",
        help="default: out/figures",
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--workers", type=int, metavar="N", help="processes; one a processor by default"
    )
    parser.add_argument(
        "--only", default="", metavar="NUMBERS", help="these alone, e.g. 2.6,4.12; default: all"
    )


def _figures(given: argparse.Namespace) -> int:
    return run_figures(
        given.output,
        numbers=numbers_of(given.only),
        fast=given.fast,
        seed=given.seed,
        workers=given.workers,
    )
