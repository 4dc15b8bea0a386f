"""Segments: demonstrations cut at their labels, one performance of one gesteme each."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import Step, sampled_steps, steps_of_demonstration
from hmcs.task import Task

Integers = NDArray[np.int64]

_LONGEST_LABEL = 64
"""Characters of a label that a message quotes: no name of a state is longer."""


class LearningError(UserError):
    """Demonstrations that a model cannot be learned from; says which, why, and what to do."""

    def __init__(self, message: str, unquoted: str | None = None) -> None:
        super().__init__(message)
        self.unquoted = message if unquoted is None else unquoted
        """The message without what a file said instead of a name of the task."""


class Segment(NamedTuple):
    """One performance of one gesteme."""

    demonstration: str
    """Its name, for messages; two may have the same."""
    state: int
    """Index of the task state it was performed in."""
    gesteme: int
    """Index of the gesteme."""
    positions: Array
    """m, shape (T, 3)."""
    steps: tuple[Step, ...]
    after: Array | None = None
    """Displacement of the step that followed it, m, shape (3,); None where none is known."""
    orientations: Array | None = None
    """Of the hand, x y z w, shape (T, 4); None where they were not recorded."""
    demonstration_index: int = 0
    """Of the demonstration among all that were cut: what tells one from another."""

    def trajectory(self, axes: Sequence[int]) -> Trajectory:
        """Return the motion along these axes, from its own origin."""
        moves = np.array([step.displacement for step in self.steps])[:, list(axes)]
        lengths = np.linalg.norm(moves, axis=1)
        directions = moves / np.maximum(lengths, 1e-12)[:, None]
        positions = np.vstack([np.zeros(len(axes)), np.cumsum(moves, axis=0)])
        passing = directions[-2:].mean(axis=0)
        if self.after is not None:
            after = self.after[list(axes)]
            passing = passing + after / max(float(np.linalg.norm(after)), 1e-12)
        return Trajectory(positions, lengths, directions, passing)


class Trajectory(NamedTuple):
    """A segment's motion along D axes in T steps."""

    positions: Array
    """From the segment's origin, m, shape (T + 1, D)."""
    lengths: Array
    """Of the steps, m, shape (T,)."""
    directions: Array
    """Of the steps, unit vectors, shape (T, D)."""
    passing: Array
    """About the direction in which the end is passed, shape (D,)."""

    @property
    def observations(self) -> Array:
        """Place after each step, m, and its direction, shape (T, 2D)."""
        return np.hstack([self.positions[1:], self.directions])


class LabeledSteps(NamedTuple):
    """The steps of a whole demonstration and what the operator was doing in each."""

    steps: tuple[Step, ...]
    states: Integers
    """Index of the task state of each step, −1 where it has no label, shape (T,)."""
    gestemes: Integers
    """Index of the gesteme of each step, −1 where it has no label, shape (T,)."""


def segments_of(task: Task, demonstrations: Sequence[Demonstration]) -> list[Segment]:
    """Cut demonstrations at their labels.

    A label is a state's name, or `state/gesteme` where a state has several gestemes; unlabeled
    stretches are left out. Raises LearningError as `learn`.
    """
    if not demonstrations:
        raise LearningError(f"no demonstrations of task {task.name!r}: give at least one")
    segments: list[Segment] = []
    for index, demonstration in enumerate(demonstrations):
        check_arrays(demonstration)
        labeled, own, last = False, list[Segment](), -1
        for label, samples in demonstration.stretches:
            if label is None:
                continue
            labeled = True
            state, gesteme = _meant(task, label, demonstration, samples.start)
            piece = demonstration.cut(samples.start, samples.stop)
            positions = piece.positions
            steps = tuple(steps_of_demonstration(piece, task.dead_zone_m))
            if len(steps) < 2:
                raise LearningError(
                    f"demonstration {demonstration.name!r}: the stretch labeled {label!r} from "
                    f"{demonstration.time_s[samples.start]:.2f} s on moves "
                    f"{_extent(positions):.4f} m and makes {len(steps)} steps, but 2 are "
                    f"needed: demonstrate it larger or lower dead_zone_m ({task.dead_zone_m})"
                )
            if own and samples.start == last:
                own[-1] = own[-1]._replace(after=steps[0].displacement)
            own.append(
                Segment(
                    demonstration.name,
                    state,
                    gesteme,
                    positions,
                    steps,
                    orientations=piece.orientations,
                    demonstration_index=index,
                )
            )
            last = samples.stop - 1
        segments += own
        if not labeled:
            raise LearningError(
                f"demonstration {demonstration.name!r} has no labels: add a column 'state' with "
                f"one of {', '.join(state.name for state in task.states)}; label a recording on "
                "the page's timeline or with `hmcs label`; or train with --find-states"
            )
    return segments


def labeled_steps(task: Task, demonstration: Demonstration) -> LabeledSteps:
    """Return the steps of a demonstration, each with the label of the sample midway in it.

    Raises LearningError for a label that is no state of the task.
    """
    meant = {
        label: (-1, -1) if label is None else _meant(task, label, demonstration, samples.start)
        for label, samples in demonstration.stretches
    }
    sampled = list(sampled_steps(demonstration, task.dead_zone_m))
    labels = [meant[demonstration.states[(begin + end) // 2]] for _, begin, end in sampled]
    columns = np.array(labels, dtype=np.int64).reshape(-1, 2)
    return LabeledSteps(tuple(step for step, _, _ in sampled), columns[:, 0], columns[:, 1])


def _meant(task: Task, label: str, demonstration: Demonstration, sample: int) -> tuple[int, int]:
    """State and gesteme that the label of a sample names."""
    short_label = label[:_LONGEST_LABEL]
    quoted = f"demonstration {demonstration.name!r}: label {short_label!r}"
    unquoted = f"demonstration {demonstration.name!r}: its label"
    at = f"at {demonstration.time_s[sample]:.2f} s"
    state_name, _, chosen = label.partition("/")
    names = [state.name for state in task.states]
    if state_name not in names:
        near = get_close_matches(state_name[:_LONGEST_LABEL], names, n=1)
        guess = f", did you mean {near[0]!r}?" if near else ""
        wrong = f"{at} is no state of task {task.name!r}{guess} (states are {', '.join(names)})"
        raise LearningError(f"{quoted} {wrong}", f"{unquoted} {wrong}")
    index = names.index(state_name)
    state = task.states[index]
    if not chosen and len(state.gestemes) == 1:
        chosen = state.gestemes[0]
    if chosen not in state.gestemes:
        choices = " or ".join(f"{state_name}/{name}" for name in state.gestemes)
        wrong = f"{at} does not name one of the gestemes of state {state_name!r}; write {choices}"
        raise LearningError(f"{quoted} {wrong}", f"{unquoted} {wrong}")
    return index, [gesteme.name for gesteme in task.gestemes].index(chosen)


def check_arrays(demonstration: Demonstration) -> None:
    """Raise LearningError for arrays that no file could have held; those of files are checked as
    they are read."""
    name, samples = demonstration.name, len(demonstration.positions)
    expected = {
        "time_s": (samples,),
        "positions": (samples, 3),
        "orientations": (samples, 4),
        "wrenches": (samples, 6),
    }
    for field, shape in expected.items():
        values = getattr(demonstration, field)
        if values is None:
            continue
        if np.shape(values) != shape:
            raise LearningError(
                f"demonstration {name!r}: {field} have shape {np.shape(values)}, expected {shape}: "
                "give a row a sample, with z = 0 in a plane"
            )
        if not np.isfinite(values).all():
            row = int(np.flatnonzero(~np.isfinite(values).reshape(samples, -1).all(axis=1))[0])
            raise LearningError(
                f"demonstration {name!r}: {field} of sample {row} are not finite: leave it out"
            )
    if samples < 2:
        raise LearningError(f"demonstration {name!r} has {samples} samples: give two at least")
    if len(demonstration.states) != samples:
        raise LearningError(
            f"demonstration {name!r} has {len(demonstration.states)} labels for {samples} samples: "
            "give one each, None where the motion belongs to no state"
        )
    late = np.flatnonzero(np.diff(demonstration.time_s) <= 0)
    if len(late):
        raise LearningError(
            f"demonstration {name!r}: time_s of sample {late[0] + 1} is not after the one before: "
            "times must rise"
        )


def _extent(positions: Array) -> float:
    return float(np.linalg.norm(np.ptp(positions, axis=0)))
