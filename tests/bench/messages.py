"""Messages: bytes there and back, for the largest message of the hot path."""

from __future__ import annotations

import time

import numpy as np

from bench.figures import Figure, tell
from hmcs.bus.examples import ENVELOPE, EXAMPLES
from hmcs.bus.messages import Belief, Command, Evidence, Message, Motion, RobotState, Step
from hmcs.bus.wire import decode, encode
from support.shapes import SHAPES

AT_MOST_US = 50.0
PAIRS = 320
"""Living pairs of 25 gestemes at most, as the step-to-belief figure sees them."""
SMALLER = (Motion, Step, Belief, Command, RobotState)


def largest() -> Evidence:
    """Return the evidence of one classifier that holds 25 gestemes, all of them alive."""
    rng = np.random.default_rng(0)
    return Evidence(
        model_hash="0123456789abcdef",
        clock="0123456789ab",
        step=1000,
        gestemes=SHAPES,
        pair_gesteme=rng.integers(0, len(SHAPES), PAIRS).astype(np.int32),
        pair_start=rng.integers(700, 1000, PAIRS).astype(np.int32),
        exit=rng.random(PAIRS).astype(np.float32),
        log_ratio=rng.normal(size=PAIRS).astype(np.float32),
    )


def measure(rounds: int) -> list[Figure]:
    """Measure every message of the hot path; only the largest has a goal."""
    smaller = [
        Figure(f"{type(example).SCHEMA}, there and back", _there_and_back_us(example, rounds), "µs")
        for example in EXAMPLES
        if isinstance(example, SMALLER)
    ]
    message = largest()
    return [
        *smaller,
        Figure("evidence of 25 gestemes", len(encode(message, ENVELOPE)), "bytes"),
        Figure(
            "evidence of 25 gestemes, there and back",
            _there_and_back_us(message, rounds),
            "µs",
            at_most=AT_MOST_US,
        ),
    ]


def _there_and_back_us(message: Message, rounds: int) -> float:
    times = []
    for _ in range(rounds):
        began_ns = time.perf_counter_ns()
        decode(encode(message, ENVELOPE), type(message))
        times.append(time.perf_counter_ns() - began_ns)
    return float(np.median(times)) * 1e-3


if __name__ == "__main__":
    raise SystemExit(not tell(__doc__, measure(5000)))
