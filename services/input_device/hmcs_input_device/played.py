"""The sources that come along: files that are played, simulated operators, a page, devices."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs.motion.closed_loop_operators import PRESETS, ClosedLoopOperator
from hmcs.motion.demonstrations import Demonstration, read_csv
from hmcs.motion.hand_guiding import hand_guiding_of
from hmcs.motion.operators import Operator, OperatorStuckError, TaskSegment, joined, perform
from hmcs.motion.paths import Path
from hmcs.motion.references import References, random_gesteme, random_performance
from hmcs.recognition.model_file import load_model
from hmcs.task import AXES, Task
from hmcs_input_device.devices.kinds import KINDS, source_of
from hmcs_input_device.held import page
from hmcs_input_device.logged import recording
from hmcs_input_device.playback import Passes, Playback
from hmcs_input_device.reaction import Reaction, ReEngaging
from hmcs_input_device.settings import InputDeviceSettings
from hmcs_input_device.simulated import Simulated
from hmcs_input_device.sources import SourceFactory

_SIMULATED_RATE_HZ = 100.0
_SPACING_M = 0.002


Played = Playback | ReEngaging


def recorded(settings: InputDeviceSettings, task: Task) -> Played:
    """Return a source that plays the demonstration of the settings.

    Raises UserError where there is none, it cannot be read, it is too small to make one step, or it
    has no labels to be marked.
    """
    if settings.demonstration is None:
        raise UserError(
            "demonstration: the source 'recorded' needs one: give a CSV file with --demonstration"
        )
    demonstration = read_csv(settings.demonstration)
    if settings.mark_switches and not demonstration.switches.any():
        raise UserError(
            f"{settings.demonstration}: has no labels, so that mark_switches has nothing to mark: "
            "add a column 'state', or leave mark_switches off"
        )
    source = _played(settings, demonstration)
    dead_zone_m = settings.dead_zone_m or task.dead_zone_m
    if source.reach_m < dead_zone_m:
        raise UserError(
            f"{settings.demonstration}: moves at most {source.reach_m:g} m from where it begins, "
            f"less than the dead zone of {dead_zone_m:g} m: it would make no step; set dead_zone_m "
            "below that, or record a larger motion"
        )
    return source


def synthetic(settings: InputDeviceSettings, task: Task) -> Played:
    """Return a source that plays a simulated operator performing the task (thesis, 3.1.5).

    What the operator means to do is the labeled motion of `demonstration`; without one, a random
    run through the task along the learned paths of `model`; without that, along random lines and
    arcs. Raises UserError where these do not fit the task, or the noise is too large to arrive.
    """
    rng = np.random.default_rng(settings.seed)
    operator = Operator(
        step_m=settings.step_m, noise=settings.noise, look_ahead_m=settings.look_ahead_m
    )
    try:
        made = perform(
            f"synthetic/{settings.seed}",
            _meant(settings, task, rng),
            operator,
            rng,
            speed_m_s=settings.operator_speed_m_s,
            rate_hz=settings.rate_hz or _SIMULATED_RATE_HZ,
        )
    except OperatorStuckError as error:
        raise UserError(f"source: the simulated operator did not arrive: {error}") from error
    return _played(settings, made)


def simulated(settings: InputDeviceSettings, task: Task) -> Simulated:
    """Return a source of an operator who sees the robot and steers it through the task.

    What the operator means to do is as for `synthetic`. Raises UserError where that does not fit.
    """
    rng = np.random.default_rng(settings.seed)
    meant, _ = joined([segment.points for segment in _meant(settings, task, rng)], _SPACING_M)
    rate_hz = settings.rate_hz or _SIMULATED_RATE_HZ
    path = Path(meant)
    return Simulated(
        ClosedLoopOperator(PRESETS[settings.operator], path, rng, period_s=1.0 / rate_hz),
        rate_hz=rate_hz,
        lead_in_s=settings.lead_in_s,
        reach_m=float(np.linalg.norm(meant - meant[0], axis=1).max()),
        reaction=Reaction(settings.reaction_s) if settings.re_engage else None,
        hand_guiding=hand_guiding_of(task),
    )


BUILT_IN: Mapping[str, SourceFactory] = {
    "recorded": recorded,
    "synthetic": synthetic,
    "simulated": simulated,
    "recording": recording,
    "page": page,
    **{kind.name: partial(source_of, kind) for kind in KINDS},
}
"""Sources that need no other distribution."""


def _meant(
    settings: InputDeviceSettings, task: Task, rng: np.random.Generator
) -> list[TaskSegment]:
    if settings.demonstration is not None:
        return _segments(settings, read_csv(settings.demonstration), task)
    if settings.model is not None:
        gestemes = {name: path.points for name, path in load_model(settings.model).paths.items()}
        missing = [g.name for g in task.gestemes if g.name not in gestemes]
        if missing:
            raise UserError(
                f"{settings.model}: has no gesteme {', '.join(missing)} of task {task.name!r}: "
                "give a model of this task"
            )
    else:
        gestemes = {g.name: _random_gesteme(settings, task, rng) for g in task.gestemes}
    segments = random_performance(task, gestemes, rng, settings.segments)
    start = np.array(task.robot.tool_start_m)
    first = segments[0]
    return [first._replace(points=first.points - first.points[0] + start), *segments[1:]]


def _segments(
    settings: InputDeviceSettings, demonstration: Demonstration, task: Task
) -> list[TaskSegment]:
    names = {state.name for state in task.states}
    segments = []
    for state, samples in demonstration.stretches:
        points = demonstration.positions[samples]
        if state not in names:
            raise UserError(
                f"{settings.demonstration}: sample {samples.start + 1} is of state {state!r}, "
                f"expected every sample labeled with one of {', '.join(sorted(names))}"
            )
        if (points != points[0]).any():
            segments.append(TaskSegment(str(state), points))
    if not segments:
        raise UserError(f"{settings.demonstration}: does not move, expected a motion to follow")
    return segments


def _random_gesteme(settings: InputDeviceSettings, task: Task, rng: np.random.Generator) -> Array:
    axes = [AXES[axis] for axis in task.recognition.axes]
    references = References(kind=settings.primitives, dimensions=max(2, len(axes)))
    points = random_gesteme(references.scaled(settings.primitive_scale), rng)
    if len(axes) < 2:
        return points
    placed = np.zeros_like(points)
    placed[:, axes] = points[:, : len(axes)]
    return placed


def _played(settings: InputDeviceSettings, demonstration: Demonstration) -> Played:
    passes = Passes(
        settings.speed,
        settings.repeat,
        settings.lead_in_s,
        settings.velocity_window_s,
        settings.mark_switches,
    )
    playback = Playback(demonstration, passes)
    return ReEngaging(playback, Reaction(settings.reaction_s)) if settings.re_engage else playback
