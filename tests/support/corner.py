"""A small task with learned models, made from lines and an arc: no data set needed.

A conftest makes its fixtures known by importing them.
"""

from __future__ import annotations

import numpy as np
import pytest

from hmcs.motion.demonstrations import Demonstration
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.task import Task

DEAD_ZONE_M = 0.01


def make_task() -> Task:
    return Task.model_validate(
        {
            "format": "hmcs-task/1",
            "name": "corner",
            "description": "Along, round and up",
            "dead_zone_m": DEAD_ZONE_M,
            "gestemes": [{"name": "along"}, {"name": "round"}, {"name": "up"}],
            "states": [
                {"name": "go", "gestemes": ["along"], "next": ["turn"]},
                {"name": "turn", "gestemes": ["round"], "next": ["rise"]},
                {"name": "rise", "gestemes": ["up"], "next": ["go"]},
            ],
            "start": ["go"],
            "workspace": {"lower_m": [-1, -1, -1], "upper_m": [1, 1, 1], "obstacles": []},
            "robot": {
                "model": "puma560",
                "tool_start_m": [0.5, 0, 0.5],
                "tool_orientation_xyzw": [0, 0, 0, 1],
            },
        }
    )


def curve(gesteme: str) -> np.ndarray:
    u = np.linspace(0, 1, 120)[:, None]
    if gesteme == "along":
        return np.hstack([0.25 * u, 0 * u, 0 * u])
    if gesteme == "up":
        return np.hstack([0 * u, 0 * u, 0.2 * u])
    angle = u * np.pi
    return 0.08 * np.hstack([np.sin(angle), 1 - np.cos(angle), 0 * u])


def perform(order: list[str], seed: int) -> Demonstration:
    """One hand performing gestemes in turn, with a smooth error of some millimeters."""
    rng = np.random.default_rng(seed)
    state_of = {"along": "go", "round": "turn", "up": "rise"}
    pieces, labels = [], []
    here = np.zeros(3)
    for gesteme in order:
        ideal = curve(gesteme)
        wobble = np.cumsum(rng.normal(0, 4e-4, size=ideal.shape), axis=0)
        piece = here + ideal * rng.uniform(0.95, 1.05) + wobble - wobble[0]
        pieces.append(piece if not pieces else piece[1:])
        labels += [state_of[gesteme]] * len(pieces[-1])
        here = piece[-1]
    positions = np.concatenate(pieces)
    return Demonstration(
        f"seed-{seed}", np.arange(len(positions)) / 100.0, positions, tuple(labels)
    )


@pytest.fixture(scope="session")
def task() -> Task:
    return make_task()


@pytest.fixture(scope="session")
def performances():
    """`performances(order, seed)` returns a demonstration."""
    return perform


@pytest.fixture(scope="session")
def model(task: Task) -> Model:
    return learn(task, [perform(["along", "round", "up"], seed) for seed in range(4)])
