"""Recordings again, in process: the same steps through the same or another recognizer."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple, cast

import numpy as np

from hmcs.bus.messages import Belief, Evidence, Step
from hmcs.recognition.layered import LayeredRecognizer, Layers, Precision
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model
from hmcs.recognition.recognizer import Guarded, Recognizer
from hmcs.recognition.recognizers import recognizer_of
from hmcs.recognition.scoring import changes
from hmcs.recordings.labels import labels_of
from hmcs.recordings.reading import RecordingContent, RecordingError
from hmcs.translation import belief_message, step_of

COMPARED = ("probabilities", "unknown", "log_likelihood", "mean_log_likelihood", "segment_start")
"""What makes two beliefs the same, bit by bit."""


class Believed(NamedTuple):
    """One step, and what is and was believed after it."""

    log_ns: int
    clock: str
    step: int
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
    first_step: int
    """Of the recording; what a recognizer knew of those before it is not in it."""


class Comparison(NamedTuple):
    """Two recognizers side by side."""

    steps: int
    compared: int
    """Steps both said something of, with all evidence."""
    same_bits: int
    """Of those, with the very same belief; only the same model can have them."""
    agreement: float
    """Share of the compared steps with the same likely state; NaN where there is none."""
    later_steps: float
    """Median of how much later than the recorded one the replayed changes to the same state."""
    replayed_right: float
    """Share of the labeled steps that are right; NaN where the recording has no labels."""
    recorded_right: float
    times_real: float
    """How many times as fast as it happened."""


def kept_model(content: RecordingContent, name: str = "") -> Model:
    """Return the model that is kept with a recording, of that name where there are several.

    Raises RecordingError where there is none, or not of that name.
    """
    kept = [file for file in content.attachments if file.endswith(".hmcs")]
    wanted = f"{name}.hmcs" if name else (kept[0] if len(kept) == 1 else "")
    if wanted not in kept:
        there = ", ".join(kept) or "none"
        raise RecordingError(
            f"{content.path}: kept with it are the models: {there}; name one of another place "
            "with --model FILE"
        )
    with TemporaryDirectory() as folder:
        file = Path(folder) / wanted
        file.write_bytes(content.attachments[wanted])
        return load_model(file)


def replayed(
    content: RecordingContent, model: Model, progress: Callable[[float], None] = lambda _: None
) -> Replay:
    """Return what a model's recognizer believes of a recording; `progress` is told the share done.

    Where the recording has evidence of this very model, evidence is rounded as it was on its way.
    Raises RecordingError where there are no steps.
    """
    steps = list(content.of(Step))
    if not steps:
        raise RecordingError(
            f"{content.path}: has no steps: the hand did not move, or it was cut off before"
        )
    name, recorded = _recorded(content, model)
    precision = _precision(content, model)
    labels = labels_of(content)
    beliefs: list[Believed] = []
    clock, recognizer, expected, label = "", None, -1, 0
    began_s = time.process_time()
    for number, (logged, envelope, step) in enumerate(steps):
        if envelope.source.boot == clock and step.index < expected:
            # It stands there twice: among the steps made before, and as it came.
            continue
        if recognizer is None or envelope.source.boot != clock or step.index != expected:
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
                belief_message(model, recognition, clock),
                recorded.get((clock, step.index)),
                labels[label].state.partition("/")[0] if labeled else None,
            )
        )
        progress((number + 1) / len(steps))
    spent_s = time.process_time() - began_s
    lasted_s = (steps[-1][0].log_ns - steps[0][0].log_ns) / 1e9
    return Replay(model, name, tuple(beliefs), spent_s, lasted_s, steps[0][2].index)


def compared(replay: Replay) -> Comparison:
    """Return how a replay stands to what was recorded, and both to the labels."""
    pairs = [
        (believed.replayed, believed.recorded)
        for believed in replay.beliefs
        if believed.recorded is not None and not believed.recorded.missing_gestemes
    ]
    alike = [now.likely_state == then.likely_state for now, then in pairs]
    labeled = [believed for believed in replay.beliefs if believed.label is not None]
    right = [believed.replayed.likely_state == believed.label for believed in labeled]
    was_right = [
        believed.recorded.likely_state == believed.label
        for believed in labeled
        if believed.recorded is not None
    ]
    return Comparison(
        len(replay.beliefs),
        len(pairs),
        sum(same_bits(now, then) for now, then in pairs),
        _mean(alike),
        _later_steps(pairs),
        _mean(right),
        _mean(was_right),
        replay.lasted_s / max(replay.spent_s, 1e-9),
    )


def same_bits(one: Belief, other: Belief) -> bool:
    """Return whether two beliefs are of one model and the same to the last bit."""
    return one.model_hash == other.model_hash and all(
        np.array_equal(getattr(one, name), getattr(other, name)) for name in COMPARED
    )


def _recognizer(model: Model, anywhere: bool, precision: Precision) -> Recognizer:
    if isinstance(model.knowledge, Layers):
        return Guarded(LayeredRecognizer(model, anywhere=anywhere, precision=precision))
    return recognizer_of(model, anywhere=anywhere)


def _recorded(content: RecordingContent, model: Model) -> tuple[str, dict[tuple[str, int], Belief]]:
    """The recorded beliefs to compare with: of this very model, else of the one that said most."""
    by_name: dict[str, dict[tuple[str, int], Belief]] = {}
    hashes: dict[str, str] = {}
    for logged, _, belief in content.of(Belief):
        name = logged.key.split("/")[-2]
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


def _later_steps(pairs: list[tuple[Belief, Belief]]) -> float:
    names = sorted({state for pair in pairs for belief in pair for state in belief.states})
    now, then = ([names.index(pair[side].likely_state) for pair in pairs] for side in (0, 1))
    later = []
    for at in changes(then):
        near = [t - at for t in changes(now) if now[t] == then[at]]
        if near:
            later.append(min(near, key=abs))
    return float(np.median(later)) if later else float("nan")


def _mean(truths: list[bool]) -> float:
    return float(np.mean(truths)) if truths else float("nan")


def rows_of(replay: Replay) -> Iterator[dict[str, object]]:
    """Yield a row for every step: what is and was believed, and how surely."""
    first_ns = replay.beliefs[0].log_ns if replay.beliefs else 0
    for believed in replay.beliefs:
        then = believed.recorded
        yield {
            "time_s": (believed.log_ns - first_ns) / 1e9,
            "step": believed.step,
            "label": believed.label or "",
            "recorded_state": "" if then is None else then.likely_state,
            "recorded_probability": "" if then is None else then.confidence,
            "replayed_state": believed.replayed.likely_state,
            "replayed_probability": believed.replayed.confidence,
            "replayed_unknown": believed.replayed.unknown,
        }
