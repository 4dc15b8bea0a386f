"""The whole stack at 100 Hz: the processor time it takes, and how the robot keeps its velocity."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import psutil

from bench.figures import Figure, tell
from hmcs.bus.messages import RobotState
from hmcs.bus.session import Received
from hmcs.motion.demonstrations import Demonstration, write_csv
from hmcs_local.processes import StackProcess
from hmcs_trainer.training import train
from support.stack import Stack

CORES = 1.0
TRACKING_MM_S = 3.0
SPEED_M_S = 0.2
RADIUS_M = 0.1
SHAPES = ("GShape", "NShape", "PShape", "JShape", "Snake")
_SETTLED_S = 0.5
"""After each press of the dead-man: the arm has come to speed."""
_ENOUGH = 50
"""States at the whole speed; a hand that a busy machine made let go needs more than the span."""


def measure(span_s: float) -> list[Figure]:
    """Run the stack for a while on a hand that goes round in circles at 200 mm/s."""
    with tempfile.TemporaryDirectory() as folder, Stack(Path(folder) / "logs") as stack:
        model = Path(folder) / "model.hmcs"
        train("human-shapes", [f"lasa:{shape}/1-2" for shape in SHAPES], model)
        bus = stack.open_bus("observer", "o")
        stack.watch(bus)
        states: list[Received[RobotState]] = []
        bus.subscribe(RobotState, bus.keys.robot_state, states.append)
        services = [
            stack.start("robot", "r"),
            stack.start("fixture_controller", "f", "--models", json.dumps([str(model)])),
            stack.start("gesteme_classifier", "a", "--model", model),
            stack.start("gesteme_classifier", "b", "--model", model),
            stack.start("task_hmm", "t", "--model", model),
            stack.start(
                "input_device",
                "i",
                *("--source", "recorded", "--demonstration", _circle(Path(folder))),
                *("--rate-hz", 100, "--repeat", 0, "--lead-in-s", 0.4),
            ),
        ]
        stack.until_ready(*services)
        stack.until(lambda: any(r.body.stop == "none" for r in states))
        processes = [stack.router, *services]
        before, began_s = cpu_s(processes), time.monotonic()
        states.clear()
        while time.monotonic() - began_s < span_s:
            bus.pump(0.1)
        spent = [
            (after - first) / (time.monotonic() - began_s)
            for after, first in zip(cpu_s(processes), before, strict=True)
        ]
        stack.until(lambda: len(_tracking_errors_m_s(states)) >= _ENOUGH)
    errors = _tracking_errors_m_s(states)
    return [
        *(
            Figure(f"CPU of {process.service} {process.instance}", share, "cores")
            for process, share in zip(processes, spent, strict=True)
        ),
        Figure("CPU of the whole stack at 100 Hz", sum(spent), "cores", at_most=CORES),
        Figure(
            "robot velocity tracking at 200 mm/s, rms",
            1e3 * float(np.sqrt(np.mean(errors**2))),
            "mm/s",
            at_most=TRACKING_MM_S,
        ),
    ]


def _tracking_errors_m_s(states: list[Received[RobotState]]) -> np.ndarray:
    """Return the tool's velocity errors while it is asked for the whole speed, shape (T,)."""
    errors, since_ns = [], None
    for received in states:
        state = received.body
        if state.stop != "none":
            since_ns = None
            continue
        since_ns = since_ns or received.received_ns
        asked = float(np.linalg.norm(state.reference_twist[:3]))
        if received.received_ns - since_ns > _SETTLED_S * 1e9 and asked > 0.9 * SPEED_M_S:
            errors.append(np.linalg.norm(state.tool_twist[:3] - state.reference_twist[:3]))
    return np.array(errors)


def _circle(folder: Path) -> Path:
    """Write a way round and round at a steady speed, from where the tool starts."""
    rounds = 4
    angle = np.linspace(0.0, 2.0 * np.pi * rounds, 400 * rounds)
    positions = np.stack(
        [0.6 + 0.0 * angle, RADIUS_M * np.sin(angle), -RADIUS_M * np.cos(angle)], axis=1
    )
    path = folder / "circle.csv"
    time_s = angle * RADIUS_M / SPEED_M_S
    write_csv(path, Demonstration("circle", time_s, positions, (None,) * len(angle)))
    return path


def cpu_s(processes: Sequence[StackProcess]) -> list[float]:
    """Return the processor time each has used so far, s."""
    times = [psutil.Process(process.pid).cpu_times() for process in processes]
    return [each.user + each.system for each in times]


if __name__ == "__main__":
    raise SystemExit(not tell(__doc__, measure(20.0)))
