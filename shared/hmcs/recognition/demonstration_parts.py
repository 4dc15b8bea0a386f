"""Whole demonstrations segmented afterwards: which part of the task their samples are."""

from __future__ import annotations

from typing import NamedTuple

from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import sampled_steps
from hmcs.recognition.model import Model
from hmcs.recognition.registry import segmentation_of
from hmcs.recognition.segmentation import label_of


class Part(NamedTuple):
    """A segment of a demonstration."""

    label: str | None
    """A state, or `state/gesteme` where the state has several; None for unknown motion."""
    begin: int
    """Index of its first sample."""
    end: int
    """Index of its last sample, which is the first one of the next part."""
    steps: int
    """So many steps are in it."""
    probability: float
    """Mean over its steps of P(state | the whole motion)."""


def parts_of(
    model: Model, demonstration: Demonstration, *, anywhere: bool = False
) -> tuple[Part, ...]:
    """Return the parts of a whole demonstration by a model; labels that it has do not count.

    The last one has all samples to the end; there is none where the motion has no step. Raises as
    `segmentation_of` does.
    """
    sampled = list(sampled_steps(demonstration, model.task.dead_zone_m))
    found = segmentation_of(model, [each.step for each in sampled], anywhere=anywhere)
    last = len(demonstration.positions) - 1
    return tuple(
        Part(
            label_of(model.task, segment),
            sampled[segment.start].begin,
            last if segment.stop == len(sampled) else sampled[segment.stop - 1].end,
            segment.stop - segment.start,
            segment.probability,
        )
        for segment in found
    )
