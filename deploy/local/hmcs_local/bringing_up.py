"""What `hmcs up` was asked for, turned into which services run and with which settings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

from hmcs.errors import UserError
from hmcs.recognition.registry import DEFAULT
from hmcs.task import Task, load_task
from hmcs_input_device.automatic import AUTO
from hmcs_input_device.played import BUILT_IN
from hmcs_input_device.sources import check_source
from hmcs_local.compose import StackSpec
from hmcs_local.own_task import PAGE, Arrangement, arranged, input_environment, own_task

DEMO = "human-shapes"
"""The task that compose.yaml teaches and plays where no other is named."""
_INPUT = "input-device"


class Wanted(NamedTuple):
    """What the user of `hmcs up` asked for."""

    task: str | None = None
    """None: the demo of compose.yaml."""
    demonstrations: tuple[str, ...] = ()
    model: Path | None = None
    source: str | None = None
    """Of the input device; the page for a task of one's own, compose.yaml's for the demo."""
    recognizer: str | None = None
    """Kind that is learned from the demonstrations; the default one where None."""


def task_named(environment: Mapping[str, str]) -> str | None:
    """Return the task that the environment names in place of the demo, if it does."""
    task = environment.get("HMCS_TASK")
    return None if task in (None, "", DEMO) else task


def arrangement_of(
    spec: StackSpec, folder: Path, wanted: Wanted, progress: Callable[[str], None]
) -> Arrangement:
    """Return how the stack runs, after learning a model where demonstrations are given.

    Models go to `models` in `folder`, as recordings to `recordings`; `progress` gets a line at a
    time. Raises UserError for what does not go together, and as training and reading a task do.
    """
    _check(wanted)
    models, recordings = (folder.resolve() / name for name in ("models", "recordings"))
    if wanted.task is None:
        source = wanted.source
        changed = {} if source is None else {_INPUT: _demo_input(source, models)}
        return Arrangement(spec.usual, changed)
    task = load_task(wanted.task)
    models.mkdir(parents=True, exist_ok=True)
    model = wanted.model or _learned(wanted, task, models, progress)
    own = own_task(
        wanted.task,
        task,
        model=model,
        source=wanted.source or PAGE,
        demonstrations=wanted.demonstrations,
    )
    return arranged(own, spec, models, recordings)


def _check(wanted: Wanted) -> None:
    if wanted.source is not None:
        check_source(wanted.source, (*BUILT_IN, AUTO))
    if wanted.task is None:
        for option, value in (
            ("--model", wanted.model),
            ("--recognizer", wanted.recognizer),
        ):
            if value is not None:
                raise UserError(f"{option}: name the task it is of, `hmcs up TASK {option} …`")
    if wanted.model is not None and wanted.demonstrations:
        raise UserError("--model and demonstrations: give the model, or what to learn one from")
    if wanted.recognizer is not None and not wanted.demonstrations:
        raise UserError(
            "--recognizer: it is learned from demonstrations, and none is given; on the page the "
            "kind is chosen beside *Train*"
        )


def _learned(
    wanted: Wanted, task: Task, models: Path, progress: Callable[[str], None]
) -> Path | None:
    if not wanted.demonstrations:
        return None
    # It brings scikit-learn along, which nobody needs who learns nothing.
    from hmcs_trainer.training import train

    output = models / f"{task.name}.hmcs"
    train(
        task,
        list(wanted.demonstrations),
        output,
        recognizer=wanted.recognizer or DEFAULT,
        report=output.with_suffix(".html"),
        progress=progress,
    )
    return output


def _demo_input(source: str, models: Path) -> dict[str, str | None]:
    """Another source for the demo, with what its one-shot service learns and chains."""
    return input_environment(source, str(models / f"{DEMO}.hmcs"), models / f"{DEMO}.csv")
