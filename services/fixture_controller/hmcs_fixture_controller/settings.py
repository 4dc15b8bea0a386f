"""Settings of the fixture controller."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from hmcs.bus.settings import EMPTY_IS_NONE, ServiceSettings
from hmcs.fixtures.controller.rules import Safeguards

Milliseconds = Annotated[float, Field(gt=0, le=1000)]


class FixtureControllerSettings(ServiceSettings):
    """Turns the operator's velocity into the robot's, guided by what is recognized."""

    models: tuple[Path, ...] = ()
    """Model files, or folders of them; each lends its paths to the recognizer of its name."""
    task: Annotated[str | None, EMPTY_IS_NONE] = None
    """Name or file of a task: of folders in `models` its model alone is taken, if it is there."""
    active_model: str | None = None
    """Name of the recognizer followed first; by default the first one heard."""
    input_stale_after_ms: Milliseconds = 80.0
    """Without a sample of the operator's device for so long the robot is commanded to stop. The
    stop has to be in force within 120 ms: the rest is for a busy machine."""
    settle_ms: Annotated[float, Field(ge=0, le=10_000)] = 250.0
    """How long samples count for nothing after that: they may be a backlog."""
    belief_stale_after_ms: Milliseconds = 100.0
    """The fixture lets go once a step has had no belief for so long."""
    unknown_limit: Annotated[float, Field(ge=0, le=1)] = 0.5
    """The fixture lets go where the motion is no part of the task with a higher probability."""
    command_valid_for_ms: Milliseconds = 80.0
    """How long the robot may act on a command."""
    stop_repeated_every_ms: Milliseconds = 50.0
    """How often the stop is commanded again while the input is stale."""
    damping_n_s_per_m: Annotated[float, Field(ge=0)] = 20.0
    """Force on a haptic device for each m/s of motion the fixture removes."""
    angular_damping_n_m_s_per_rad: Annotated[float, Field(ge=0)] = 0.2
    """Torque on a haptic device for each rad/s of rotation the fixture removes."""

    @property
    def safeguards(self) -> Safeguards:
        """The part of them that the science knows."""
        return Safeguards(
            input_stale_after_s=self.input_stale_after_ms / 1e3,
            settle_s=self.settle_ms / 1e3,
            belief_stale_after_s=self.belief_stale_after_ms / 1e3,
            unknown_limit=self.unknown_limit,
            command_valid_for_s=self.command_valid_for_ms / 1e3,
            damping_n_s_per_m=self.damping_n_s_per_m,
            angular_damping_n_m_s_per_rad=self.angular_damping_n_m_s_per_rad,
        )
