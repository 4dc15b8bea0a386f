"""Files and folders that are there whole or not at all."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def written_whole(target: Path) -> Iterator[Path]:
    """Yield where to write what is to become `target`, beside it.

    It takes its place once the block has ended; where the block raises, nothing is left of it and
    what `target` was before stays. An OSError names `target`.
    """
    unfinished = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        yield unfinished
        unfinished.replace(target)
    except OSError as error:
        # A full disk is reported without a name.
        if error.filename in (None, str(unfinished)):
            error.filename = str(target)
            error.filename2 = None
        raise
    finally:
        unfinished.unlink(missing_ok=True)


@contextmanager
def folder_written_whole(target: Path) -> Iterator[Path]:
    """Yield the folder in which to make what is to become `target`, by the same name.

    It takes its place once the block has ended; where the block raises, nothing is left of it.
    Raises FileExistsError where there is something of that name already.
    """
    if os.path.lexists(target):
        raise FileExistsError(errno.EEXIST, "is there already: name another folder", str(target))
    beside = target.with_name(f".{target.name}.{os.getpid()}.part")
    beside.mkdir(parents=True)
    try:
        yield beside
        (beside / target.name).rename(target)
    finally:
        shutil.rmtree(beside, ignore_errors=True)
