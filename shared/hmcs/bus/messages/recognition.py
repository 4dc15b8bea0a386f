"""What is recognized in the steps: evidence, belief, and which model file to work with."""

from __future__ import annotations

from typing import Annotated

from pydantic import ConfigDict, Field

from hmcs.bus.arrays import EvidenceFloats, Floats, Indices
from hmcs.bus.messages.fields import Count, Name, Real
from hmcs.bus.messages.message import Message


class Evidence(Message):
    """What one classifier makes of one step: a sparse list of living (gesteme, start) pairs."""

    SCHEMA = "evidence"

    model_hash: Name
    """Of the model file; a task refuses another model's evidence."""
    clock: Name
    """Boot of the input device whose steps are meant."""
    step: Count
    """t."""
    gestemes: tuple[Name, ...]
    """The gestemes this classifier holds, with or without a living pair."""
    pair_gesteme: Indices
    """Index into `gestemes` of each pair, shape (p,)."""
    pair_start: Indices
    """Start step s of each pair, shape (p,)."""
    exit: EvidenceFloats
    """Probability of leaving before step t, given steps s..t−1; 0 for s = t; shape (p,)."""
    log_ratio: EvidenceFloats
    """Tempered log-likelihood ratio of step t against the model's background level, given no exit,
    nats, shape (p,)."""


class Belief(Message):
    """What the task recognizer holds to be true after one step."""

    SCHEMA = "belief"

    model_hash: Name
    """Of the model file."""
    clock: Name
    """Boot of the input device whose steps are meant."""
    step: Count
    """t."""
    states: tuple[Name, ...]
    """Task states in the order of the model."""
    probabilities: Floats
    """P(state | steps 0..t), one for each state, shape (len(states),)."""
    unknown: Annotated[float, Field(ge=0, le=1)] = 0.0
    """P(motion is no part of the task | steps 0..t); with `probabilities` sums to one."""
    likely_gesteme: str
    """The most probable gesteme in the most probable state; empty while nothing is likely."""
    segment_start: Count
    """The most probable start step s of the most probable state's segment."""
    log_likelihood: Real = 0.0
    """Of step t given all before it, against the background level, nats."""
    mean_log_likelihood: Real = 0.0
    """How well the last steps fit the task: mean over the model's alarm window, nats."""
    unknown_alarm: bool = False
    """True where that mean is below the threshold learned from the demonstrations."""
    missing_gestemes: tuple[Name, ...] = ()
    """Gestemes of the task no evidence came for; the belief is degraded unless this is empty."""

    @property
    def likely_state(self) -> str:
        """The most probable task state."""
        return self.states[int(self.probabilities.argmax())]

    @property
    def confidence(self) -> float:
        """Probability of the most probable task state."""
        return float(self.probabilities.max())


class LoadModel(Message):
    """Asks a recognizer process to work with another model file."""

    SCHEMA = "load_model"

    path: str
    """Of the model file, as the asked process sees it."""


class ModelQuestion(Message):
    """Asks for the file of a model, to run it on another host."""

    SCHEMA = "model_question"

    model: Name
    """Its name."""


class ModelFile(Message):
    """A model file, whole."""

    SCHEMA = "model_file"

    # In recordings bytes stand as base64.
    model_config = ConfigDict(val_json_bytes="base64")

    model: Name
    """Its name."""
    model_hash: Name
    """Of what it has learned."""
    content: bytes
    """Of the file; to be validated as any file is."""
