"""Training: references to demonstrations in, a model file out."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from hmcs.bus.keys import check_name
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import save_model
from hmcs.task import load_task
from hmcs_trainer.references import read_references


def train(
    task: str,
    references: list[str],
    output: str | Path,
    *,
    name: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Model:
    """Learn a model of the task, a shipped one's name or a file, and write it to `output`.

    The model is called `name`, or as the task is. Raises a UserError that says what is wrong with
    the task, a reference, a demonstration or the name.
    """
    loaded = load_task(task)
    if name is not None:
        check_name("model", name)
    progress("reading demonstrations")
    demonstrations = read_references(references, loaded)
    model = learn(loaded, demonstrations, progress=progress)
    return save_model(model._replace(name=name or model.name), output)
