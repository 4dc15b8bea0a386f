"""Recognition of human motion: every way to hold out two of the seven drawings of each shape."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from bench.figures import Figure, tell
from hmcs.motion.chains import chained
from hmcs.motion.lasa import read_drawing
from hmcs.motion.steps import DeadZone
from hmcs.recognition.learning import learn
from hmcs.recognition.scoring import NONE, Scores, midway_labels, score
from hmcs.recognition.segment_filter.recognizer import SegmentFilterRecognizer
from hmcs.task import load_task

ACCURACY = 0.985
P95_DELAY_STEPS = 2.0
FALSE_SWITCHES = 1.0
"""In 1000 steps."""
NUMBERS = range(1, 8)
WAYS = tuple(combinations(NUMBERS, 2))


def measure(ways: Sequence[tuple[int, int]] = WAYS) -> list[Figure]:
    """Learn and recognize once for each way; the figures are means over them."""
    scores = [held_out(way) for way in ways]
    return [
        Figure("ways to hold out two of seven", len(scores)),
        Figure("state accuracy", _mean([s.accuracy for s in scores]), at_least=ACCURACY),
        Figure("state accuracy, worst way", min(s.accuracy for s in scores)),
        Figure(
            "switch delay, p95",
            _mean([s.switch_delay(95) for s in scores]),
            "steps",
            at_most=P95_DELAY_STEPS,
        ),
        Figure(
            "false switches in 1000 steps",
            _mean([s.false_switches_per_1000_steps for s in scores]),
            at_most=FALSE_SWITCHES,
        ),
        Figure("switches never believed", sum(s.missed_switches for s in scores)),
    ]


def held_out(numbers: tuple[int, int]) -> Scores:
    """Learn from the drawings with other numbers, recognize those with these, chained."""
    task = load_task("human-shapes")
    shapes = [gesteme.name for gesteme in task.gestemes]
    taught = [
        read_drawing(shape, number, task)
        for shape in shapes
        for number in NUMBERS
        if number not in numbers
    ]
    performed = chained(
        "held out",
        [read_drawing(shape, number, task) for number in numbers for shape in shapes],
        np.array(task.robot.tool_start_m),
    )
    model = learn(task, taught)
    recognizer = SegmentFilterRecognizer(model)
    zone, ends, believed, here = DeadZone(task.dead_zone_m), [], [], 0
    for sample, position in enumerate(performed.positions):
        step = zone.push(position)
        if step is not None:
            ends.append((here, sample))
            here = sample
            believed.append(int(recognizer.step(step).belief.states.argmax()))
    names = model.state_names
    labels = [NONE if state is None else names.index(state) for state in performed.states]
    begin, end = np.array(ends).T
    return score(midway_labels(labels, begin, end), believed)


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values))


if __name__ == "__main__":
    raise SystemExit(not tell(__doc__, measure()))
