"""Figure 2.14: force against error for each cue and scaling, as a simulated operator leaves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.lines import Line2D

from hmcs.arrays import Array
from hmcs.fixtures.compliance.factor import FREE_FACTOR
from hmcs.fixtures.compliance.trust import Trust
from hmcs.fixtures.controller.rules import Rules
from hmcs.fixtures.controller.softening import CompliancePolicy, Situation
from hmcs.fixtures.law import Gains
from hmcs.fixtures.parts import PreferredSubspace
from hmcs.motion.closed_loop_operators import STEADY, ClosedLoopOperator
from hmcs.motion.paths import Path
from hmcs.task.fixture_parts import Cue, CueName, FixtureSetup, ScalingName
from hmcs_laboratory.data.hands import Count, Positive
from hmcs_laboratory.figures.compliance import OFF_PATH, meant_paths
from hmcs_laboratory.figures.drawing import COLORS, INK, Drawn, Number, new_picture
from hmcs_laboratory.figures.fixture_fields import CURVE, MM
from hmcs_laboratory.study import StudySettings

_PERIOD_S = 0.01
_MOST_S = 60.0
CUES: tuple[CueName, ...] = ("pedal", "silence", "recognized")
SCALINGS: tuple[ScalingName, ...] = ("toggle", "fade", "hold")
_TITLES = {"pedal": "explicit: pedal", "silence": "implicit: silence", "recognized": "automatic"}


class ForceSettings(StudySettings):
    """Of figure 2.14."""

    repeats: Count = 10
    """Performances by each pair of cue and scaling; the first is drawn."""
    fade_m: Positive = 0.015
    silence_s: Positive = 0.5
    factor: float = 0.8
    """k of the fixture before the cue."""


class Leaving(NamedTuple):
    """An operator on the way from the path to the target beside it; T samples."""

    errors: Array
    """Of the robot from the path, m, shape (T,)."""
    kept: Array
    """Share of the fixture's stiffness, shape (T,)."""
    delay_s: float
    """From where the meant way leaves the path to the cue."""
    lasted_s: float
    """From there to the target."""

    @property
    def forces(self) -> Array:
        """Of the fixture, by its stiffness before the cue, m, shape (T,)."""
        return np.asarray(self.errors * self.kept)

    @property
    def early(self) -> bool:
        """Whether the cue was taken before the operator meant to leave."""
        return bool(self.kept[0] < 1.0)

    @property
    def cued_at_m(self) -> float:
        """The error at which the cue took effect; nan where none did."""
        below = np.flatnonzero(self.kept < 1.0)
        return float(self.errors[below[0]]) if len(below) else float("nan")


def force_scaling(settings: ForceSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 2.14: force against error for the nine pairs of cue and scaling."""
    picture = new_picture(6.4)
    axes = picture.subplots(3, 3, sharex=True, sharey=True)
    seeds = [int(seed) for seed in rng.integers(2**32, size=settings.repeats)]
    meant = meant_paths()[1]
    leaves_m = _leaves_m(meant)
    numbers: dict[str, Number] = {"fade_mm": MM * settings.fade_m}
    for row, cue in zip(axes, CUES, strict=True):
        for ax, scaling in zip(row, SCALINGS, strict=True):
            asked = Cue(
                cue=cue, scaling=scaling, fade_m=settings.fade_m, silence_s=settings.silence_s
            )
            all_left = [leave(meant, leaves_m, asked, settings.factor, seed) for seed in seeds]
            drawn = all_left[0]
            ax.plot(MM * drawn.errors, MM * drawn.forces, color=COLORS[0], linewidth=1.4)
            ax.axvline(MM * drawn.cued_at_m, color=INK, linewidth=0.9, linestyle=(0, (4, 3)))
            ax.set_title(f"{_TITLES[cue]}, {scaling}")
            in_time = [left for left in all_left if not left.early]
            numbers |= {
                f"{cue}_{scaling}_early": sum(left.early for left in all_left),
                f"{cue}_{scaling}_cued_at_mm": _mean([MM * left.cued_at_m for left in in_time]),
                f"{cue}_{scaling}_delay_s": _mean([left.delay_s for left in in_time]),
                f"{cue}_{scaling}_most_force_mm": _mean(
                    [MM * left.forces.max() for left in all_left]
                ),
                f"{cue}_{scaling}_to_target_s": _mean([left.lasted_s for left in all_left]),
            }
    for ax in axes[-1]:
        ax.set_xlabel("error, mm")
    for ax in axes[:, 0]:
        ax.set_ylabel("force / stiffness, mm")
    picture.legend(
        [Line2D([], [], color=INK, linewidth=0.9, linestyle=(0, (4, 3)))],
        ["cue takes effect"],
        loc="outside lower center",
    )
    return Drawn(picture, numbers, _found(numbers, settings.repeats), _DIFFERS)


def leave(meant: Path, leaves_m: float, cue: Cue, stiff: float, seed: int) -> Leaving:
    """Return how an operator leaves the curve for a target beside it, led by the same fixture.

    The way that is `meant` leaves the curve `leaves_m` along it; `stiff` is k before the cue.
    The pedal goes down as long after the operator means to leave as an eye and a hand take; for
    silence the hand rests there; the automatic cue is the product's own.
    """
    operator = ClosedLoopOperator(STEADY, meant, np.random.default_rng(seed), period_s=_PERIOD_S)
    rules = Rules(FixtureSetup(compliance="cue", cue=cue))
    policy, trusted = CompliancePolicy(), Trust("guiding", stiff)
    target_m = meant.project(OFF_PATH)
    robot, rested_s, meant_for_s = meant.points[0].copy(), 0.0, 0.0
    errors, kept, delay_s = [], [], float("nan")
    for _ in range(int(_MOST_S / _PERIOD_S)):
        motion = operator.step(robot)
        if motion.progress_m >= target_m:
            break
        leaving, hand = motion.progress_m >= leaves_m, motion.velocity
        if leaving:
            meant_for_s += _PERIOD_S
            if cue.cue == "silence" and rested_s < cue.silence_s + _PERIOD_S:
                rested_s, hand = rested_s + _PERIOD_S, np.zeros(3)
        near_m = CURVE.project(robot)
        error_m = float(np.linalg.norm(CURVE.at(near_m) - robot))
        direction = CURVE.tangent(near_m, 0.003)
        pedal = meant_for_s > STEADY.delay_s
        now = Situation(hand, direction, error_m, near_m / CURVE.length_m, pedal)
        factor = policy.factor(trusted, rules, now, _PERIOD_S)
        share = (factor - FREE_FACTOR) / (stiff - FREE_FACTOR)
        if leaving:
            if share < 1.0 and np.isnan(delay_s):
                delay_s = meant_for_s
            errors.append(error_m)
            kept.append(share)
        objective = PreferredSubspace.along(direction, Gains(1.0, (1.0 - factor) / factor))
        robot = robot + _PERIOD_S * objective.wanted(np.concatenate([hand, np.zeros(3)]))[:3]
    return Leaving(np.array(errors), np.array(kept), delay_s, meant_for_s)


def _leaves_m(meant: Path) -> float:
    """How far along it the meant way leaves the curve: at the last point that both share."""
    off = np.array([np.linalg.norm(CURVE.at(CURVE.project(p)) - p) for p in meant.points])
    return meant.project(meant.points[np.flatnonzero(off > 1e-4)[0] - 1])


def _mean(values: Sequence[float]) -> float | None:
    return float(np.mean(values)) if len(values) else None


def _found(numbers: Mapping[str, Number], repeats: int) -> str:
    parts = []
    for cue in CUES:
        early = numbers[f"{cue}_toggle_early"]
        delay_s, at_mm = (numbers[f"{cue}_toggle_{what}"] for what in ("delay_s", "cued_at_mm"))
        late = "" if delay_s is None else f" {delay_s:.2f} s after it, {at_mm:.1f} mm off"
        before = f" in {early} of {repeats} before it" if early else ""
        parts.append(f"{cue}{late}{' and' if late and before else ''}{before}")
    forces = "; ".join(
        f"{scaling} "
        + ", ".join(f"{numbers[f'{cue}_{scaling}_most_force_mm']:.1f} ({cue})" for cue in CUES)
        for scaling in SCALINGS
    )
    return (
        "A simulated operator means to leave the path for a target beside it. The cue is taken: "
        f"{'; '.join(parts)}. The most force on the way, by the stiffness before the cue, mm: "
        f"{forces}."
    )


_DIFFERS = (
    "The thesis sketches the three scalings; here a simulated operator leaves by each cue, and the "
    "force is what the share of stiffness that is kept makes of the error. The automatic cue is "
    "the product's own, a hand that keeps on pushing off the path; Nolin et al. activated theirs "
    "at places given beforehand. Fade and hold begin no nearer to the path than 5 mm: there the "
    "operator counts as back on it."
)
