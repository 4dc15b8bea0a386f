"""Recognizers as a person reads them: a table of all, or one with its settings."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from hmcs.recognition.registry import RecognizerSpec, setting_values


def show_kinds(kinds: Sequence[RecognizerSpec], console: Console) -> None:
    """Print a row for each kind; where nobody looks, a line of tab-separated fields."""
    if not console.is_terminal:
        for kind in kinds:
            console.print("\t".join((kind.name, kind.summary, kind.source)), soft_wrap=True)
        return
    table = Table("recognizer", "what it does", "source", box=None, pad_edge=False)
    for kind in kinds:
        table.add_row(f"[bold]{kind.name}[/bold]", kind.summary, f"[dim]{kind.source}[/dim]")
    console.print(table)


def show_kind(kind: RecognizerSpec, console: Console) -> None:
    """Print a kind with its settings and their defaults, as `--set` takes them."""
    console.print(f"{kind.name}: {kind.summary}", soft_wrap=True, highlight=False)
    console.print(f"source: {kind.source}", soft_wrap=True, highlight=False)
    for name, value in setting_values(kind.settings()):
        console.print(f"  --set {name}={value}", soft_wrap=True, highlight=False)
