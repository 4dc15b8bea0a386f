"""Where science and wire meet for several services: what they say is said alike."""

from __future__ import annotations

import numpy as np

from hmcs.bus import messages
from hmcs.fixtures.compliance.trust import SegmentBelief
from hmcs.fixtures.controller.interface import Guides, OperatorSample
from hmcs.fixtures.controller.rules import rules_of
from hmcs.fixtures.regions.tool_shape import tool_shape_of
from hmcs.fixtures.regions.workspace import regions_of
from hmcs.motion.steps import Step
from hmcs.recognition.model import Model
from hmcs.recognition.recognizer import Precision, Recognition, StepEvidence

NS_PER_S = 1_000_000_000


def step_of(message: messages.Step) -> Step:
    """Return the step of a message; their fields have the same names."""
    return Step(**dict(message))


def belief_message(model: Model, recognition: Recognition, clock: str) -> messages.Belief:
    """Return the message of a recognition; `clock` is the boot of the input device."""
    belief = recognition.belief
    return messages.Belief(
        model_hash=model.hash,
        clock=clock,
        step=belief.step,
        states=model.state_names,
        probabilities=belief.states,
        unknown=belief.unknown,
        likely_gesteme=model.gesteme_names[belief.gesteme],
        segment_start=belief.segment_start,
        log_likelihood=belief.log_likelihood,
        mean_log_likelihood=recognition.mean_log_likelihood,
        unknown_alarm=recognition.unknown_alarm,
        missing_gestemes=tuple(model.gesteme_names[g] for g in belief.missing),
    )


def evidence_message(
    model: Model, evidence: StepEvidence, clock: str, precision: Precision
) -> messages.Evidence:
    """Return the message of the evidence; `clock` is the boot of the input device."""
    names = model.gesteme_names
    return messages.Evidence(
        model_hash=model.hash,
        clock=clock,
        step=evidence.step,
        gestemes=tuple(names[g] for g in evidence.gestemes),
        pair_gesteme=np.searchsorted(evidence.gestemes, evidence.pair_gesteme).astype(np.int32),
        pair_start=evidence.pair_start,
        exit=evidence.exit.astype(precision),
        log_ratio=evidence.log_ratio.astype(precision),
    )


def guides_of(model: Model) -> Guides:
    """Return the paths a model learned, and the rules and forbidden regions of its task.

    Raises RegionError for a region that cannot be.
    """
    return Guides(
        model.paths,
        rules_of(model.task),
        regions_of(model.task),
        model.spreads,
        model.turns,
        tool_shape_of(model.task),
    )


def sample_of(motion: messages.Motion, seq: int, origin: messages.Origin | None) -> OperatorSample:
    """Return a Motion as the controller takes it; a device without rotation does not rotate.

    `origin` is that of the Motion itself: it says when the sample was taken.
    """
    angular = np.zeros(3) if motion.angular_velocity is None else motion.angular_velocity
    return OperatorSample(
        number=seq,
        position=motion.position,
        twist=np.concatenate([motion.velocity, angular]),
        dead_man=motion.dead_man,
        clutch=motion.clutch,
        pedal=motion.pedal,
        captured_s=None if origin is None else origin.captured_ns / NS_PER_S,
    )


def segment_belief_of(belief: messages.Belief) -> SegmentBelief:
    """Return what a fixture wants to know of a belief.

    Raises ValueError where it has no states, or not one probability for each.
    """
    if not belief.states or len(belief.states) != len(belief.probabilities):
        raise ValueError(
            f"{len(belief.probabilities)} probabilities for {len(belief.states)} states, "
            "expected one for each"
        )
    return SegmentBelief(
        step=belief.step,
        state=belief.likely_state,
        probability=belief.confidence,
        gesteme=belief.likely_gesteme,
        segment_start=belief.segment_start,
        unknown=belief.unknown,
        unknown_alarm=belief.unknown_alarm,
        complete=not belief.missing_gestemes,
    )
