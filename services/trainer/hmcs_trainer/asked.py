"""What a question may ask for: names that are checked, files that lie in the trainer's own folders.

Any process on the bus may ask. Its question is data: it becomes a `Job`, never words of a command
line, and never a path outside the folders that the trainer was given.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from hmcs.bus.keys import KeyNameError, check_name
from hmcs.bus.messages import Train
from hmcs.bus.session import RequestRefusedError
from hmcs.errors import UserError
from hmcs.recognition.registry import DEFAULT, kind_named
from hmcs.recordings.file_rotation import SUFFIX as RECORDING
from hmcs.task import shipped_tasks
from hmcs_trainer.references import is_drawing

MOST_DEMONSTRATIONS = 1_000
"""A model is learned from tens of demonstrations; every one of them is read at once."""
LONGEST_NAME = 4_096
"""Characters of a path, as the operating system has it."""
TASKS = (".yaml", ".yml")
DEMONSTRATIONS = (RECORDING, ".csv")


class Job(BaseModel):
    """A training, as the process that does it reads it on its standard input."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    """Of the model."""
    task: str
    """Name of a task that comes along, or a file."""
    demonstrations: tuple[str, ...]
    """Files, or drawings."""
    recognizer: str
    find_states: bool
    model: Path
    """The file to write."""
    report: Path
    """The page to write beside it."""


def job_of(asked: Train, folder: Path, sources: Sequence[Path]) -> Job:
    """Return the job that is asked for: models go to `folder`, files lie there or in `sources`.

    Raises RequestRefusedError for a name that is none, an unknown recognizer, too many
    demonstrations, or a file that is not there or lies elsewhere.
    """
    try:
        check_name("model", asked.model)
        kind = kind_named(asked.recognizer or DEFAULT)
    except (KeyNameError, UserError) as error:
        raise RequestRefusedError(str(error)) from error
    if not 1 <= len(asked.demonstrations) <= MOST_DEMONSTRATIONS:
        raise RequestRefusedError(
            f"{len(asked.demonstrations)} demonstrations: name 1 to {MOST_DEMONSTRATIONS}"
        )
    places = (folder, *sources)
    shipped = asked.task in shipped_tasks()
    return Job(
        name=asked.model,
        task=asked.task if shipped else str(own_file(asked.task, places, "a task", TASKS)),
        demonstrations=tuple(
            name
            if is_drawing(name)
            else str(own_file(name, places, "a demonstration", DEMONSTRATIONS))
            for name in asked.demonstrations
        ),
        recognizer=kind.name,
        find_states=asked.find_states,
        model=folder / f"{asked.model}.hmcs",
        report=folder / f"{asked.model}.html",
    )


def own_file(name: str, places: Sequence[Path], what: str, endings: Sequence[str]) -> Path:
    """Return the file of that name, which lies in one of the places, links followed.

    Raises RequestRefusedError where it has none of the endings, or there is none.
    """
    shown = f"{name!r:.200}"
    if len(name) > LONGEST_NAME or not name.endswith(tuple(endings)):
        raise RequestRefusedError(
            f"{shown} is not {what}: name a file that ends in {' or '.join(endings)}"
        )
    roots = [place.resolve() for place in places]
    named = [root for root in roots if root.name == name]
    for candidate in (*(root / name for root in roots), *named, Path(name)):
        try:
            file = candidate.resolve(strict=True)
        except (OSError, RuntimeError, ValueError):
            # Not there, links that lead in a circle, or a null byte.
            continue
        if file.is_file() and any(file.is_relative_to(root) for root in roots):
            return file
    raise RequestRefusedError(
        f"{shown} is no file in the trainer's folders ({', '.join(map(str, roots))}): put it "
        "there, or give the trainer its folder as one of `sources`"
    )
