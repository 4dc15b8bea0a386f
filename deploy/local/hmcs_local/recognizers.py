"""Recognizers as a person reads them: a table of all, or one with its settings."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.text import Text

from hmcs.recognition.registry import RecognizerSpec, setting_values
from hmcs_local.tables import show_table


def show_kinds(kinds: Sequence[RecognizerSpec], console: Console) -> None:
    """Print a row for each kind."""
    rows = [(Text(kind.name, "bold"), Text(kind.source, "dim"), kind.summary) for kind in kinds]
    show_table(console, "", ("recognizer", "source", "what it does"), rows)


def show_kind(kind: RecognizerSpec, console: Console) -> None:
    """Print a kind with its settings and their defaults, as `--set` takes them."""
    console.print(f"{kind.name}: {kind.summary}", soft_wrap=True, highlight=False, markup=False)
    console.print(f"source: {kind.source}", soft_wrap=True, highlight=False, markup=False)
    for name, value in setting_values(kind.settings()):
        console.print(f"  --set {name}={value}", soft_wrap=True, highlight=False, markup=False)
