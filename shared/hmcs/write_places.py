"""Whether something can be written somewhere, asked before the work that makes it."""

from __future__ import annotations

import os
from pathlib import Path

from hmcs.errors import UserError


def check_file_place(target: Path, option: str) -> None:
    """Raise UserError where a file cannot be written; folders that are missing are no hindrance.

    `option` is the one that named it, e.g. `--output`.
    """
    if target.is_dir() or not target.name:
        raise UserError(f"{option} {target}: is a folder: name a file in it")
    if target.exists() and not target.is_file():
        raise UserError(f"{option} {target}: is no file: name another one")
    check_folder_place(target.parent, option)


def check_new_folder_place(target: Path, option: str) -> None:
    """Raise UserError where a folder is there already, or cannot be made."""
    if os.path.lexists(target):
        raise UserError(f"{option} {target}: is there already: name another folder")
    check_folder_place(target.parent, option)


def check_folder_place(folder: Path, option: str) -> None:
    """Raise UserError where nothing can be written into a folder, or it cannot be made.

    `option` is the one that named it, e.g. `--out`.
    """
    there = folder
    while not os.path.lexists(there) and there != there.parent:
        there = there.parent
    if not there.is_dir():
        raise UserError(f"{option}: {there}: is no folder: name another place")
    if not os.access(there, os.W_OK | os.X_OK):
        raise UserError(f"{option}: {there}: may not be written to: name another place")
