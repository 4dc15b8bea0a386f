"""From what was seen on the bus to what it means: truth beside belief, paths, latencies.

Pure: a recording, the performance that was played and the model go in, arrays come out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.paths import Path
from hmcs.recognition.model import Model
from hmcs.recognition.scoring import NONE, Scores, midway_labels, score
from hmcs_demo.recording import NO_SAMPLE, Beliefs, Recording
from hmcs_demo.tracks import Track, track
from hmcs_demo.truth import RunError, SampleClock, TrueStateInterval

IntArray = NDArray[np.int64]

ASKED_FOR = ("disengaged", "no_command")
"""Why a robot stands when its operator has let go of the dead-man."""

_NS_PER_MS = 1_000_000


class Hops(NamedTuple):
    """Latencies, ms: one for each operator sample, or step, that has one."""

    input_to_command: Array
    input_to_robot: Array
    step_to_belief: Array


class Measured(NamedTuple):
    """One run, ready to be drawn and summed up. Times in s count from the hand's first motion."""

    states: tuple[str, ...]
    clock: SampleClock
    segments: tuple[TrueStateInterval, ...]
    step_end: IntArray
    """Number of the played sample that completed each step, shape (T,)."""
    step_time_s: Array
    """When that was, shape (T,)."""
    probabilities: Array
    """P(state) after each step, NaN where there was no belief, shape (T, S)."""
    unknown: Array
    """P(unknown) after each step, shape (T,)."""
    true_states: IntArray
    """Shape (T,)."""
    believed_states: IntArray
    """The most probable ones, NONE where there was no belief, shape (T,)."""
    degraded_steps: int
    scores: Scores
    hand: Track
    tool: Track
    factor_time_s: Array
    factor: Array
    """k of the fixture at `factor_time_s`."""
    hops: Hops
    belief_delay_ms: Array
    """From each Step to its Belief or, where it is missing, to the next one or the end; (T,)."""
    tracking_error_m_s: Array
    """Norm of the tool's velocity less its reference, at each state of the driven robot."""
    collisions: int
    stops: int
    """How often the robot, or the fixture, stopped by itself while the operator drove it."""
    motion_s: float


def measure(
    recording: Recording, performance: Demonstration, model: Model, rate_hz: float
) -> Measured:
    """Return what a recording of `performance`, played at `rate_hz`, amounts to.

    Raises RunError where the recording shows no motion, no step, no belief, no command or no
    robot, or another motion than the performance.
    """
    for what, rows in (
        ("motion", recording.motions.sample),
        ("step", recording.steps.number),
        ("belief", recording.beliefs.step),
        ("command", recording.commands.sample),
        ("robot state", recording.robot.sample),
    ):
        if not len(rows):
            raise RunError(f"no {what} was seen on the bus: the logs of the services say why")

    clock = SampleClock(performance, model.state_names, rate_hz, recording.motions)
    segments, learned = clock.segments, _learned(model)
    steps, motions, robot = recording.steps, recording.motions, recording.robot
    step_end = clock.number(steps.sample)
    true = midway_labels(clock.labels, np.concatenate([[0], step_end[:-1]]), step_end)
    row = _rows_of(recording.beliefs, steps.number)
    answered = row != NONE
    probabilities = np.where(answered[:, None], recording.beliefs.probabilities[row], np.nan)
    believed = np.where(answered, recording.beliefs.probabilities[row].argmax(axis=1), NONE)
    answer_ns = np.where(answered, recording.beliefs.received_ns[row], motions.received_ns[-1])
    delay_ms = _delays_ms(steps.received_ns, answer_ns)
    driven = robot.sample != NO_SAMPLE
    stood = np.diff(np.flatnonzero(driven), prepend=np.argmax(driven)) > 1

    return Measured(
        states=model.state_names,
        clock=clock,
        segments=segments,
        step_end=step_end,
        step_time_s=clock.seconds(steps.captured_ns),
        probabilities=probabilities,
        unknown=np.where(answered, recording.beliefs.unknown[row], np.nan),
        true_states=true,
        believed_states=believed,
        degraded_steps=int((recording.beliefs.missing_gestemes[row[answered]] > 0).sum()),
        scores=score(true, believed),
        hand=track(
            clock.number(motions.sample[motions.dead_man]),
            motions.position[motions.dead_man],
            segments,
            learned,
            clock.positions,
        ),
        tool=track(
            clock.number(robot.sample[driven]),
            robot.tool_position[driven],
            segments,
            learned,
            clock.positions,
            stood,
        ),
        factor_time_s=clock.seconds(recording.fixtures.received_ns),
        factor=recording.fixtures.factor,
        hops=_hops(recording, delay_ms[answered]),
        belief_delay_ms=delay_ms,
        tracking_error_m_s=np.linalg.norm(
            robot.tool_velocity[driven] - robot.reference_velocity[driven], axis=1
        ),
        collisions=_onsets(robot.in_contact),
        stops=_stops(recording),
        motion_s=clock.motion_s,
    )


def longest_delay_ms(measured: Measured, at_s: float, within_s: float) -> float:
    """Return the longest time from a step to its belief among steps so near to a moment, ms."""
    near = np.abs(measured.step_time_s - at_s) <= within_s
    return float(measured.belief_delay_ms[near].max(initial=0.0))


def missing_between(measured: Measured, from_s: float, to_s: float) -> int:
    """Return how many of the steps completed within a time have no belief."""
    within = (measured.step_time_s >= from_s) & (measured.step_time_s <= to_s)
    return int((within & (measured.believed_states == NONE)).sum())


def _learned(model: Model) -> list[Path | None]:
    paths = model.paths
    return [
        paths[state.gestemes[0]] if len(state.gestemes) == 1 else None
        for state in model.task.states
    ]


def _rows_of(beliefs: Beliefs, index: IntArray) -> IntArray:
    """The row of the first belief of each step, NONE where there is none."""
    rows = {int(step): row for row, step in reversed(list(enumerate(beliefs.step)))}
    return np.array([rows.get(int(step), NONE) for step in index], dtype=np.int64)


def _delays_ms(asked_ns: IntArray, answer_ns: IntArray) -> Array:
    """A step that was never answered waits for the answer to a later one."""
    until_ns = np.minimum.accumulate(answer_ns[::-1])[::-1]
    return np.asarray((until_ns - asked_ns) / _NS_PER_MS)


def _hops(recording: Recording, step_to_belief: Array) -> Hops:
    commands, robot = recording.commands, recording.robot
    engaged = commands.engaged & (commands.sample != NO_SAMPLE)
    driven = np.flatnonzero(robot.sample != NO_SAMPLE)
    _, first = np.unique(robot.sample[driven], return_index=True)
    seen = driven[first]
    return Hops(
        (commands.received_ns - commands.captured_ns)[engaged] / _NS_PER_MS,
        (robot.received_ns - robot.captured_ns)[seen] / _NS_PER_MS,
        step_to_belief,
    )


def _stops(recording: Recording) -> int:
    """A robot that stands as the fixture says counts too, unless the operator has let go."""
    motions, robot = recording.motions, recording.robot
    stands = robot.stop != "none"
    begins = stands & np.concatenate([[False], ~stands[:-1]])
    newest = np.searchsorted(motions.received_ns, robot.received_ns, side="right") - 1
    pressed = (newest >= 0) & motions.dead_man[newest]
    return int((begins & (pressed | ~np.isin(robot.stop, ASKED_FOR))).sum())


def _onsets(so: NDArray[np.bool_]) -> int:
    before = np.concatenate([[False], so[:-1]])
    return int((so & ~before).sum())
