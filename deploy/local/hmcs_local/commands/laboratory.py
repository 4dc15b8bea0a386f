"""Measure methods against each other, make the thesis's figures: `study`, `figures`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def study(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="Which study; without it all are listed.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Equal seeds measure the same.")] = 1,
    trials: Annotated[
        int | None, typer.Option(metavar="N", help="How many; the study's own number by default.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(metavar="N", help="Processes; one a processor by default.")
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Change a setting; may be repeated."),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print one line of JSON.")] = False,
    cluster: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Of a Dask scheduler to run on.")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the result; .png or .svg.")
    ] = None,
) -> None:
    """Measure what recognition and assistance are worth: methods side by side on the same data."""
    from hmcs_laboratory.command import list_studies, run_study

    if name is None:
        raise typer.Exit(list_studies())
    raise typer.Exit(
        run_study(
            name,
            seed=seed,
            trials=trials,
            workers=workers,
            assignments=settings or (),
            as_json_line=json,
            cluster=cluster,
            picture=picture,
        )
    )


def figures(
    fast: Annotated[bool, typer.Option("--fast", help="With fewer trials and settings.")] = False,
    output: Annotated[
        Path, typer.Option(metavar="DIR", help="The folder pictures and page are written to.")
    ] = Path("out/figures"),
    seed: Annotated[int, typer.Option(help="Equal seeds make the same figures.")] = 1,
    workers: Annotated[
        int | None, typer.Option(metavar="N", help="Processes; one a processor by default.")
    ] = None,
    only: Annotated[
        str, typer.Option(metavar="NUMBERS", help="These alone, e.g. 2.6,4.12; all if none.")
    ] = "",
) -> None:
    """Make the figures of the thesis anew, with a page on what came out of each."""
    from hmcs_laboratory.command import numbers_of, run_figures

    raise typer.Exit(
        run_figures(output, numbers=numbers_of(only), fast=fast, seed=seed, workers=workers)
    )
