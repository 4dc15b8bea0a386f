"""What one assisted performance was worth."""

from __future__ import annotations

import numpy as np
from scipy.signal import welch

from hmcs.arrays import Array
from hmcs.motion.paths import Path
from hmcs_laboratory.assistance.loop import Run
from hmcs_laboratory.assistance.scenarios import Scenario

WINDOW_M = 0.02
"""The robot is looked for so far around where its operator takes it to be."""
FOUGHT_SHARE = 0.3
"""The fixture fights the operator while it takes more than this share of what is intended."""
MOVING_M_S = 0.01
"""An operator who intends less than this is not fought."""
LEFT_BY_M = 0.01
"""So far from the path it leads along, a fixture counts as left."""
TREMOR_HZ = (8.0, 12.0)
_WELCH_S = 1.0


def measures(run: Run, scenario: Scenario) -> dict[str, float]:
    """Return everything that is measured of a performance, by name, with units.

    `leave_s`, `hits` and `clearance_m` only where there is an obstacle.
    """
    off = off_path(run.robot, scenario.meant, run.progress_m)
    force = np.linalg.norm(run.force, axis=1)
    result = {
        "error_mm": 1e3 * float(np.sqrt((off**2).mean())),
        "max_error_mm": 1e3 * float(off.max()),
        "time_s": run.period_s * len(run.robot),
        "arrived": float(run.arrived),
        "fighting": fighting(run),
        "hand_path_m": run.period_s * float(np.linalg.norm(run.hand_velocity, axis=1).sum()),
        "force_n": float(np.sqrt((force**2).mean())),
        "tremor_left": tremor_left(run),
        "collisions": float(len(run.touched)),
    }
    if scenario.obstacle is not None:
        gap = np.linalg.norm(run.robot - scenario.obstacle.center, axis=1)
        clearance_m = float(gap.min()) - scenario.obstacle.radius_m
        result["clearance_mm"] = 1e3 * clearance_m
        result["hits"] = float(clearance_m <= 0)
        result["leave_s"] = leave_s(run, scenario)
    return result


def off_path(points: Array, path: Path, near_m: Array) -> Array:
    """Return the distance of each point from the path near an arc length, m, shape (T,)."""
    places = [path.project(*each, WINDOW_M) for each in zip(points, near_m, strict=True)]
    return np.asarray(np.linalg.norm(path.at(places) - points, axis=1))


def fighting(run: Run) -> float:
    """Return the share of the moving time in which the fixture takes much of what is intended."""
    speed = np.linalg.norm(run.intended, axis=1)
    taken = np.linalg.norm(run.intended - run.passed, axis=1)
    moving = speed > MOVING_M_S
    return float((taken[moving] > FOUGHT_SHARE * speed[moving]).mean()) if moving.any() else 0.0


def tremor_left(run: Run) -> float:
    """Return the command's power in the band of tremor as a share of the hand's there."""
    window = min(len(run.command), round(_WELCH_S / run.period_s))

    def power(velocity: Array) -> float:
        hz, density = welch(velocity, 1.0 / run.period_s, nperseg=window, axis=0)
        band = (hz >= TREMOR_HZ[0]) & (hz <= TREMOR_HZ[1])
        return float(density[band].sum())

    of_hand = power(run.hand_velocity)
    return power(run.command) / of_hand if of_hand > 0 else float("nan")


def leave_s(run: Run, scenario: Scenario) -> float:
    """Return how long it took to leave the usual path once the operator meant to; NaN if never."""
    detour, usual = scenario.detour, scenario.usual
    if detour is None or usual is None:
        return float("nan")
    began = np.flatnonzero(run.progress_m >= detour.leaves_at_m)
    if not len(began):
        return float("nan")
    away = np.flatnonzero(off_path(run.robot, usual, run.progress_m)[began[0] :] > LEFT_BY_M)
    return run.period_s * float(away[0]) if len(away) else float("nan")
