"""A cell that never ran: operator, fixture and robot in one thread, and a recording of them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hmcs.bus.keys import Keys
from hmcs.bus.messages import Envelope, Message, Motion, Origin, RobotState, Source, Step
from hmcs.bus.wire import encode, schema_of
from hmcs.fixtures.controller.controller import Controller
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import DeadZone
from hmcs.recognition.model import Model
from hmcs.recognition.registry import recognizer_of
from hmcs.recordings.file_rotation import Preface, Recording
from hmcs.recordings.json_codec import fields_of
from hmcs.translation import belief_message, guides_of, sample_of, segment_belief_of, step_of
from hmcs_fixture_controller.settings import FixtureControllerSettings
from hmcs_fixture_controller.translation import command_of, state_of
from support.recordings import BEGUN_NS, ROOMY

KEYS = Keys("test")
PERIOD_NS = 10_000_000
BELIEF_AFTER_NS = 4_000_000
RESTING = 30
"""Samples with the dead-man released before the hand moves."""
SETTINGS = FixtureControllerSettings(belief_stale_after_ms=90.0, unknown_limit=0.6)


class Logged(NamedTuple):
    """One message of such a cell."""

    log_ns: int
    key: str
    body: Message
    envelope: Envelope

    def is_of(self, *message_types: type[Message]) -> bool:
        """Whether it is of one of these types."""
        return isinstance(self.body, message_types)


def performance(
    model: Model, demonstration: Demonstration, boot: str = "clock", begin_ns: int = BEGUN_NS
) -> Iterator[Logged]:
    """Yield what is said while an operator performs, guided by a model's recognizer.

    The robot carries out commands at once; beliefs come while the next sample is not there yet.
    """
    controller = Controller(SETTINGS.safeguards)
    controller.load(model.name, guides_of(model))
    recognizer, zone = recognizer_of(model), DeadZone(model.task.dead_zone_m)
    hand = Source(service="input_device", instance="hand", boot=boot)
    others = {
        name: Source(service=name, instance=name, boot=f"{name}-{boot}")
        for name in ("robot", "fixture_controller", "task_hmm")
    }
    counts: dict[str, int] = {}

    def logged(at_ns: int, key: str, body: Message, source: Source, origin: Origin) -> Logged:
        seq = counts.get(key, 0)
        counts[key] = seq + 1
        return Logged(at_ns, key, body, Envelope(source=source, seq=seq, origin=origin))

    tool = np.array(model.task.robot.tool_start_m)
    path = np.concatenate(
        [np.repeat(demonstration.positions[:1], RESTING, axis=0), demonstration.positions]
    )
    for count, position in enumerate(path):
        at_ns = begin_ns + count * PERIOD_NS
        origin = Origin(boot=boot, seq=count, captured_ns=at_ns)
        velocity = (position - path[max(count - 1, 0)]) / (PERIOD_NS / 1e9)
        motion = Motion(position=position, velocity=velocity, dead_man=count >= RESTING)
        yield logged(at_ns, KEYS.motion, motion, hand, origin)
        now_s = (at_ns - BEGUN_NS) / 1e9
        fixture = controller.on_sample(now_s, sample_of(motion, count, origin))
        source = others["fixture_controller"]
        yield logged(at_ns, KEYS.command, command_of(fixture, 80.0), source, origin)
        yield logged(at_ns, KEYS.fixture_state, state_of(fixture), source, origin)
        made = zone.push(position) if motion.dead_man else None
        if made is not None:
            step = Step(**made._asdict())
            yield logged(at_ns, KEYS.step, step, hand, origin)
            controller.on_step(now_s, step.index, step.position, step.displacement, count)
            belief = belief_message(model, recognizer.step(step_of(step)), boot)
            controller.on_belief(model.name, segment_belief_of(belief))
            if not controller.active:
                controller.activate(model.name)
            at_ns += BELIEF_AFTER_NS
            yield logged(
                at_ns, KEYS.belief(model.name, "task_hmm"), belief, others["task_hmm"], origin
            )
        tool = tool + fixture.command_twist[:3] * (PERIOD_NS / 1e9)
        at_ns = begin_ns + count * PERIOD_NS + 2 * BELIEF_AFTER_NS
        state = _robot_state(tool, fixture.command_twist)
        controller.robot_moved(
            (at_ns - BEGUN_NS) / 1e9, state.tool_position, state.tool_orientation
        )
        yield logged(at_ns, KEYS.robot_state, state, others["robot"], origin)


def write_cell(
    folder: Path,
    said: Iterator[Logged] | list[Logged],
    *,
    name: str = "take",
    attachments: Mapping[str, bytes] | None = None,
    settings_kept: bool = True,
) -> Path:
    """Write it as the recorder does; return the file."""
    metadata = {"hmcs": {"version": "1.2.3"}}
    if settings_kept:
        settings = json.dumps(SETTINGS.model_dump(mode="json"))
        metadata["fixture_controller/f"] = {"settings": settings, "active_model": ""}
    preface = Preface(metadata, dict(attachments or {}))
    recording = Recording(folder, name, ROOMY, lambda: preface, BEGUN_NS, "test")
    for each in said:
        fields = fields_of(encode(each.body, each.envelope))
        assert fields["schema"] == schema_of(type(each.body))
        recording.write(each.key, fields, each.log_ns, None)
    recording.finish()
    return recording.path


def _robot_state(position: np.ndarray, twist: np.ndarray) -> RobotState:
    return RobotState(
        robot="made-up",
        joint_positions=np.zeros(6),
        joint_velocities=np.zeros(6),
        tool_position=position,
        tool_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
        tool_twist=twist,
        reference_twist=twist,
        nearest_obstacle="",
        nearest_distance_m=None,
        contacts=(),
        stop="none",
        limited=(),
    )
