"""Training: references to demonstrations in, a model file out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from hmcs.bus.keys import check_name
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import save_model
from hmcs.recognition.recognizers import DEFAULT, kind_named, settings_of
from hmcs.recognition.segments import LearningError
from hmcs.recognition.selection import choose
from hmcs.task import load_task
from hmcs_trainer.advice import advice
from hmcs_trainer.finding import check_places, found_states, write_found
from hmcs_trainer.judging import judged
from hmcs_trainer.recorded import recording_findings
from hmcs_trainer.references import read_sources
from hmcs_trainer.report import numbers, write_report
from hmcs_trainer.validation import Finding, findings


def train(
    task: str,
    references: list[str],
    output: str | Path,
    *,
    name: str | None = None,
    recognizer: str = DEFAULT,
    settings: Mapping[str, str] | None = None,
    choices: Mapping[str, Sequence[str]] | None = None,
    seed: int = 0,
    find_states: bool = False,
    report: str | Path | None = None,
    progress: Callable[[str], None] = lambda _: None,
    fits: Callable[[int, int], None] = lambda _done, _all: None,
) -> Model:
    """Learn a model of the task, a shipped one's name or a file, and write it to `output`.

    The model is called `name`, or as the task is. `recognizer` is the kind to learn for, with
    `settings` of its own as text; of `choices` the best by held-out likelihood is taken, `fits` is
    told how many of all fits are done. With `report` a page is written that tells what the model is
    worth: each demonstration, or eight of many, is recognized by a model of the others. What is
    random is drawn with `seed`. With `find_states` gestemes and states are found in the motion,
    whatever labels it has: they are written as a task beside the model, with the ending .yaml, and
    as labels beside each recording. Raises a UserError that says what is wrong with the task, a
    reference, a demonstration, the name, the recognizer or a setting.
    """
    loaded = load_task(task)
    if name is not None:
        check_name("model", name)
    progress("reading demonstrations")
    sources = read_sources(references, loaded, labels_count=not find_states)
    noted = [
        finding
        for source in sources
        if source.recording is not None
        for finding in recording_findings(loaded, source.recording)
    ]
    found, task_file = None, Path(output).with_suffix(".yaml")
    if find_states:
        check_places(sources, task_file)
        found = found_states(loaded, sources)
        loaded, sources = found.task, list(found.sources)
        noted += [Finding(False, sentence) for sentence in found.told]
    demonstrations = [each for source in sources for each in source.demonstrations]
    noted += findings(loaded, demonstrations)
    for finding in noted:
        if not finding.serious:
            progress(finding.text)
    serious = [finding.text for finding in noted if finding.serious]
    if serious:
        raise LearningError("; ".join(serious))
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
    model = learn(
        loaded,
        demonstrations,
        chosen,
        recognizer=recognizer,
        rng=np.random.default_rng(seed),
        progress=progress,
    )
    if found is not None:
        for sentence in write_found(found, task_file):
            progress(sentence)
    saved = save_model(model._replace(name=name or model.name), output)
    if report is not None:
        progress("judging")
        left_out = judged(loaded, demonstrations, chosen, recognizer, fits)
        write_report(Path(report), saved, left_out, advice(saved, left_out), noted)
        progress(numbers(left_out) if found is None else f"{found.told[0]}; {numbers(left_out)}")
    return saved
