"""Evidence of the newest steps, put together from what several classifiers say of each."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from hmcs.bus.messages import Belief, Evidence

STEPS = 8
"""So many steps are kept: a belief comes a little after its evidence, and after that of others."""


class StepEvidence(NamedTuple):
    """What was made of the newest steps of one recognizer."""

    by_step: Mapping[tuple[str, int], tuple[Evidence, ...]] = MappingProxyType({})
    """By clock and step, in order of their coming."""


def with_evidence(before: StepEvidence, evidence: Evidence) -> StepEvidence:
    """Return what is known once more evidence has come."""
    step = evidence.clock, evidence.step
    if step in before.by_step:
        return StepEvidence({**before.by_step, step: (*before.by_step[step], evidence)})
    newest = list(before.by_step.items())[-STEPS + 1 :]
    return StepEvidence({**dict(newest), step: (evidence,)})


def evidence_of(belief: Belief, known: StepEvidence) -> tuple[Evidence, ...]:
    """Return the evidence a belief stands on; of another model than the belief's there is none."""
    found = known.by_step.get((belief.clock, belief.step), ())
    return tuple(each for each in found if each.model_hash == belief.model_hash)


def usable(evidence: Evidence) -> bool:
    """Whether the arrays of evidence fit one another."""
    pairs = len(evidence.pair_gesteme)
    held = evidence.pair_gesteme
    return (len(evidence.pair_start), len(evidence.log_ratio)) == (pairs, pairs) and (
        not pairs or (held.min() >= 0 and held.max() < len(evidence.gestemes))
    )
