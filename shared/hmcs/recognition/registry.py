"""The registry of recognizers: what kinds there are, how each learns and how each is made.

A kind is one file with a `KIND` and one line in the entry-point group `hmcs.recognizers` of any
installed distribution.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, partial
from importlib.metadata import EntryPoint, entry_points
from typing import Any, NamedTuple

import numpy as np
from pydantic import TypeAdapter, ValidationError

from hmcs.errors import UserError, first_problem
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import Step
from hmcs.recognition.model import Model
from hmcs.recognition.recognizer import Guarded, PassEvidence, Recognizer
from hmcs.recognition.segmentation import StateSegment
from hmcs.recognition.segments import Segment
from hmcs.task import Task
from hmcs.task.values import unknown_name_message

DEFAULT = "segment-filter"
GROUP = "hmcs.recognizers"


class TrainingData(NamedTuple):
    """What a recognizer learns from."""

    task: Task
    demonstrations: tuple[Demonstration, ...]
    segments: tuple[Segment, ...]
    """The demonstrations cut at their labels; every gesteme of the task has one at least."""
    settings: Any
    """Of the kind's own type."""
    rng: np.random.Generator
    progress: Callable[[str], None]


class RecognizerSpec(NamedTuple):
    """A kind of recognizer."""

    name: str
    summary: str
    """One line."""
    source: str
    """Who described it, where."""
    settings: Callable[[], Any]
    """Returns the choices of learning it, good without tuning: a NamedTuple class, or a function
    that makes one with values of its own."""
    knowledge: type
    """What it learns: a NamedTuple of arrays, numbers, strings and such tuples."""
    learn: Callable[[TrainingData], Any]
    """Returns the knowledge."""
    recognizer: Callable[[Model, bool], Recognizer]
    """Makes a fresh recognizer of a model; with True, one that may begin in any state."""
    check: Callable[[Any, Task], None] = lambda _knowledge, _task: None
    """Raises ValueError where knowledge does not fit the task or itself."""
    layered: Callable[[Model, bool, PassEvidence], Recognizer] | None = None
    """Makes a fresh recognizer whose evidence goes through a function on its way from the gesteme
    level to the task level; None for a kind without evidence."""
    segment: Callable[[Model, Sequence[Step], bool], tuple[StateSegment, ...]] | None = None
    """Returns the most probable segmentation of a whole motion, one step at least, with how
    probable each segment's state is by all of its steps; with True it may begin in any state. None
    for a kind without offline segmentation."""
    from_older: Callable[[Any], Any] = lambda plain: plain
    """Brings the knowledge of a model file, plain as `serialization` has it, into the form of
    today where an older version of the kind wrote it in another."""


@cache
def _registered() -> Mapping[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUP)}


def kinds() -> tuple[RecognizerSpec, ...]:
    """Return all registered kinds, the default first, then by name."""
    return tuple(map(kind_named, kind_names()))


def kind_names() -> tuple[str, ...]:
    """Return what the kinds are called, the default one first; none of them is imported."""
    return tuple(sorted(_registered(), key=lambda name: (name != DEFAULT, name)))


def kind_named(name: str) -> RecognizerSpec:
    """Return the kind of that name; raises UserError where none is registered."""
    entry = _registered().get(name)
    if entry is None:
        baselines = "" if len(_registered()) > 1 else "; install hmcs-baselines for others"
        unknown = unknown_name_message("recognizer", name, _registered())
        raise UserError(f"{unknown}; `hmcs recognizers` says what each is{baselines}")
    kind: RecognizerSpec = entry.load()
    return kind


def settings_of(kind: RecognizerSpec, given: Mapping[str, str]) -> Any:
    """Return a kind's settings with some given as text, names joined by dots where they nest.

    Raises UserError for a name that is none of its settings, or a value that does not fit.
    """
    defaults = kind.settings()
    try:
        chosen = _replaced(defaults, given)
        return TypeAdapter(type(defaults)).validate_python(chosen)
    except KeyError as error:
        names = [name for name, _ in setting_values(defaults)]
        unknown = unknown_name_message("setting", str(error.args[0]), names)
        raise UserError(f"recognizer {kind.name!r}: {unknown}") from None
    except ValidationError as error:
        where, why = first_problem(error)
        raise UserError(f"recognizer {kind.name!r}, setting {where}: {why}") from None


def setting_values(settings: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every setting with its value, names joined by dots where they nest."""
    for field, value in settings._asdict().items():
        if hasattr(value, "_asdict"):
            yield from setting_values(value, f"{prefix}{field}.")
        else:
            yield f"{prefix}{field}", value


def recognizer_of(
    model: Model, *, anywhere: bool = False, tell: Callable[[str], None] | None = None
) -> Recognizer:
    """Return a fresh recognizer of a model.

    It begins with the task's first state or, with `anywhere`, in any of its states. When it fails
    at a step it raises the error, and with the next step begins anew in any state; `tell` receives
    a sentence about it, by default the log of this package.
    """
    make = kind_named(model.recognizer).recognizer
    guarded = partial(Guarded, make(model, anywhere), lambda: make(model, True))
    return guarded() if tell is None else guarded(tell)


def segmentation_of(
    model: Model, steps: Sequence[Step], *, anywhere: bool = False
) -> tuple[StateSegment, ...]:
    """Return the segments of a whole motion, in order and without gaps; none of no steps.

    It begins with the task's first state or, with `anywhere`, in any of its states. Raises
    UserError where the model is of a kind without offline segmentation, naming those that have it.
    """
    segment = kind_named(model.recognizer).segment
    if segment is None:
        able = ", ".join(kind.name for kind in kinds() if kind.segment is not None)
        raise UserError(
            f"model {model.name!r} is for the recognizer {model.recognizer!r}, which has no "
            f"offline segmentation: train one of {able}"
        )
    return segment(model, steps, anywhere) if steps else ()


def _replaced(defaults: Any, given: Mapping[str, str]) -> dict[str, Any]:
    fields: dict[str, Any] = dict(defaults._asdict())
    nested: dict[str, dict[str, str]] = {}
    for name, value in given.items():
        head, dot, rest = name.partition(".")
        if head not in fields or bool(dot) != hasattr(fields[head], "_asdict"):
            raise KeyError(name)
        if dot:
            nested.setdefault(head, {})[rest] = value
        else:
            fields[head] = value
    for head, inner in nested.items():
        fields[head] = _replaced(fields[head], inner)
    return fields
