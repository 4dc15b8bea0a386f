"""What a fixture does as messages."""

from __future__ import annotations

from hmcs.bus.messages import Command, FixtureState
from hmcs.fixtures.controller.interface import Fixture


def command_of(fixture: Fixture, valid_for_ms: float) -> Command:
    """Return the command to the robot."""
    return Command(
        twist=fixture.command_twist,
        valid_for_ns=round(valid_for_ms * 1e6),
        engaged=fixture.engaged,
    )


def state_of(fixture: Fixture) -> FixtureState:
    """Return the state that everybody may read."""
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
