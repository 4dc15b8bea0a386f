"""`summary.json`: the figures of a demo run. Its fields are stable; new ones may be added."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from hmcs_demo.measure import Measured, longest_delay_ms, missing_between

AROUND_SWAP_S = 1.0
"""How near to the swap counts as around it."""


class _Part(BaseModel):
    model_config = ConfigDict(
        frozen=True, extra="forbid", use_attribute_docstrings=True, allow_inf_nan=False
    )


class SwitchDelay(_Part):
    """From the step at which the operator's state truly changes to the one that believes it."""

    median: float
    """Steps; negative: believed early."""
    p95: float
    """Steps."""


class RmsMax(_Part):
    """A root mean square and the largest value, mm."""

    rms: float
    max: float


class PathError(_Part):
    """Distance to the mean demonstration.

    For each true segment it is the learned path of the gesteme, laid at the position at which the
    hand (the tool) truly begins the segment. Positions are matched with points of it, never with
    one behind that of the position before, so that the sum of squared distances is the least.
    """

    operator: RmsMax
    """Of the hand."""
    robot: RmsMax
    """Of the robot's tool."""


class Percentiles(_Part):
    """Median and 99th percentile, ms."""

    p50: float
    p99: float


class Latency(_Part):
    """Times between events on the bus, as one observer on it receives them."""

    input_to_command: Percentiles
    """From the capture of an operator sample to the arrival of the fixture's Command for it."""
    input_to_robot: Percentiles
    """From the capture of an operator sample to the arrival of the first RobotState that follows
    its command: two hops, the wait for the robot's control cycle and state, and a hop back."""
    step_to_belief: Percentiles
    """From the arrival of a Step to the arrival of its Belief."""


class Swap(_Part):
    """What the killing of a classifier cost."""

    missing_steps: int
    """Steps without a belief from 1 s before the kill to 1 s after the newcomer was ready."""
    longest_belief_gap_ms: float
    """The longest time between a Step and its Belief (or, where it is missing, the next Belief)
    among the steps within 1 s of the kill."""
    at_s: float
    """When the classifier was killed, s after the hand began to move."""
    ready_after_s: float
    """From the kill until the newcomer had replayed the last steps and was ready."""
    killed: str
    """Instance that was killed."""
    newcomer: str
    """Instance that took its place."""


class Summary(_Part):
    """The figures of a demo run."""

    steps: int
    """Steps the operator's hand made."""
    missing_steps: int
    """Steps without a belief."""
    degraded_steps: int
    """Steps whose belief had to do without the evidence of some gesteme."""
    lost_messages: int
    """Gaps in sequence numbers, as counted by every service and the observer."""
    refused_messages: int
    """Messages any service or the observer refused."""
    state_accuracy: float
    """Share of steps whose most probable state is the true one."""
    switch_delay_steps: SwitchDelay
    false_switches_per_1000_steps: float
    """Changes of the most probable state that follow no true switch."""
    path_error_mm: PathError
    velocity_tracking_mm_s_rms: float
    """Tool velocity against the reference the robot follows at the same moment, while it moves."""
    latency_ms: Latency
    swap: Swap
    cpu_cores: float
    """Processor time of the router and all services while the hand moves, the newcomer's start
    included, by that time; the observer apart."""
    collisions: int
    """How often the robot began to touch something."""
    stops: int
    """How often the robot, or the fixture, stopped by itself while the operator drove it. It then
    stands until the operator has let go of the dead-man and pressed it again. More than 0 says that
    this machine was too busy to give it commands in time."""
    held_out: tuple[int, ...]
    """Numbers of the demonstrations that were played, and not learned from."""
    seed: int
    """Chose which classifier was killed, and when."""
    motion_s: float
    """How long the hand moved, the operator's waiting after stops included."""
    versions: dict[str, str]
    """Of the software, and the hash of the model."""


class RunFacts(NamedTuple):
    """What is known of a run besides what was seen on the bus."""

    killed: str
    newcomer: str
    killed_ns: int
    ready_ns: int
    cpu_cores: float
    lost_messages: int
    refused_messages: int
    held_out: tuple[int, ...]
    seed: int
    versions: dict[str, str]


def summarize(measured: Measured, facts: RunFacts) -> Summary:
    """Return the figures of a run."""
    scores, hops = measured.scores, measured.hops
    killed_s, ready_s = measured.clock.seconds(np.array([facts.killed_ns, facts.ready_ns]))
    return Summary(
        steps=scores.steps,
        missing_steps=scores.missing_steps,
        degraded_steps=measured.degraded_steps,
        lost_messages=facts.lost_messages,
        refused_messages=facts.refused_messages,
        state_accuracy=scores.accuracy,
        switch_delay_steps=SwitchDelay(median=scores.switch_delay(50), p95=scores.switch_delay(95)),
        false_switches_per_1000_steps=scores.false_switches_per_1000_steps,
        path_error_mm=PathError(
            operator=_rms_max_mm(measured.hand.error_m), robot=_rms_max_mm(measured.tool.error_m)
        ),
        velocity_tracking_mm_s_rms=_rms(measured.tracking_error_m_s) * 1e3,
        latency_ms=Latency(
            input_to_command=_percentiles(hops.input_to_command),
            input_to_robot=_percentiles(hops.input_to_robot),
            step_to_belief=_percentiles(hops.step_to_belief),
        ),
        swap=Swap(
            missing_steps=missing_between(
                measured, killed_s - AROUND_SWAP_S, ready_s + AROUND_SWAP_S
            ),
            longest_belief_gap_ms=longest_delay_ms(measured, killed_s, AROUND_SWAP_S),
            at_s=killed_s,
            ready_after_s=ready_s - killed_s,
            killed=facts.killed,
            newcomer=facts.newcomer,
        ),
        cpu_cores=facts.cpu_cores,
        collisions=measured.collisions,
        stops=measured.stops,
        held_out=facts.held_out,
        seed=facts.seed,
        motion_s=measured.motion_s,
        versions=facts.versions,
    )


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _rms_max_mm(error_m: NDArray[np.float64]) -> RmsMax:
    known_mm = 1e3 * error_m[np.isfinite(error_m)]
    return RmsMax(rms=_rms(known_mm), max=float(known_mm.max()))


def _percentiles(values_ms: NDArray[np.float64]) -> Percentiles:
    p50, p99 = np.percentile(values_ms, [50, 99])
    return Percentiles(p50=float(p50), p99=float(p99))


def described() -> dict[str, str]:
    """Return what each field of the summary means, by its dotted path in the order of the file."""
    return dict(_described(Summary, ""))


def _described(model: type[BaseModel], prefix: str) -> list[tuple[str, str]]:
    found = []
    for name, field in model.model_fields.items():
        inner = field.annotation
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            what = field.description or inner.__doc__ or ""
            found.append((prefix + name, " ".join(what.split())))
            found += _described(inner, f"{prefix}{name}.")
        elif field.description:
            found.append((prefix + name, " ".join(field.description.split())))
    return found
