"""Demonstrations of a part that is carried, and what the trainer finds implausible in them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from hmcs.motion.demonstrations import Demonstration
from hmcs.task import Task
from hmcs_trainer.validation import findings

TASK = Task.model_validate(
    {
        "format": "hmcs-task/1",
        "name": "carry",
        "dead_zone_m": 0.008,
        "gestemes": [{"name": "up"}, {"name": "over"}, {"name": "down"}],
        "states": [
            {"name": "take", "gestemes": ["up"], "next": ["bring"]},
            {"name": "bring", "gestemes": ["over"], "next": ["set"]},
            {"name": "set", "gestemes": ["down"], "next": []},
        ],
        "start": ["take"],
        "workspace": {"lower_m": [0.45, -0.30, 0.30], "upper_m": [0.75, 0.30, 0.70]},
        "robot": {
            "model": "puma560",
            "tool_start_m": [0.60, 0.15, 0.40],
            "tool_orientation_xyzw": [0.0, 0.70710678, 0.0, 0.70710678],
        },
    }
)
CORNERS = np.array([[0.6, 0.15, 0.4], [0.6, 0.15, 0.6], [0.6, -0.15, 0.6], [0.6, -0.15, 0.4]])


def shown(seed: int = 0, rate_hz: float = 100.0, noise_m: float = 5e-4) -> Demonstration:
    """A part taken up, brought over and set down in six seconds."""
    rng = np.random.default_rng(seed)
    count = int(2.0 * rate_hz)
    corners = CORNERS + rng.normal(0, 0.004, CORNERS.shape)
    share = np.arange(count)[:, None] / count
    parts = [(1 - share) * a + share * b for a, b in pairwise(corners)]
    positions = np.vstack(parts) + rng.normal(0, noise_m, (3 * count, 3))
    states = tuple(name for name in ("take", "bring", "set") for _ in range(count))
    return Demonstration(f"take-{seed}.csv", np.arange(3 * count) / rate_hz, positions, states)


def turned(demonstration: Demonstration, angle_rad: np.ndarray) -> Demonstration:
    half = angle_rad / 2
    quaternions = np.stack([0 * half, 0 * half, np.sin(half), np.cos(half)], axis=1)
    return demonstration._replace(orientations=quaternions)


def changed(demonstration: Demonstration, at: slice, moved_m: np.ndarray) -> Demonstration:
    positions = demonstration.positions.copy()
    positions[at] += moved_m
    return demonstration._replace(positions=positions)


def serious(*demonstrations: Demonstration) -> list[str]:
    return [finding.text for finding in findings(TASK, demonstrations) if finding.serious]


def texts(*demonstrations: Demonstration) -> list[str]:
    return [finding.text for finding in findings(TASK, demonstrations)]
