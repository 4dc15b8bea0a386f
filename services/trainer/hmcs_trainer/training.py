"""Training: references to demonstrations in, a model file out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from hmcs.bus.keys import check_name, is_name
from hmcs.errors import UserError
from hmcs.motion.demonstrations import Demonstration
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import check_model, save_model
from hmcs.recognition.registry import DEFAULT, kind_named, settings_of
from hmcs.recognition.segments import LearningError
from hmcs.recognition.selection import choose
from hmcs.recordings.foreign.choices import AS_IT_IS, Choices
from hmcs.task import Task, load_task
from hmcs.write_places import check_file_place
from hmcs_trainer.advice import advice
from hmcs_trainer.finding import check_places, found_states, write_found
from hmcs_trainer.judging import judged
from hmcs_trainer.plausibility import Finding, implausible
from hmcs_trainer.recorded import recording_findings
from hmcs_trainer.references import Source, distinct, read_sources
from hmcs_trainer.report import numbers, write_report
from hmcs_trainer.validation import findings


def checked(
    task: Task, references: Iterable[str], progress: Callable[[str], None]
) -> tuple[int, int]:
    """Return how many demonstrations would be learned from, and how many findings were reported.

    Raises a UserError as `train` does before it learns anything.
    """
    sources, noted = _read(task, references, find_states=False)
    demonstrations = _shown(sources)
    noted += findings(task, demonstrations)
    for finding in noted:
        if not finding.serious:
            progress(finding.text)
    refuse([finding for finding in noted if finding.serious])
    return len(demonstrations), len(noted)


def refuse(serious: Sequence[Finding]) -> None:
    """Raise LearningError with all of these findings; nothing where there is none."""
    if not serious:
        return
    hint = ". With --accept-implausible `hmcs train` learns from it all the same"
    end = hint if all(finding.may_be_accepted for finding in serious) else ""
    raise LearningError(
        "; ".join(finding.text for finding in serious) + end,
        "; ".join(finding.unquoted or finding.text for finding in serious) + end,
    )


def sound(learned: Callable[[], Model]) -> Model:
    """Return the model that is learned, if it is one.

    Raises LearningError where its numbers are none, or there is no way to compute them: settings
    may have any value.
    """
    try:
        model = learned()
        check_model(model)
    except UserError:
        raise
    except (ArithmeticError, LookupError, MemoryError, ValueError) as error:
        raise LearningError(
            f"no model can be learned so: {error or type(error).__name__}; look at the "
            "demonstrations and the settings of the recognizer"
        ) from error
    return model


def train(
    task: str | Task,
    references: Iterable[str],
    output: str | Path,
    *,
    name: str | None = None,
    recognizer: str = DEFAULT,
    settings: Mapping[str, str] | None = None,
    choices: Mapping[str, Sequence[str]] | None = None,
    seed: int = 0,
    find_states: bool = False,
    report: str | Path | None = None,
    accept_implausible: bool = False,
    choices_of_files: Choices = AS_IT_IS,
    progress: Callable[[str], None] = lambda _: None,
    fits: Callable[[int, int], None] = lambda _done, _all: None,
) -> Model:
    """Learn a model of a task, also by a shipped one's name or a file, and write it to `output`.

    The model is called `name`, or as the task is. `recognizer` is the kind to learn for, with
    `settings` of its own as text; of `choices` the best by held-out likelihood is taken, `fits` is
    given how many of all fits are done. With `report` a page is written that says what the model is
    worth: each demonstration, or eight of many, is recognized by a model of the others. What is
    random is drawn with `seed`. With `find_states` gestemes and states are found in the motion,
    whatever labels it has: they are written as a task beside the model, with the ending .yaml, and
    as labels beside each file; that task is called `name`, or as the model's file. Demonstrations
    that no hand made are refused unless `accept_implausible`; those that are given twice count
    once. `choices_of_files` say how files of other programs are read. `references` are asked for
    when all else has been checked. Raises a UserError that says what is wrong with the task, a
    reference, a demonstration, the name, the recognizer or a setting.
    """
    if name is not None:
        check_name("model", name)
    _check_choices(recognizer, settings or {}, choices or {})
    check_file_place(Path(output), "--output")
    if report is not None:
        check_file_place(Path(report), "the report")
    loaded = task if isinstance(task, Task) else load_task(task)
    progress("reading demonstrations")
    sources, noted = _read(loaded, references, choices_of_files, find_states=find_states)
    found, task_file = None, Path(output).with_suffix(".yaml")
    if find_states:
        check_places(sources, task_file)
        if not accept_implausible:
            refuse([f for d in _shown(sources) for f in implausible(loaded, d) if f.serious])
        found = found_states(loaded, sources, _name_of_found(name, task_file, loaded))
        loaded, sources = found.task, list(found.sources)
        noted += [Finding(False, sentence) for sentence in found.findings]
    demonstrations = _shown(sources)
    noted += findings(loaded, demonstrations)
    refused = [f for f in noted if f.serious and not (accept_implausible and f.may_be_accepted)]
    for finding in noted:
        if finding not in refused:
            progress(finding.text)
    refuse(refused)
    if choices:
        selection = choose(
            loaded,
            demonstrations,
            choices,
            recognizer=recognizer,
            given=settings,
            seed=seed,
            progress=fits,
        )
        for tried in selection.judged:
            values = " ".join(f"{name}={value}" for name, value in tried.chosen.items())
            progress(f"{tried.log_probability:+.4f} ± {tried.spread:.4f} nats a step: {values}")
        chosen = selection.settings
    else:
        chosen = settings_of(kind_named(recognizer), settings or {})
    model = sound(
        lambda: learn(
            loaded,
            demonstrations,
            chosen,
            recognizer=recognizer,
            rng=np.random.default_rng(seed),
            progress=progress,
        )
    )
    if found is not None:
        for sentence in write_found(found, task_file):
            progress(sentence)
    saved = save_model(model._replace(name=name or model.name), output)
    if report is not None:
        progress("judging")
        left_out = judged(loaded, demonstrations, chosen, recognizer, fits)
        write_report(Path(report), saved, left_out, advice(saved, left_out), noted)
        progress(
            numbers(left_out) if found is None else f"{found.findings[0]}; {numbers(left_out)}"
        )
    return saved


def _read(
    task: Task, references: Iterable[str], files: Choices = AS_IT_IS, *, find_states: bool
) -> tuple[list[Source], list[Finding]]:
    """What the references name, each demonstration once, and what should be known of it."""
    sources, doubled = distinct(
        read_sources(references, task, labels_count=not find_states, choices=files)
    )
    noted = [Finding(False, sentence) for sentence in doubled]
    for source in sources:
        noted += [Finding(False, note) for note in source.notes]
        if source.recording is not None:
            noted += recording_findings(task, source.recording)
    return sources, noted


def _check_choices(
    recognizer: str, settings: Mapping[str, str], choices: Mapping[str, Sequence[str]]
) -> None:
    """Raise UserError for an unknown recognizer, a setting that it has not, or no value of it."""
    kind = kind_named(recognizer)
    settings_of(kind, settings)
    for name, values in choices.items():
        for value in values:
            settings_of(kind, {**settings, name: value})


def _name_of_found(name: str | None, task_file: Path, template: Task) -> str:
    """The name of the task that is found: its model's, else its file's, where that can be one."""
    stem = task_file.stem
    return name or (stem if is_name(stem) else template.name)


def _shown(sources: Sequence[Source]) -> list[Demonstration]:
    return [each for source in sources for each in source.demonstrations]
