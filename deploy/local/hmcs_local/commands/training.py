"""Learn a model, or give it up: `train`, `cancel`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hmcs.bus.config import DEFAULT_ROUTER
from hmcs_local.commands.options import (
    Cell,
    Columns,
    Folder,
    Link,
    Marks,
    Router,
    Secure,
    Times,
    Topics,
    Units,
    Urdf,
    file_choices,
    note,
    setting,
)
from hmcs_local.commands.replies import tell_replies
from hmcs_local.stack import DEFAULT_FOLDER


def train(
    task: Annotated[str, typer.Argument(help="A shipped task's name or a task file.")],
    demonstrations: Annotated[
        list[str],
        typer.Argument(
            help="CSV files, recordings, bags of ROS, LeRobot data sets, folders, patterns, "
            "lasa:SHAPE/NUMBER, lasa:SHAPE/FIRST-LAST."
        ),
    ],
    output: Annotated[Path, typer.Option(metavar="MODEL", help="The model file to write.")],
    name: Annotated[
        str | None, typer.Option(help="The model's name on the bus; the task's by default.")
    ] = None,
    recognizer: Annotated[
        str, typer.Option(metavar="KIND", help="What to learn for; see `hmcs recognizers`.")
    ] = "segment-filter",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="A setting of the recognizer."),
    ] = None,
    choices: Annotated[
        list[str] | None,
        typer.Option(
            "--choose",
            metavar="NAME=A,B,…",
            help="Choose a setting by what it is worth on demonstrations left out.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of what is drawn at random in learning.")] = 0,
    find_states: Annotated[
        bool,
        typer.Option(
            "--find-states",
            help="Find gestemes and states in the motion itself, whatever labels it has.",
        ),
    ] = False,
    report: Annotated[
        bool, typer.Option(help="Write a page beside the model on what it is worth.")
    ] = True,
    accept_implausible: Annotated[
        bool,
        typer.Option(
            "--accept-implausible",
            help="Learn even from what no hand seems to have made: jumps, other units.",
        ),
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
    """Learn a model of a task from demonstrations: CSV files, recordings, or human drawings.

    The page shows how each demonstration is recognized by a model of the others, which states are
    taken for each other, how far demonstrations lay apart, and what would help. States that are
    found stand as labels beside each recording and as a task file, MODEL with the ending .yaml.
    """
    from hmcs_local.demonstration_files import expanded
    from hmcs_local.progress import fits_shown
    from hmcs_trainer.training import train as learn

    files = file_choices(topics, columns, units, time, urdf, link, marks)
    alternatives = {name: value.split(",") for name, value in map(setting, choices or [])}
    with fits_shown(bool(alternatives)) as fits:
        model = learn(
            task,
            expanded(demonstrations, folder, note),
            output,
            name=name,
            recognizer=recognizer,
            settings=dict(map(setting, settings or [])),
            choices=alternatives,
            seed=seed,
            find_states=find_states,
            report=output.with_suffix(".html") if report and output.name else None,
            accept_implausible=accept_implausible,
            choices_of_files=files,
            progress=typer.echo,
            fits=fits,
        )
    typer.echo(f"{output}: model {model.name} for the recognizer {model.recognizer}")


def cancel(router: Router = DEFAULT_ROUTER, cell: Cell = "demo", secure: Secure = None) -> None:
    """Let every trainer of a cell give up what it was asked to train; no model is written.

    The exit code is 0 where each one has done it, else 1.
    """
    from hmcs.bus.messages import Ask
    from hmcs.bus.verbs import CANCEL
    from hmcs_local.asking import ask_everybody
    from hmcs_local.connecting import open_operator

    with open_operator(router, cell, secure) as bus:
        replies = ask_everybody(bus, CANCEL, Ask(), timeout_s=5.0)
    raise typer.Exit(tell_replies(replies))
