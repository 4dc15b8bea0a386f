"""Recordings again, in process: the same steps through the same or another recognizer."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple, cast

from hmcs.bus.keys import recognizer_in
from hmcs.bus.messages import Belief, Evidence, Step
from hmcs.recognition.layered import LayeredRecognizer, Layers, Precision
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model
from hmcs.recognition.recognizer import Guarded, Recognizer
from hmcs.recognition.recognizers import recognizer_of
from hmcs.recordings.labels import labels_of
from hmcs.recordings.reading import RecordingContent, RecordingError
from hmcs.recordings.stretches import Stretch
from hmcs.translation import belief_message, step_of


class Believed(NamedTuple):
    """One step, and what is and was believed after it."""

    log_ns: int
    clock: str
    step: int
    sample: int | None
    """Number of the operator's sample that completed the step; None where it is not told."""
    replayed: Belief
    recorded: Belief | None
    """Of the recognizer compared with; None where it said nothing of this step."""
    label: str | None
    """The state it truly was, where the recording has labels."""


class Replay(NamedTuple):
    """A recording through a recognizer."""

    model: Model
    compared_with: str
    """Name of the recorded recognizer; empty where there is none."""
    beliefs: tuple[Believed, ...]
    spent_s: float
    """Processor time."""
    lasted_s: float
    """From the first to the last step, as recorded."""
    notes: tuple[str, ...]
    """What is to be known besides, a sentence each."""


def kept_model(content: RecordingContent) -> Model:
    """Return the model that is kept with a recording; of several the one the fixture followed.

    Raises RecordingError where there is none, or nobody knows which.
    """
    kept = [file for file in content.attachments if file.endswith(".hmcs")]
    followed = {f"{facts.get('active_model', '')}.hmcs" for facts in content.metadata.values()}
    wanted = kept if len(kept) == 1 else [file for file in kept if file in followed]
    if len(wanted) != 1:
        there = ", ".join(kept) or "none"
        raise RecordingError(
            f"{content.path}: kept with it are the models: {there}; name one with --model FILE"
        )
    with TemporaryDirectory() as folder:
        file = Path(folder) / wanted[0]
        file.write_bytes(content.attachments[wanted[0]])
        return load_model(file)


def replayed(
    content: RecordingContent, model: Model, progress: Callable[[float], None] = lambda _: None
) -> Replay:
    """Return what a model's recognizer believes of a recording; `progress` is told the share done.

    Where the recording has evidence of this very model, evidence is rounded as it was on its way.
    Raises RecordingError where there are no steps, and where labels and recorded beliefs speak of
    no state the model knows.
    """
    steps = list(content.of(Step))
    if not steps:
        raise RecordingError(
            f"{content.path}: has no steps: the hand did not move, or it was cut off before"
        )
    name, recorded = _recorded(content, model)
    precision = _precision(content, model)
    labels = labels_of(content)
    strangers = _strangers(content, model, recorded, labels)
    beliefs: list[Believed] = []
    clock, recognizer, expected, label = "", None, -1, 0
    anew, missing = 0, 0
    began_s = time.process_time()
    for number, (logged, envelope, step) in enumerate(steps):
        if envelope.source.boot == clock and step.index < expected:
            # It stands there twice: among the steps made before, and as it came.
            continue
        if recognizer is None or envelope.source.boot != clock or step.index != expected:
            if recognizer is not None and envelope.source.boot != clock:
                anew += 1
            elif recognizer is not None:
                missing += step.index - expected
            clock = envelope.source.boot
            recognizer = _recognizer(model, step.index > 0, precision)
        expected = step.index + 1
        recognition = recognizer.step(step_of(step))
        while label < len(labels) and labels[label].end_ns <= logged.log_ns:
            label += 1
        labeled = label < len(labels) and labels[label].begin_ns <= logged.log_ns
        beliefs.append(
            Believed(
                logged.log_ns,
                clock,
                step.index,
                None if envelope.origin is None else envelope.origin.seq,
                belief_message(model, recognition, clock),
                recorded.get((clock, step.index)),
                _state_of(labels[label]) if labeled else None,
            )
        )
        progress((number + 1) / len(steps))
    spent_s = time.process_time() - began_s
    lasted_s = (steps[-1][0].log_ns - steps[0][0].log_ns) / 1e9
    notes = (*strangers, *_interruptions(steps[0][2].index, missing, anew))
    return Replay(model, name, tuple(beliefs), spent_s, lasted_s, notes)


def _interruptions(first_step: int, missing: int, anew: int) -> Iterator[str]:
    if first_step:
        yield (
            f"it begins with step {first_step}: what was known from the steps before is not in it, "
            "so that beliefs may differ"
        )
    if missing:
        yield (
            f"{missing} steps are missing: recognition begins anew after each gap, so that beliefs "
            "may differ"
        )
    if anew:
        yield f"the input device was started anew, or another took over, {anew} times"


def _strangers(
    content: RecordingContent,
    model: Model,
    recorded: Mapping[tuple[str, int], Belief],
    labels: Sequence[Stretch],
) -> list[str]:
    """What to tell of states the model does not know; RecordingError where it knows none."""
    said = {
        "the labels": {_state_of(label) for label in labels},
        "the recorded beliefs": {state for b in recorded.values() for state in b.states},
    }
    known = set(model.state_names)
    if any(said.values()) and not any(states & known for states in said.values()):
        there = ", ".join(sorted(set().union(*said.values())))
        raise RecordingError(
            f"{content.path}: is of another task than model {model.name!r}: its states are "
            f"{there}; those of task {model.task.name!r} are {', '.join(model.state_names)}: "
            "choose a model of its task"
        )
    return [
        f"{who} name states that task {model.task.name!r} of model {model.name!r} has not: "
        f"{', '.join(sorted(states - known))}: the task was changed, or is another one"
        for who, states in said.items()
        if states - known
    ]


def _state_of(label: Stretch) -> str:
    """The state a label tells, without the gesteme it may name besides."""
    return label.state.partition("/")[0]


def _recognizer(model: Model, anywhere: bool, precision: Precision) -> Recognizer:
    if isinstance(model.knowledge, Layers):
        return Guarded(LayeredRecognizer(model, anywhere=anywhere, precision=precision))
    return recognizer_of(model, anywhere=anywhere)


def _recorded(content: RecordingContent, model: Model) -> tuple[str, dict[tuple[str, int], Belief]]:
    """The recorded beliefs to compare with: of this very model, else of the one that said most."""
    by_name: dict[str, dict[tuple[str, int], Belief]] = {}
    hashes: dict[str, str] = {}
    for logged, _, belief in content.of(Belief):
        name = recognizer_in(logged.key).model
        by_name.setdefault(name, {})[belief.clock, belief.step] = belief
        hashes[name] = belief.model_hash
    if not by_name:
        return "", {}
    name = max(by_name, key=lambda each: (hashes[each] == model.hash, len(by_name[each])))
    return name, by_name[name]


def _precision(content: RecordingContent, model: Model) -> Precision:
    """That of the classifiers which worked with this model; double where there were none."""
    if not any(
        message.model_hash == model.hash and envelope.source.service == "gesteme_classifier"
        for _, envelope, message in content.of(Evidence)
    ):
        return "float64"
    for name, facts in content.metadata.items():
        if name.startswith("gesteme_classifier/") and "settings" in facts:
            said = json.loads(facts["settings"]).get("precision", "float32")
            return cast(Precision, said)
    return "float32"
