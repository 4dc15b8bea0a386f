"""Recordings by name: here, or where the recorder of `hmcs up` puts them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from difflib import get_close_matches
from pathlib import Path

from hmcs.errors import UserError
from hmcs.recordings.file_rotation import SUFFIX

_MOST_NAMED = 6


def recordings_in(folder: Path) -> Path:
    """Return where the recorder puts recordings, `folder` being that of `hmcs up`."""
    return folder / "recordings"


def check_folder(folder: Path) -> None:
    """Raise UserError where the folder of `hmcs up` can be none; one that is not there may be."""
    there = next(each for each in (folder.absolute(), *folder.absolute().parents) if each.exists())
    if not there.is_dir():
        raise UserError(f"--folder {folder}: {there.name} is no folder: name another one")


def recording_named(name: Path, folder: Path, tell: Callable[[str], None]) -> Path:
    """Return the file of a recording; its ending may be left out.

    A bare name is looked for in the current folder, then where `hmcs up` of `folder` records.
    `tell` is given a line where the file is not `name` itself. Raises UserError where there is
    none, with the names nearest to it, and for a folder that is none.
    """
    check_folder(folder)
    found = found_elsewhere(name, folder) if not name.exists() else name
    if found is None:
        raise UserError(unknown_file_message(name, folder, (SUFFIX,)))
    if found != name:
        tell(f"{name}: {found}")
    return found


def found_elsewhere(name: Path, folder: Path) -> Path | None:
    """Return the recording that a name without ending, or without folder, stands for."""
    named = name.with_name(name.name + SUFFIX) if name.name else name
    places = [named]
    if _is_bare(name):
        places += [recordings_in(folder) / each for each in (name, named)]
    return next((place for place in places if place.is_file()), None)


def unknown_file_message(name: Path, folder: Path, endings: tuple[str, ...]) -> str:
    """Return a sentence that says there is no such file, and which names are near.

    `endings` are those of files that might have been meant.
    """
    places = [name.parent, *([recordings_in(folder)] if _is_bare(name) else [])]
    there = sorted({each for place in places for each in _names(place, endings)})
    near = get_close_matches(name.name, there, n=3) or get_close_matches(name.stem, there, n=3)
    where = f" here or in {places[1]}" if _is_bare(name) else ""
    if near:
        return f"{name}: no such file{where}, did you mean {' or '.join(near)}?"
    if not there:
        return f"{name}: no such file{where}"
    more = ", …" if len(there) > _MOST_NAMED else ""
    return f"{name}: no such file{where} (there are {', '.join(there[:_MOST_NAMED])}{more})"


def _is_bare(name: Path) -> bool:
    return name.parent == Path() and bool(name.name)


def _names(place: Path, endings: tuple[str, ...]) -> Iterator[str]:
    """Yield what files of a folder can be called on the command line."""
    if not place.is_dir():
        return
    for each in place.iterdir():
        if each.name.endswith(endings) and not each.name.startswith("."):
            yield each.name.removesuffix(SUFFIX)
