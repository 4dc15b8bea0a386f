"""The closed loop in process: an operator, a recognizer, the fixture controller and a robot.

They are the very objects that the services run, driven by a clock of their own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.fixtures.compliance.trust import SegmentBelief
from hmcs.fixtures.controller.controller import Controller
from hmcs.fixtures.controller.interface import Fixture, Guides, OperatorSample
from hmcs.fixtures.controller.rules import Rules, Safeguards
from hmcs.fixtures.regions.workspace import regions_of
from hmcs.motion.closed_loop_operators import ClosedLoopOperator
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.hand_guiding import hand_guiding_of
from hmcs.motion.steps import DeadZone, Step
from hmcs.recognition.model import Model
from hmcs.recognition.recognizer import Recognition
from hmcs.recognition.registry import recognizer_of
from hmcs_laboratory.assistance.robots import SimulatedRobot, robot_of
from hmcs_laboratory.assistance.scenarios import Scenario, Taught


class Run(NamedTuple):
    """One performance; T samples."""

    period_s: float
    arrived: bool
    """Whether it came to the end of the path before time was up."""
    robot: Array
    """Where the tool was, m, shape (T, 3)."""
    hand_velocity: Array
    """m/s, shape (T, 3)."""
    intended: Array
    """The hand's velocity without what was not meant, m/s, shape (T, 3)."""
    command: Array
    """The robot's reference velocity, m/s, shape (T, 3)."""
    passed: Array
    """What the fixture would have made of `intended`, m/s, shape (T, 3)."""
    force: Array
    """Of the fixture on the hand, N, shape (T, 3)."""
    progress_m: Array
    """How far along the meant path the operator saw the robot, shape (T,)."""
    factor: Array
    """k, shape (T,)."""
    states: tuple[str, ...]
    """Task state believed at each sample; empty before the first belief."""
    confidence: Array
    """Its probability, shape (T,)."""
    steps: tuple[Step, ...]
    """Of the hand, as the recognizer saw them; M of them."""
    step_at: NDArray[np.int64]
    """The sample that completed each, shape (M,)."""
    touched: frozenset[str]
    """Names of the obstacles the robot touched."""


def perform(
    operator: ClosedLoopOperator,
    robot: SimulatedRobot,
    model: Model,
    rules: Rules,
    *,
    period_s: float,
    most_s: float,
) -> Run:
    """Return how an operator performs a task with a robot under these rules.

    Where the task is cooperative the hand is on the robot's tool and pushes it.
    """
    hand_guiding = hand_guiding_of(model.task)
    controller = Controller(Safeguards())
    guides = Guides(model.paths, rules, regions_of(model.task), model.spreads, model.turns)
    controller.load(model.name, guides)
    controller.activate(model.name)
    recognizer = recognizer_of(model)
    zone = DeadZone(model.task.dead_zone_m)
    hand = np.zeros(3)
    rows: list[tuple[Array, ...]] = []
    states: list[str] = []
    steps: list[Step] = []
    step_at: list[int] = []
    state, confidence, arrived = "", 0.0, False
    controller.on_sample(0.0, OperatorSample(0, hand, np.zeros(6), dead_man=False, clutch=False))
    for tick in range(1, int(most_s / period_s) + 1):
        now_s, tool = tick * period_s, robot.position
        controller.robot_moved(now_s, tool, robot.orientation)
        motion = operator.step(tool)
        if motion.arrived:
            arrived = True
            break
        if hand_guiding is None:
            hand = hand + motion.velocity * period_s
            twist = np.concatenate([motion.velocity, np.zeros(3)])
        else:
            hand, twist = (
                tool,
                hand_guiding.push(motion.velocity, robot.orientation, period_s).twist,
            )
        fixture = controller.on_sample(
            now_s, OperatorSample(tick, hand, twist, dead_man=True, clutch=False)
        )
        step = zone.push(hand)
        if step is not None:
            controller.on_step(now_s, step.index, step.position, step.displacement, tick)
            recognition = recognizer.step(step)
            belief = belief_of(model, recognition)
            controller.on_belief(model.name, belief)
            state, confidence = belief.state, belief.probability
            steps.append(step)
            step_at.append(len(rows))
        rows.append(
            (
                tool,
                twist[:3],
                motion.intended,
                fixture.command_twist[:3],
                passed_by(fixture, motion.intended),
                fixture.wrench[:3],
                np.array([motion.progress_m, fixture.factor, confidence]),
            )
        )
        states.append(state)
        robot.move(fixture.command_twist, period_s)
    robot_at, hand_velocity, intended, command, passed, force, fixture_values = (
        np.array(column, dtype=np.float64) for column in zip(*rows, strict=True)
    )
    return Run(
        period_s=period_s,
        arrived=arrived,
        robot=robot_at,
        hand_velocity=hand_velocity,
        intended=intended,
        command=command,
        passed=passed,
        force=force,
        progress_m=fixture_values[:, 0],
        factor=fixture_values[:, 1],
        states=tuple(states),
        confidence=fixture_values[:, 2],
        steps=tuple(steps),
        step_at=np.array(step_at, dtype=np.int64),
        touched=robot.touched,
    )


def assisted(
    operator: ClosedLoopOperator,
    taught: Taught,
    scenario: Scenario,
    model: Model,
    rules: Rules,
    *,
    robot: str,
    robot_lag_s: float,
    period_s: float,
    most_s: float,
) -> Run:
    """Return how an operator performs what is meant in a scenario, with a robot of its own.

    `robot` and `robot_lag_s` are as for `robot_of`, which says what is raised.
    """
    space = scenario.workspace or taught.task.workspace
    made = robot_of(taught.task.model_copy(update={"workspace": space}), robot, robot_lag_s)
    try:
        return perform(operator, made, model, rules, period_s=period_s, most_s=most_s)
    finally:
        made.close()


def demonstrated(
    operator: ClosedLoopOperator, taught: Taught, name: str, *, period_s: float, most_s: float
) -> Demonstration:
    """Return an unaided performance of what is taught, each sample labeled with its state."""
    here = taught.path.points[0]
    positions, states = [here], [taught.states[0]]
    progress_m = 0.0
    for _ in range(int(most_s / period_s)):
        motion = operator.step(here)
        if motion.arrived:
            break
        here = here + motion.velocity * period_s
        progress_m = max(progress_m, motion.progress_m)
        positions.append(here)
        states.append(taught.state_at(progress_m))
    time_s = period_s * np.arange(len(positions), dtype=np.float64)
    return Demonstration(name, time_s, np.array(positions), tuple(states))


def belief_of(model: Model, recognition: Recognition) -> SegmentBelief:
    """Return what a fixture wants to know of a recognition."""
    belief = recognition.belief
    likely = int(np.argmax(belief.states))
    return SegmentBelief(
        step=belief.step,
        state=model.state_names[likely],
        probability=float(belief.states[likely]),
        gesteme=model.gesteme_names[belief.gesteme],
        segment_start=belief.segment_start,
        unknown=belief.unknown,
        unknown_alarm=recognition.unknown_alarm,
        complete=not belief.missing,
    )


def passed_by(fixture: Fixture, velocity: Array) -> Array:
    """Return what the fixture's law makes of another velocity, m/s, shape (3,)."""
    twist = np.concatenate([velocity, np.zeros(3)])
    return np.asarray(fixture.objective.wanted(twist)[:3])
