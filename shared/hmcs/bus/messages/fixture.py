"""What the fixture commands and why, whom it follows and whom it drives."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hmcs.bus.arrays import LARGEST, Vector3, Vector6
from hmcs.bus.messages.fields import Name, Within
from hmcs.bus.messages.message import Message


class Command(Message):
    """What the robot is to do now."""

    SCHEMA = "command"

    twist: Vector6
    """Reference velocity of the tool, m/s and rad/s, shape (6,)."""
    valid_for_ns: Annotated[int, Field(gt=0, le=1_000_000_000)]
    """How long after its arrival the robot may act on it."""
    engaged: bool
    """False commands a stop. After a stop of its own the robot moves again only once it has seen
    False and then True: a deliberate re-engage."""


class FixtureState(Message):
    """What the fixture is doing, and why."""

    SCHEMA = "fixture_state"
    VERSION = 2

    law: Name
    """The law that made the command."""
    model: str
    """The active recognizer's model; empty while there is none."""
    state: str
    """The task state whose fixture is applied; empty in free motion."""
    factor: Annotated[float, Field(ge=0, le=1)]
    """Fixturing factor k: how strongly motion across the preferred direction is reduced."""
    compliance: Annotated[float, Field(ge=0, le=1)]
    """c_τ: 1 is free motion, 0 a hard fixture."""
    preferred_direction: Vector3
    """Unit vector, or zero in free motion, shape (3,)."""
    progress: Annotated[float, Field(ge=0, le=1)]
    """How far along the state's learned path, by path length."""
    gesteme: str = ""
    """Whose learned path it is; empty in free motion."""
    guide_origin: Vector3 | None = None
    """Where that path begins for the robot, m, base frame, shape (3,); None in free motion, and
    where nobody knows."""
    off_guide_m: Annotated[float, Field(ge=0), Within(LARGEST)] | None = None
    """How far the robot is beside the path; None as for `guide_origin`."""
    operator_twist: Vector6
    """The operator's velocity as the law saw it, shape (6,)."""
    command_twist: Vector6
    """The reference velocity it made of it, shape (6,)."""
    wrench: Vector6
    """The fixture's force on the operator, for a haptic device, N and N·m, shape (6,)."""
    engaged: bool
    """Whether the operator is driving."""
    asks_for_help: bool = False
    """True while a plan with shared axes is stuck and waits for the operator."""
    reason: Literal[
        "guiding",
        "unsure",
        "no_belief",
        "belief_stale",
        "belief_degraded",
        "unknown_motion",
        "disengaged",
        "input_stale",
    ]
    """Why the fixture is as stiff as it is."""


class Pairing(Message):
    """Which input device drives which robot, as the fixture controller has decided it.

    Published when it changes, and a few times a second. Recognizers follow the steps of that device
    alone; a robot that is not named takes no commands of this fixture controller.
    """

    SCHEMA = "pairing"

    device: str
    """Boot of the input device that drives; empty while none does."""
    device_instance: str
    """Its instance; empty while none does."""
    robot: str
    """Boot of the robot that follows, and whose pose the fixture takes; empty while none does."""
    robot_instance: str
    """Its instance; empty while none does."""


class ActivateRecognizer(Message):
    """Asks the fixture controller to follow another recognizer's belief."""

    SCHEMA = "activate_recognizer"

    model: Name
    """The `{model}` of its keys."""
