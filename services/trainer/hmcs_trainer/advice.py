"""What would make a model better, in words."""

from __future__ import annotations

import numpy as np

from hmcs.recognition.model import Model
from hmcs_trainer.judging import Judgment

MUCH_CONFUSED = 0.05
"""Two states are confused that are taken for each other in more than this share of their steps."""
LATE_STEPS = 3.0
WIDE_SHARE = 0.1
"""Demonstrations of a gesteme that lie farther apart than this share of its length lie far apart.
"""


def advice(model: Model, judgment: Judgment) -> list[str]:
    """Return what to do next, the most important first; at least one sentence."""
    sentences = [*_confused(model, judgment), *_late(judgment), *_wide(model)]
    if not judgment.left_out:
        sentences.insert(
            0,
            "No demonstration can be left out, so nobody knows how well this model recognizes: "
            "show the whole task at least twice.",
        )
    return sentences or [
        "Nothing stands out: states are recognized correctly and soon, and demonstrations agree."
    ]


def _confused(model: Model, judgment: Judgment) -> list[str]:
    matrix = judgment.confusion
    both = matrix + matrix.T
    of_state = matrix.sum(axis=1)
    found = []
    for a in range(len(matrix)):
        for b in range(a + 1, len(matrix)):
            steps = of_state[a] + of_state[b]
            share = both[a, b] / steps if steps else 0.0
            if share > MUCH_CONFUSED:
                rarer = a if of_state[a] <= of_state[b] else b
                names = model.state_names
                found.append(
                    (
                        share,
                        f"{names[a]} and {names[b]} are confused in {share:.0%} of their steps; "
                        f"two more demonstrations of {names[rarer]}, or a larger difference at "
                        "its start, would help most.",
                    )
                )
    return [text for _, text in sorted(found, reverse=True)]


def _late(judgment: Judgment) -> list[str]:
    late = judgment.scores.switch_delay(95) if judgment.left_out else float("nan")
    if not late > LATE_STEPS:
        return []
    return [
        f"One change of state in twenty is seen more than {late:.0f} steps late: begin the parts "
        "of the task more clearly, or lower dead_zone_m."
    ]


def _wide(model: Model) -> list[str]:
    found = []
    for name, spread in model.spreads.items():
        length_m = model.paths[name].length_m
        widest = float(np.max(spread))
        if widest > WIDE_SHARE * length_m:
            found.append(
                f"Demonstrations of {name} lie up to {1e3 * widest:.0f} mm apart on a way of "
                f"{1e3 * length_m:.0f} mm: its guide is no better known than that; set "
                "tight_spread_m, or show it more alike."
            )
    return found
