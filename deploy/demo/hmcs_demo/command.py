"""`hmcs demo`: arguments in, one call, exit code out.

The `hmcs` command finds it by the entry-point group `hmcs.commands`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hmcs.errors import UserError


def demo(
    output: Annotated[
        Path, typer.Option(metavar="DIR", help="The folder the report is written to.")
    ] = Path("out/demo"),
    seed: Annotated[int, typer.Option(help="Chooses which classifier is killed, and when.")] = 1,
    held_out: Annotated[
        str, typer.Option(metavar="N,N", help="The demonstrations played, and not learned from.")
    ] = "6,7",
) -> None:
    """Run the whole stack on held-out human motion, swap a classifier, write a report."""
    numbers = _numbers(held_out)
    # Imported here: every `hmcs` command loads this module, and only this one needs the rest.
    from hmcs_demo.run import run

    raise typer.Exit(run(output=output, seed=seed, held_out=numbers))


def _numbers(text: str) -> tuple[int, ...]:
    if not all(part.strip().isdecimal() for part in text.split(",")):
        raise UserError(f"--held-out {text}: write numbers with commas between them, e.g. 6,7")
    return tuple(int(part) for part in text.split(","))
