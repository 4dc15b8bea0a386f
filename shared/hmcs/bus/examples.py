"""One example of every message: what the golden bytes encode, and a look at each for a reader."""

from __future__ import annotations

import numpy as np

from hmcs.bus.messages import (
    ActivateRecognizer,
    Ask,
    Belief,
    Command,
    Description,
    Done,
    Envelope,
    Evidence,
    FixtureState,
    Health,
    LastSteps,
    LastStepsQuestion,
    LoadModel,
    Message,
    Motion,
    Origin,
    Refusal,
    RobotState,
    SettingsReport,
    Source,
    Step,
)

ORIGIN = Origin(boot="5f0c1d2e3a4b", seq=1041, captured_ns=86_400_000_000_123)
"""The operator sample that caused the examples."""
ENVELOPE = Envelope(
    source=Source(service="example", instance="a1", boot="00ff12ab34cd"), seq=17, origin=ORIGIN
)
"""The envelope of the examples."""

_STEP = Step(
    index=41,
    position=np.array([0.1, -0.25, 0.5]),
    displacement=np.array([0.004, 0.0, -0.003]),
    orientation=np.array([0.0, 0.6, 0.0, 0.8]),
    wrench=np.array([1.0, 0.0, -2.0, 0.0, 0.25, 0.0]),
    mark=True,
)

EXAMPLES: tuple[Message, ...] = (
    Motion(
        position=np.array([0.1, -0.25, 0.5]),
        velocity=np.array([0.2, 0.0, -0.15]),
        orientation=np.array([0.0, 0.0, 0.0, 1.0]),
        angular_velocity=np.array([0.0, 0.5, 0.0]),
        wrench=np.array([1.0, 0.0, -2.0, 0.0, 0.25, 0.0]),
        dead_man=True,
        clutch=False,
        pedal=True,
    ),
    _STEP,
    Evidence(
        model_hash="9b3f00c2",
        clock="5f0c1d2e3a4b",
        step=41,
        gestemes=("line", "arc"),
        pair_gesteme=np.array([0, 0, 1], dtype="<i4"),
        pair_start=np.array([12, 41, 41], dtype="<i4"),
        exit=np.array([0.125, 0.0, 0.0], dtype="<f4"),
        log_ratio=np.array([1.5, 0.25, -3.0], dtype="<f4"),
    ),
    Belief(
        model_hash="9b3f00c2",
        clock="5f0c1d2e3a4b",
        step=41,
        states=("approach", "follow"),
        probabilities=np.array([0.125, 0.75]),
        unknown=0.125,
        likely_gesteme="line",
        segment_start=12,
        log_likelihood=-0.5,
        mean_log_likelihood=0.25,
        unknown_alarm=False,
        missing_gestemes=("arc",),
    ),
    Command(
        twist=np.array([0.1, 0.0, -0.075, 0.0, 0.0, 0.25]), valid_for_ns=100_000_000, engaged=True
    ),
    FixtureState(
        law="general",
        model="demo",
        state="follow",
        factor=0.5,
        compliance=0.5,
        preferred_direction=np.array([0.8, 0.0, -0.6]),
        progress=0.75,
        gesteme="line",
        guide_origin=np.array([0.5, 0.1, 0.4]),
        off_guide_m=0.004,
        operator_twist=np.array([0.2, 0.0, -0.15, 0.0, 0.0, 0.0]),
        command_twist=np.array([0.2, 0.0, -0.15, 0.0, 0.0, 0.0]),
        wrench=np.zeros(6),
        engaged=True,
        reason="guiding",
    ),
    RobotState(
        robot="puma560",
        joint_positions=np.array([0.0, 0.5, -1.0, 0.0, 0.25, 0.0]),
        joint_velocities=np.array([0.0, 0.125, 0.0, 0.0, 0.0, 0.0]),
        tool_position=np.array([0.45, -0.15, 0.43]),
        tool_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
        tool_twist=np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.0]),
        reference_twist=np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.0]),
        nearest_obstacle="post",
        nearest_distance_m=0.0625,
        contacts=("post",),
        stop="none",
        limited=("speed", "joint_3"),
    ),
    Ask(),
    Refusal(reason="no model named 'demo-2': load one of demo, lines"),
    Health(
        healthy=True,
        detail="running",
        uptime_s=12.5,
        loop_rate_hz=340.0,
        cpu_s=0.75,
        received={"step": 42},
        sent={"evidence": 42},
        lost={"step": 1},
        refused={},
        late={},
    ),
    Description(
        version="0.1.0",
        publishes=("hmcs/@v1/demo/model/demo/evidence/a1",),
        subscribes=("hmcs/@v1/demo/input/step",),
        answers=("hmcs/@v1/demo/rpc/example/a1/health",),
        facts={"model": "demo", "gestemes": "line arc"},
    ),
    SettingsReport(settings={"router": "tcp/127.0.0.1:7447", "redundancy": 2, "gestemes": ()}),
    LastStepsQuestion(count=300, before=41),
    LastSteps(clock="5f0c1d2e3a4b", steps=(_STEP,), origins=(ORIGIN,)),
    LoadModel(path="/models/demo.hmcs"),
    ActivateRecognizer(model="demo"),
    Done(detail="following demo"),
)
"""One of each, every optional field filled."""
