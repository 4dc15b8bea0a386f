"""Tiny layered models and every segmentation of a few steps under them."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from hmcs.recognition.recognizer import StepEvidence
from hmcs.recognition.segment_filter.filter import FilterSettings
from hmcs.recognition.task_chain import TaskChain

SETTINGS = FilterSettings(
    any_state=0.05, again=0.3, unknown_after=0.02, abandon=0.01, recover=0.1, drop_below=0.0
)
UNKNOWN = "unknown"


def random_chain(rng, states=2, gestemes=2, shared=True):
    """Two states; with `shared`, one gesteme serves both and one state has two gestemes."""
    slots = [(0, 0), (0, 1), (1, 1)] if shared else [(q, q % gestemes) for q in range(states)]
    transition = rng.dirichlet(np.ones(states), size=states)
    transition[-1] *= 0.7
    counts = defaultdict(int)
    for state, _ in slots:
        counts[state] += 1
    return TaskChain(
        rng.dirichlet(np.ones(states)),
        transition,
        np.array([s for s, _ in slots], dtype=np.int32),
        np.array([g for _, g in slots], dtype=np.int32),
        np.array([1.0 / counts[s] for s, _ in slots]),
    )


def random_evidence(rng, steps, gestemes=2, absent=()):
    """For each step the exit and log ratio of every (gesteme, start), as a dense array."""
    exits = rng.uniform(0, 0.6, size=(steps, gestemes, steps))
    ratios = rng.normal(0, 1.5, size=(steps, gestemes, steps))
    result = []
    for t in range(steps):
        held = [g for g in range(gestemes) if (t, g) not in absent]
        pairs = [(g, s) for s in range(t + 1) for g in held]
        result.append(
            StepEvidence(
                t,
                tuple(held),
                np.array([g for g, _ in pairs], dtype=np.int32),
                np.array([s for _, s in pairs], dtype=np.int32),
                np.array([exits[t, g, s] if s < t else 0.0 for g, s in pairs]),
                np.array([ratios[t, g, s] for g, s in pairs]),
            )
        )
    return result


def enumerate_segmentations(chain, evidence):
    """Probability of each segmentation: a list of segments (slot, start) and unknown steps.

    Written as a generator of whole histories, without any of the filter's recursion: a history is
    the hypothesis at every step, and its weight the product of what each step costs.
    """
    states = len(chain.initial)

    def lookup(t, slot, start):
        g = int(chain.slot_gesteme[slot])
        if g not in evidence[t].gestemes:
            return 0.0, 1.0
        hit = (evidence[t].pair_gesteme == g) & (evidence[t].pair_start == start)
        if not hit.any():
            return 0.0, 0.0
        return float(evidence[t].exit[hit][0]), float(np.exp(evidence[t].log_ratio[hit][0]))

    def opening(slot, state_probability):
        return state_probability[chain.slot_state[slot]] * chain.slot_share[slot]

    def extend(t, history, weight):
        if t == len(evidence):
            yield history, weight
            return
        slots = range(len(chain.slot_state))
        expected = 1 - SETTINGS.any_state - SETTINGS.unknown_after
        if t == 0:
            options = [
                ((k, 0), opening(k, chain.initial) * (1 - SETTINGS.unknown_after)) for k in slots
            ]
            options.append((UNKNOWN, SETTINGS.unknown_after))
        elif history[-1] == UNKNOWN:
            anywhere = np.full(states, 1 / states)
            options = [((k, t), SETTINGS.recover * opening(k, anywhere)) for k in slots]
            options.append((UNKNOWN, 1 - SETTINGS.recover))
        else:
            slot, start = history[-1]
            leave, _ = lookup(t, slot, start)
            row = chain.transition[chain.slot_state[slot]]
            ended = expected * (1 - row.sum())
            follow = expected * row + (SETTINGS.any_state + SETTINGS.again * ended) / states
            options = [((k, t), leave * opening(k, follow)) for k in slots]
            options.append(((slot, start), (1 - leave) * (1 - SETTINGS.abandon)))
            options.append(
                (
                    UNKNOWN,
                    (1 - leave) * SETTINGS.abandon
                    + leave * (SETTINGS.unknown_after + (1 - SETTINGS.again) * ended),
                )
            )
        for hypothesis, p in options:
            ratio = 1.0 if hypothesis == UNKNOWN else lookup(t, *hypothesis)[1]
            yield from extend(t + 1, [*history, hypothesis], weight * p * ratio)

    yield from extend(0, [], 1.0)
