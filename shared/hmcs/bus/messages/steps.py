"""The steps that the hand makes, and the question for the last of them."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from hmcs.bus.arrays import Quaternion, Vector3, Vector6
from hmcs.bus.messages.fields import Count, Name
from hmcs.bus.messages.message import Message, Origin


class Step(Message):
    """The hand has moved by the dead zone δ: the classifiers' common clock."""

    SCHEMA = "step"

    index: Count
    """t, without gaps within one boot of the input device."""
    position: Vector3
    """x_t, where the step begins, m, shape (3,). The path of the *engaged* hand: motion made with
    the dead-man released or the clutch pressed is taken out, so the path has no jumps."""
    displacement: Vector3
    """x_{t+1} − x_t, m, shape (3,); at least δ long."""
    orientation: Quaternion | None = None
    """Of the hand where the step ends, x y z w, shape (4,), with the sign nearer to that of the
    step before; None where the device has none."""
    wrench: Vector6 | None = None
    """The operator's force, N, then torque, N·m, shape (6,): the mean over the samples of the step,
    the one that ends it included; None where the device has none."""
    mark: bool = False
    """True where the pedal went down in this step, its first sample included and its last one not:
    the operator says that a new part of the task begins with it."""


class LastStepsQuestion(Message):
    """Asks the input device for steps again."""

    SCHEMA = "last_steps_question"

    count: Annotated[int, Field(gt=0, le=10_000)]
    """At most so many."""
    before: Count | None = None
    """Only steps with an index below this; None for the newest."""


class LastSteps(Message):
    """The last steps, oldest first."""

    SCHEMA = "last_steps"

    clock: Name
    """Boot of the input device."""
    steps: tuple[Step, ...]
    """Consecutive, oldest first."""
    origins: tuple[Origin, ...]
    """The operator sample that completed each step, as many as steps."""
