"""Models that another host of the cell has: asked for over the bus, validated, kept as files."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from hmcs.bus.keys import is_name
from hmcs.bus.messages import ModelFile, ModelQuestion
from hmcs.bus.session import Bus
from hmcs.bus.verbs import MODEL_FILE
from hmcs.errors import UserError
from hmcs.recognition.model_file import ModelFileError, load_model
from hmcs.whole_files import written_whole

ANSWER_WITHIN_S = 10.0


def fetch_models(bus: Bus, files: Iterable[Path]) -> list[str]:
    """Write each model file, named as its model, from a process that has that model loaded.

    Returns a line for each. Raises UserError where nobody has a model, what came is none, or it
    cannot be written. Signatures do not come along.
    """
    return [_fetched(bus, file) for file in files]


def _fetched(bus: Bus, file: Path) -> str:
    name = file.stem
    question = ModelQuestion(model=name) if is_name(name) else None
    answers = [] if question is None else MODEL_FILE.ask(bus, question, timeout_s=ANSWER_WITHIN_S)
    if not answers:
        raise UserError(
            f"{file}: no such model file, and no fixture controller of cell "
            f"{bus.settings.cell} on {bus.settings.router} has a model {name!r}: start the one "
            "that has it first, or copy the file here"
        )
    source = answers[0].envelope.source.instance
    _write(answers[0].body, file, source)
    return f"{file}: model {name} {answers[0].body.model_hash}, from {source}"


def _write(answer: ModelFile, file: Path, source: str) -> None:
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with written_whole(file) as written:
            written.write_bytes(answer.content)
            model = load_model(written)
            if model.name != file.stem:
                raise ModelFileError(f"{source} has sent the model {model.name!r}")
    except ModelFileError as error:
        raise UserError(f"{file}: {error}") from error
    except OSError as error:
        raise UserError(f"{file}: cannot be written: {error.strerror}") from error
