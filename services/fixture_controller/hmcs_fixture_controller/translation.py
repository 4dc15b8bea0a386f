"""Messages to what the fixtures' science knows, and back."""

from __future__ import annotations

import numpy as np

from hmcs.bus.messages import Belief, Command, FixtureState, Motion
from hmcs.fixtures.controller import Fixture, Guides, OperatorSample
from hmcs.fixtures.rules import rules_of
from hmcs.fixtures.trust import SegmentBelief
from hmcs.fixtures.workspace import regions_of
from hmcs.recognition.model import Model


def guides_of(model: Model) -> Guides:
    """Return the paths a model learned, and the rules and forbidden regions of its task.

    Raises RegionError for a region that cannot be.
    """
    return Guides(
        model.paths, rules_of(model.task), regions_of(model.task), model.spreads, model.turns
    )


def sample_of(motion: Motion, seq: int) -> OperatorSample:
    """Return a Motion as the controller takes it; a device without rotation does not rotate."""
    angular = np.zeros(3) if motion.angular_velocity is None else motion.angular_velocity
    return OperatorSample(
        number=seq,
        position=motion.position,
        twist=np.concatenate([motion.velocity, angular]),
        dead_man=motion.dead_man,
        clutch=motion.clutch,
        pedal=motion.pedal,
    )


def belief_of(belief: Belief) -> SegmentBelief:
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


def command_of(fixture: Fixture, valid_for_ms: float) -> Command:
    """Return what the robot is told."""
    return Command(
        twist=fixture.command_twist,
        valid_for_ns=round(valid_for_ms * 1e6),
        engaged=fixture.engaged,
    )


def state_of(fixture: Fixture) -> FixtureState:
    """Return what everybody is told."""
    return FixtureState(
        law=fixture.law,
        model=fixture.model,
        state=fixture.state,
        factor=fixture.factor,
        compliance=fixture.gains.compliance,
        preferred_direction=fixture.direction,
        progress=fixture.progress,
        gesteme=fixture.gesteme,
        guide_origin=fixture.guide_origin,
        off_guide_m=fixture.off_guide_m,
        operator_twist=fixture.operator_twist,
        command_twist=fixture.command_twist,
        wrench=fixture.wrench,
        engaged=fixture.engaged,
        asks_for_help=fixture.asks_for_help,
        reason=fixture.reason,
    )
