"""Which models were deployed in the folder of an `hmcs up`, and which was to be."""

from __future__ import annotations

from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from hmcs.errors import UserError
from hmcs.whole_files import written_whole


class DeployError(UserError):
    """A model that was not activated; what was active is active still."""


class Deployed(BaseModel):
    """A model that was active, and where it came from."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    model: str
    path: str = ""
    """Of its file; empty where it was not deployed but part of the stack."""
    instance: str = ""
    """Of the recognizer that runs it; empty where it is part of the stack."""


class History(BaseModel):
    """What was deployed in a folder, oldest first; the last one is active."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    deployed: tuple[Deployed, ...] = ()
    shadow: Deployed | None = None
    """A newcomer that was started and has neither taken over nor been stopped yet."""


def read_history(folder: Path) -> History:
    """Return what was deployed in the folder of `hmcs up`.

    Raises DeployError where the file that says so cannot be understood.
    """
    file = _history_file(folder)
    if not file.is_file():
        return History()
    try:
        return History.model_validate_json(file.read_text(encoding="utf-8"))
    except (ValidationError, OSError) as error:
        raise DeployError(f"{file}: cannot be understood, remove it: {error}") from None


def write_history(folder: Path, history: History) -> None:
    """Write what was deployed, whole or not at all; raises DeployError where it cannot be."""
    file = _history_file(folder)
    try:
        with written_whole(file) as unfinished:
            unfinished.write_text(history.model_dump_json(indent=2), encoding="utf-8")
    except OSError as error:
        raise DeployError(f"{file}: cannot be written: {error.strerror or error}") from error


def _history_file(folder: Path) -> Path:
    return folder / "deployed.json"
