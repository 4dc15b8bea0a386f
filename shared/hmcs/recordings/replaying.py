"""Recordings again, in process: the same steps through the same or another recognizer."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple, cast, get_args

from hmcs.bus.keys import KeyNameError, recognizer_in
from hmcs.bus.messages import Belief, Evidence, Step
from hmcs.bus.wire import schema_of
from hmcs.errors import UserError
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model
from hmcs.recognition.recognizer import Precision
from hmcs.recordings.as_live import AsLive
from hmcs.recordings.beliefs import Beliefs, Packed, Packer, StepBeliefs
from hmcs.recordings.inspection import unread
from hmcs.recordings.json_codec import NoMessageError, json_fields
from hmcs.recordings.labels import label_notes, labels_of
from hmcs.recordings.reading import MODEL_SUFFIX, RecordingContent, RecordingError
from hmcs.recordings.stretches import Stretch
from hmcs.shown import plain
from hmcs.translation import belief_message, step_of

MOST_STEPS = 1_000_000
"""That are replayed; they and their beliefs take up to a kilobyte each. A hand in steady motion
makes as many in eleven hours."""


class Replay(NamedTuple):
    """A recording through a recognizer."""

    model: Model
    compared_with: str
    """Name of the recorded recognizer; empty where there is none."""
    beliefs: Sequence[StepBeliefs]
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
    kept = [file for file in content.attachments if file.endswith(MODEL_SUFFIX)]
    followed = {
        f"{facts.get('active_model', '')}{MODEL_SUFFIX}" for facts in content.metadata.values()
    }
    wanted = kept if len(kept) == 1 else [file for file in kept if file in followed]
    if len(wanted) != 1:
        there = ", ".join(plain(file) for file in kept) or "none"
        raise RecordingError(
            f"{content.path}: kept with it are the models: {there}; name one with --model FILE"
        )
    model = content.attachments[wanted[0]]
    with TemporaryDirectory() as folder:
        # The name it is kept by is what somebody wrote, and may lead anywhere.
        file = Path(folder) / f"kept{MODEL_SUFFIX}"
        file.write_bytes(model)
        try:
            return load_model(file)
        except UserError as error:
            why = str(error).replace(f"{file}: ", "")
            raise RecordingError(
                f"{content.path}: the model {plain(wanted[0])} that is kept with it: {why}"
            ) from error


def replayed(
    content: RecordingContent, model: Model, progress: Callable[[float], None] = lambda _: None
) -> Replay:
    """Return what a model's recognizer believes of a recording; `progress` receives the share done.

    Where the recording has evidence of this very model, evidence is rounded as it was on its way,
    and what was missing at a step is missing again. Raises RecordingError where there are no steps
    or more than MOST_STEPS, and where labels and recorded beliefs speak of no state the model
    knows.
    """
    count = content.schemas.get(schema_of(Step), 0)
    if count > MOST_STEPS:
        raise RecordingError(
            f"{content.path}: has {count} steps, more than {MOST_STEPS}: replay a part of it"
        )
    name, recorded = _recorded(content, model)
    labels = labels_of(content)
    strangers = _strangers(content, model, recorded, labels)
    precision = _precision(content, model)
    beliefs, packer = Beliefs(), Packer()
    clock, recognizer, expected, label = "", None, -1, 0
    anew, missing, first_step, first_ns, last_ns = 0, 0, 0, 0, 0
    began_s = time.process_time()
    for number, (logged, envelope, step) in enumerate(content.of(Step)):
        if envelope.source.boot == clock and step.index < expected:
            # It stands there twice: among the steps made before, and as it came.
            continue
        if recognizer is None or envelope.source.boot != clock or step.index != expected:
            if recognizer is None:
                first_step, first_ns = step.index, logged.log_ns
            elif envelope.source.boot != clock:
                anew += 1
            else:
                missing += step.index - expected
            clock = envelope.source.boot
            recognizer = AsLive(model, step.index > 0, precision)
        expected, last_ns = step.index + 1, logged.log_ns
        then = recorded.get((clock, step.index))
        recognition = recognizer.step(step_of(step), _missing(model, then))
        while label < len(labels) and labels[label].end_ns <= logged.log_ns:
            label += 1
        labeled = label < len(labels) and labels[label].begin_ns <= logged.log_ns
        beliefs.add(
            logged.log_ns,
            clock,
            step.index,
            None if envelope.origin is None else envelope.origin.seq,
            packer.pack(belief_message(model, recognition, clock)),
            then,
            _state_of(labels[label]) if labeled else None,
        )
        progress((number + 1) / count)
    if recognizer is None:
        raise RecordingError(
            f"{content.path}: has no steps: the hand did not move, or it was cut off before"
        )
    spent_s = time.process_time() - began_s
    notes = (
        *strangers,
        *_interruptions(first_step, missing, anew),
        *unread(content, Step, Belief),
        *label_notes(content),
    )
    return Replay(model, name, beliefs, spent_s, (last_ns - first_ns) / 1e9, notes)


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
    recorded: Mapping[tuple[str, int], Packed],
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
    """The state a label names, without the gesteme it may name besides."""
    return label.state.partition("/")[0]


def _missing(model: Model, then: Packed | None) -> frozenset[int]:
    """Indices of the gestemes whose evidence this very model lacked live at a step."""
    if then is None or then.model_hash != model.hash:
        return frozenset()
    return frozenset(
        number for number, name in enumerate(model.gesteme_names) if name in then.missing_gestemes
    )


def recognizer_named(key: str) -> str:
    """Return the recognizer whose belief a key is of: its chunk behind `model`.

    Of `…/model/NAME/belief` as of `…/model/NAME/belief/INSTANCE`; empty for any other key.
    """
    try:
        return recognizer_in(key).model
    except KeyNameError:
        return ""


def settings_in(facts: Mapping[str, str]) -> Mapping[str, Any] | None:
    """Return the settings a process reported; None where none are kept that can be read."""
    try:
        return json_fields(facts.get("settings", ""))
    except NoMessageError:
        return None


def _recorded(content: RecordingContent, model: Model) -> tuple[str, dict[tuple[str, int], Packed]]:
    """The recorded beliefs to compare with: of this very model, else of the one that said most."""
    counts: Counter[str] = Counter()
    hashes: dict[str, str] = {}
    for logged, _, belief in content.of(Belief):
        name = recognizer_named(logged.key)
        counts[name] += 1
        hashes[name] = belief.model_hash
    if not counts:
        return "", {}
    name = max(counts, key=lambda each: (hashes[each] == model.hash, counts[each]))
    if counts[name] > 2 * MOST_STEPS:
        raise RecordingError(f"{content.path}: has {counts[name]} beliefs: replay a part of it")
    packer, kept = Packer(), dict[tuple[str, int], Packed]()
    for logged, _, belief in content.of(Belief):
        if recognizer_named(logged.key) != name or not _is_of_states(belief):
            continue
        at = (belief.clock, belief.step)
        # Of several processes that work for a model one may have had all evidence.
        if at not in kept or (kept[at].missing_gestemes and not belief.missing_gestemes):
            kept[at] = packer.pack(belief)
    return name, kept


def _is_of_states(belief: Belief) -> bool:
    """Whether it has states, and a probability for each."""
    return 0 < len(belief.states) == len(belief.probabilities)


def _precision(content: RecordingContent, model: Model) -> Precision:
    """That of the classifiers which worked with this model; double where there were none."""
    if not any(
        message.model_hash == model.hash and envelope.source.service == "gesteme_classifier"
        for _, envelope, message in content.of(Evidence)
    ):
        return "float64"
    for name, facts in content.metadata.items():
        settings = settings_in(facts) if name.startswith("gesteme_classifier/") else None
        if settings is not None and settings.get("precision") in get_args(Precision):
            return cast(Precision, settings["precision"])
    return "float32"
