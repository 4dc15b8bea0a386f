"""How the virtual fixture answers, as a task file says it."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from hmcs.task.values import NotNegative, Number, Part, Point, Positive, Rotation, Share

LawName = Literal["general", "thesis"]
ComplianceName = Literal["belief", "insistence", "fixed", "optimal", "cue"]
CueName = Literal["pedal", "silence", "recognized"]
ScalingName = Literal["toggle", "fade", "hold"]
TremorName = Literal["none", "notch", "fourier"]


class FittedLine(Part):
    """Error or time for a compliance, fitted to what operators did: slope · c_τ + intercept."""

    slope: Number
    intercept: Number


class OptimalCompliance(Part):
    """Compliance where following a path and leaving it are equally good (thesis 2.2)."""

    error_following: FittedLine
    error_leaving: FittedLine
    time_following: FittedLine
    time_leaving: FittedLine
    guidance: NotNegative = 1.0
    """s: above 1 following counts for more, below 1 leaving does."""
    accuracy: Share = 0.5
    """w: how much error counts against time."""


class Cue(Part):
    """How the operator tells that the path is to be left, and how the fixture gives way."""

    cue: CueName = "recognized"
    scaling: ScalingName = "fade"
    fade_m: Positive = 0.02
    """So far beyond where the cue was given, `fade` leaves nothing of the force."""
    silence_s: Positive = 0.5
    """A hand that rests so long has given the cue `silence`."""
    back_within_m: Positive = 0.005
    """A robot that is so near the path again has come back, and the cue is over."""


class VirtualToolSetup(Part):
    """A tool that the hand seems to hold (Itoh et al. 2000)."""

    mass_kg: Positive
    damping_n_s_per_m: Positive
    stiffness_n_per_m: NotNegative = 0.0


class VolumeKnot(Part):
    """The radius of a volume at a place of its path."""

    progress: Share
    """Share of the path's length."""
    radius_m: NotNegative


class VolumeSetup(Part):
    """A tube (one knot), a cone (two), or several joined, along the learned path."""

    knots: tuple[VolumeKnot, ...] = ()
    """By rising progress."""
    of_spread: Positive | None = None
    """Radius as so many times the spread of the demonstrations; knots, if given, are the least."""
    wall_m: Positive = 0.005
    """Over so much beyond the radius the fixture becomes as stiff as it gets."""

    @model_validator(mode="after")
    def _rises(self) -> Self:
        if not self.knots and self.of_spread is None:
            raise ValueError("a volume has no radius: give knots, or of_spread")
        places = [knot.progress for knot in self.knots]
        if any(after <= before for before, after in pairwise(places)):
            raise ValueError(f"knots are at {places}, expected rising progress")
        return self


class TargetSetup(Part):
    """A pose the operator is guided to instead of along the path (2.30)."""

    position_m: Point
    """Of the tool, base frame."""
    orientation_xyzw: Rotation | None = None
    """Any where it is left out."""
    sphere_m: Positive = 0.008
    """Within so much of the target the direction stays as it was."""


class PlanSetup(Part):
    """The robot goes along the learned path by itself, and the operator has the last word."""

    speed_m_s: Positive = 0.05
    """While the operator does nothing."""
    fastest: Annotated[float, Field(ge=1, allow_inf_nan=False)] = 2.0
    """An operator may speed it up to so many times that."""
    return_per_s: Positive = 1.0
    """A robot pushed aside comes back by this share of the distance a second."""
    aside_within_m: Positive = 0.1
    """Farther aside than this the plan waits for the operator."""
    slows_within_m: Positive = 0.02
    """It slows down so long before its end."""


class SharedSetup(Part):
    """Who moves which axis while an operator helps a plan on."""

    operator_axes: Annotated[
        tuple[Literal["vx", "vy", "vz", "wx", "wy", "wz"], ...], Field(min_length=1)
    ]
    """The operator's, base frame; the others stay the plan's."""
    stuck_after_s: Positive = 1.0
    """A plan that has not moved for so long asks for help."""
    hands_back_after_s: Positive = 0.5
    """Once the hand rests so long the plan has all axes again."""

    @model_validator(mode="after")
    def _each_once(self) -> Self:
        if len(set(self.operator_axes)) < len(self.operator_axes):
            raise ValueError(f"axes are {', '.join(self.operator_axes)}, expected each once")
        return self


class StateFixture(Part):
    """What one state's fixture does otherwise than the task's."""

    law: LawName | None = None
    compliance: ComplianceName | None = None
    maximum_factor: Share | None = None
    fixed_compliance: Share | None = None
    optimal: OptimalCompliance | None = None
    cue: Cue | None = None
    pull: Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)] | None = None
    volume: VolumeSetup | None = None
    tight_spread_m: Positive | None = None
    guides_turning: bool | None = None
    target: TargetSetup | None = None
    plan: PlanSetup | None = None
    shared: SharedSetup | None = None

    @model_validator(mode="after")
    def _shares_a_plan(self) -> Self:
        if self.shared is not None and self.plan is None:
            raise ValueError("shared axes need a plan to share them with: give plan")
        if self.target is not None and self.plan is not None:
            raise ValueError("target and plan lead differently: give one of them")
        return self


class FixtureSetup(Part):
    """How the virtual fixture answers the belief."""

    law: LawName = "general"
    """`general` is (2.29), `thesis` is (3.6)."""
    compliance: ComplianceName = "insistence"
    """What softens the fixture: `belief` is (3.2), the less sure the softer; `insistence` lets go
    besides of an operator whose hand keeps going across the guide; `fixed` is always the same once
    a state is recognized, `optimal` is where following and leaving are equally good, `cue` gives
    way when the operator gives a cue."""
    fixed_compliance: Share = 0.4
    """c_τ of `fixed`."""
    optimal: OptimalCompliance | None = None
    """Lines of `optimal`, which needs them."""
    cue: Cue = Cue()
    """Of `cue`."""
    volume: VolumeSetup | None = None
    """Within it the fixture is free, and it brings back who leaves; none makes the path the guide.
    """
    tight_spread_m: Positive | None = None
    """Where demonstrations lay farther apart than this, the fixture is softer in proportion; left
    out, it is as stiff everywhere."""
    guides_turning: bool = True
    """Whether the tool is led to turn as it was shown, where the demonstrations tell that."""
    maximum_factor: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] = 0.83
    """ξ of (3.6): the fixturing factor when the recognition is certain."""
    gain_rise_per_s: Positive = 6.0
    gain_fall_per_s: Positive = 16.0
    operator_scale: Positive = 1.0
    """m/s of the tool for a m/s of the hand."""
    axis_scale: tuple[NotNegative, ...] = (1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    """Diagonal C of (2.23): what passes of each of vx, vy, vz, wx, wy, wz; 0 blocks an axis."""
    force_scale: tuple[NotNegative, ...] = (1.0, 1.0, 1.0)
    """What is felt of the fixture's force along x, y, z; 0 for nothing."""
    dead_band_m_s: NotNegative = 0.0
    """A hand slower than this moves nothing."""
    virtual_tool: VirtualToolSetup | None = None
    """Between hand and robot; none by default."""
    pull: Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)] = 0.5
    """k_d of (2.32) for a hard fixture: how strongly a robot beside the path is led back to it by
    the general law; 0 for none."""
    pull_full_at_m: Positive = 0.02
    """A robot so far from the path is led back with full strength."""
    pull_reach_m: Positive = 0.025
    """Much farther than this a path counts as left, and leads nobody back."""
    shift_beyond_m: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.006
    """A path goes on from where the one before it ended, if the robot is no farther beside it than
    this when its segment begins; otherwise it is laid at the robot. 0 lays it there always."""
    tremor: TremorName = "notch"
    """How tremor is taken out of the operator's velocity: a notch lets nothing pass at its center,
    the adaptive Fourier combiner finds the tremor's frequency by itself."""
    tremor_hz: Annotated[float, Field(ge=6, le=14)] = 10.0
    """Center of the notch, or where the Fourier combiner begins to look."""
    tremor_quality: Positive = 0.7
    """How narrow the notch is: center over width."""

    @model_validator(mode="after")
    def _has_its_lines_and_axes(self) -> Self:
        if self.compliance == "optimal" and self.optimal is None:
            raise ValueError(
                "compliance is optimal but there are no lines: give optimal with error_following, "
                "error_leaving, time_following and time_leaving"
            )
        if len(self.axis_scale) != 6:
            raise ValueError(f"axis_scale has {len(self.axis_scale)} numbers, expected 6")
        if len(self.force_scale) != 3:
            raise ValueError(f"force_scale has {len(self.force_scale)} numbers, expected 3")
        return self
