"""A small task with every sense, for what all recognizers promise: no data set needed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import Step, steps_of_demonstration
from hmcs.task import Task

ROUND = ("reach", "turn", "lift", "turn-back")
"""States in the order they are demonstrated; both turns are the same gesteme."""

_FORCE_N = {"reach": (4.0, 0.0, 0.0), "turn": (0.0, 4.0, 0.0), "lift": (0.0, 0.0, 6.0)}
_RATE_HZ = 100.0


def lesson_task() -> Task:
    """Return a task of four states and three gestemes."""
    states = [
        {"name": name, "gestemes": [gesteme_of(name)], "next": [after]}
        for name, after in zip(ROUND, (*ROUND[1:], ROUND[0]), strict=True)
    ]
    return Task.model_validate(
        {
            "format": "hmcs-task/1",
            "name": "lesson",
            "dead_zone_m": 0.01,
            "gestemes": [{"name": name} for name in ("reach", "turn", "lift")],
            "states": states,
            "start": [ROUND[0]],
            "workspace": {"lower_m": [-1, -1, -1], "upper_m": [2, 2, 2], "obstacles": []},
            "robot": {
                "model": "puma560",
                "tool_start_m": [0.5, 0, 0.5],
                "tool_orientation_xyzw": [0, 0, 0, 1],
            },
        }
    )


def gesteme_of(state: str) -> str:
    """Return the gesteme a state of the task is performed with."""
    return "turn" if state == "turn-back" else state


def performed(seed: int, states: tuple[str, ...] = ROUND) -> Demonstration:
    """Return one hand performing states in turn, with its orientation and the force it uses."""
    rng = np.random.default_rng(seed)
    here, positions, wrenches, labels = np.zeros(3), [np.zeros((1, 3))], [], []
    for state in states:
        ideal = _curve(gesteme_of(state)) * rng.uniform(0.95, 1.05)
        wobble = np.cumsum(rng.normal(0, 3e-4, ideal.shape), axis=0)
        piece = here + ideal + wobble - wobble[0]
        positions.append(piece[1:])
        force = np.array(_FORCE_N[gesteme_of(state)])
        wrenches.append(
            np.hstack(
                [force + rng.normal(0, 0.5, (len(piece) - 1, 3)), np.zeros((len(piece) - 1, 3))]
            )
        )
        labels += [state] * (len(piece) - 1)
        here = piece[-1]
    path = np.concatenate(positions)
    angle = np.linspace(0, np.pi / 3, len(path)) / 2
    turned = np.stack([0 * angle, 0 * angle, np.sin(angle), np.cos(angle)], axis=1)
    felt = np.concatenate([wrenches[0][:1], *wrenches])
    return Demonstration(
        f"seed-{seed}",
        np.arange(len(path)) / _RATE_HZ,
        path,
        (labels[0], *labels),
        turned,
        felt,
    )


def steps_performed(seed: int, states: tuple[str, ...] = ROUND) -> list[Step]:
    """Return the steps of such a performance, marked where a state begins."""
    return steps_of_demonstration(performed(seed, states), 0.01, mark_switches=True)


def _curve(gesteme: str) -> NDArray[np.float64]:
    u = np.linspace(0, 1, 100)[:, None]
    if gesteme == "reach":
        return np.hstack([0.25 * u, 0 * u, 0 * u])
    if gesteme == "lift":
        return np.hstack([0 * u, 0.02 * np.sin(np.pi * u), 0.2 * u])
    angle = u * np.pi
    return 0.07 * np.hstack([np.sin(angle), 1 - np.cos(angle), 0 * u])
