"""Settings that all synthetic studies share: the simulated hand, and the curves it follows."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import AfterValidator, Field

from hmcs.errors import UserError
from hmcs.motion.operators import Operator, OperatorStuckError, Trace, follow
from hmcs.motion.references import References
from hmcs_laboratory.study import StudySettings

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Count = Annotated[int, Field(ge=1)]
Share = Annotated[float, Field(gt=0, le=1)]


def _rising(bounds: tuple[float, float]) -> tuple[float, float]:
    if bounds[0] > bounds[1]:
        raise ValueError("expected the lower one first")
    return bounds


Range = Annotated[tuple[Positive, Positive], AfterValidator(_rising)]


class HandSettings(StudySettings):
    """The simulated hand (3.1.5, 4.2)."""

    step_m: Positive = 0.05
    """δ: mean length of a step, m."""
    look_ahead_m: Positive = 0.15
    """ξ of 3.1.5, m."""
    renormalize: bool = True
    """Whether the direction is a unit vector again after the error is added to it."""
    stop_within_steps: Positive = 2.0
    """The hand stops within so many steps of the end."""

    def operator(self, noise: float) -> Operator:
        """Return the hand with noise κ."""
        return Operator(
            step_m=self.step_m,
            noise=noise,
            look_ahead_m=self.look_ahead_m,
            renormalize=self.renormalize,
            stop_within_steps=self.stop_within_steps,
        )


class CurveSettings(HandSettings):
    """The random lines and arcs that it follows (4.2)."""

    kind: Literal["line", "circle", "mixed"] = "mixed"
    """Lines, arcs of circles, or each with probability one half."""
    dimensions: Annotated[int, Field(ge=2, le=3)] = 2
    line_m: Range = (0.5, 1.5)
    """Lengths of lines, from and to, m."""
    radius_m: Range = (0.15, 0.5)
    """Radii of arcs, from and to, m."""
    angle_deg: Range = (90.0, 360.0)
    """Of arcs, from and to."""

    @property
    def references(self) -> References:
        """What gestemes are drawn from."""
        lower_deg, upper_deg = self.angle_deg
        return References(
            kind=self.kind,
            dimensions=self.dimensions,
            length_m=self.line_m,
            radius_m=self.radius_m,
            angle_rad=(math.radians(lower_deg), math.radians(upper_deg)),
            sample_m=self.step_m / 2,
        )


def moved(
    reference: ArrayLike,
    operator: Operator,
    rng: np.random.Generator,
    segments: list[int] | None = None,
) -> Trace:
    """Return the hand's motion as `follow` does; a hand that never arrives raises UserError."""
    try:
        return follow(reference, operator, rng, segments)
    except OperatorStuckError as error:
        raise UserError(str(error)) from error
