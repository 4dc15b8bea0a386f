"""A tick of the fixture controller: the whole law in free space, and at meshes."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
import trimesh

from bench.figures import Figure
from hmcs.fixtures.compliance.trust import SegmentBelief
from hmcs.fixtures.controller.controller import Controller
from hmcs.fixtures.controller.interface import Guides, OperatorSample
from hmcs.fixtures.controller.rules import Safeguards, rules_of
from hmcs.fixtures.regions.forbidden import Region
from hmcs.fixtures.regions.meshes import Mesh
from hmcs.motion.paths import Path
from hmcs.task import load_task

TICK_US = 100.0
CLOSEST_US = 50.0
MESH_TICK_US = 300.0
RADIUS_M = 0.2
TRIANGLE_M = 0.0017
"""About the length of an edge of the mesh: the reach of a closest-point query."""
PERIOD_S = 0.01


class Work(NamedTuple):
    """Something to be timed, and what comes before it."""

    run: Callable[[], object]
    prepare: Callable[[], object] = lambda: None


def measure(ticks: int) -> list[Figure]:
    """Measure so many ticks of each; a time is their median."""
    ball = trimesh.creation.icosphere(6, RADIUS_M)
    # Stretched, so that no two directions are alike.
    vertices = np.asarray(ball.vertices) * [1.0, 0.9, 0.8]
    triangles = np.asarray(ball.faces, dtype=np.int64)
    mesh = Mesh(vertices, triangles)
    rng = np.random.default_rng(0)
    away = rng.normal(size=(ticks, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    surface = away * RADIUS_M * [1.0, 0.9, 0.8]
    near = surface + 0.5 * TRIANGLE_M * away
    queries = [Work(partial(mesh.candidates, point, TRIANGLE_M)) for point in near]
    # A tool at the origin is 1 mm beside it.
    wall = Mesh(vertices - [0.0, 0.9 * RADIUS_M + 0.001, 0.0], triangles)
    return [
        Figure("tick without regions", median_us(session((), ticks)), "µs", at_most=TICK_US),
        Figure(
            f"closest points, {len(ball.faces)} triangles",
            median_us(queries),
            "µs",
            at_most=CLOSEST_US,
        ),
        Figure(
            "tick sliding along that mesh",
            median_us(session((wall,), ticks)),
            "µs",
            at_most=MESH_TICK_US,
        ),
    ]


def session(regions: tuple[Region, ...], ticks: int) -> list[Work]:
    """Ticks of a controller that guides along a line; the robot stays where the wall is."""
    controller = Controller(Safeguards())
    line = Path(np.array([[0.0, 0, 0], [5.0, 0, 0]]))
    controller.load("m", Guides({"x": line}, rules_of(load_task("human-shapes")), regions))
    controller.activate("m")
    hand = np.array([0.1, -0.002, 0.0, 0.0, 0.0, 0.0])
    move = hand[:3] * PERIOD_S
    controller.robot_moved(0.0, np.zeros(3))
    controller.on_sample(0.0, OperatorSample(0, np.zeros(3), np.zeros(6), False, False))

    def between(number: int) -> None:
        controller.robot_moved(number * PERIOD_S, np.zeros(3))
        controller.on_step(number * PERIOD_S, number - 1, move * (number - 1), move, None)
        controller.on_belief("m", SegmentBelief(number - 1, "s", 1.0, "x", 0, 0.0, False, True))

    def tick(number: int) -> object:
        sample = OperatorSample(number, move * number, hand, True, False)
        return controller.on_sample(number * PERIOD_S, sample)

    return [Work(partial(tick, n), partial(between, n)) for n in range(1, ticks + 1)]


def median_us(works: Sequence[Work]) -> float:
    """Do each once and return the median time, µs."""
    durations_ns = []
    for work in works:
        work.prepare()
        began_ns = time.perf_counter_ns()
        work.run()
        durations_ns.append(time.perf_counter_ns() - began_ns)
    return 1e-3 * float(np.median(durations_ns))
