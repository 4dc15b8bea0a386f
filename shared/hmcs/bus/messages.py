"""What travels: every message of the protocol, on one page.

A message is a frozen pydantic model of its body alone. On the wire it is one msgpack map: the
fields of the body beside those of its `Envelope` (`schema`, `source`, `seq`, `origin`). Unknown
fields are ignored on reading (a newer peer sent them); missing, mistyped, misshapen or non-finite
ones are refused.

Conventions (REP 103, REP 105): SI units; right-handed frames, x forward, z up; quaternions
x y z w; twists and wrenches linear part first; poses in the robot's base frame unless a field says
otherwise; times in nanoseconds. The *operator frame* is the one hand positions are measured in:
its axes are parallel to the robot's base axes, its zero is the device's own.

`t` is the index of a step. Step t is the motion from x_t to x_{t+1}; a segment that starts at s has
step s as its first and x_s as its origin.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, GetCoreSchemaHandler
from pydantic_core import core_schema

from hmcs.bus.arrays import (
    LARGEST,
    EvidenceFloats,
    Floats,
    Indices,
    Points,
    Quaternion,
    Vector3,
    Vector6,
)
from hmcs.bus.keys import check_name


@dataclass(frozen=True)
class Within:
    """Refuses numbers whose magnitude is beyond `largest`; its JSON Schema does not say so."""

    largest: int | float

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        return core_schema.no_info_after_validator_function(self._checked, handler(source))

    def _checked(self, value: Any) -> Any:
        if not -self.largest <= value <= self.largest:
            raise ValueError(f"{value!r} is beyond {self.largest:g}")
        return value


Name = Annotated[str, Field(min_length=1, max_length=64)]
Chunk = Annotated[Name, AfterValidator(partial(check_name, "name"))]
"""What can be one chunk of a key, such as the name of a process."""
Count = Annotated[int, Field(ge=0), Within(2**53)]
"""Nothing counts further: a thousand a second for 285 000 years. Sums of counts still fit into a
message."""
Nanoseconds = Annotated[int, Within(2**63 - 1)]
Real = Annotated[float, Within(LARGEST)]


class Part(BaseModel):
    """A part of a message: frozen, strict about types, tolerant of fields it does not know."""

    model_config = ConfigDict(
        frozen=True,
        strict=True,
        extra="ignore",
        allow_inf_nan=False,
        arbitrary_types_allowed=True,
        use_attribute_docstrings=True,
    )


class Message(Part):
    """The body of a message: `SCHEMA` names it on the wire, `VERSION` counts breaking changes."""

    SCHEMA: ClassVar[str]
    VERSION: ClassVar[int] = 1


class Source(Part):
    """Who sent a message."""

    service: Chunk
    """Kind of process, e.g. `gesteme_classifier`."""
    instance: Chunk
    """Which one of its kind."""
    boot: Chunk
    """A new value at every start of the process: sequence numbers count within one boot."""


class Origin(Part):
    """The operator sample that caused a message, handed on from hop to hop."""

    boot: Chunk
    """Boot of the input device that captured the sample."""
    seq: Count
    """Sequence number of its Motion."""
    captured_ns: Nanoseconds
    """Capture time by that device's own monotonic clock, ns; comparable only where it was taken."""


class Envelope(Part):
    """What every message carries besides its body."""

    source: Source
    seq: Count
    """Counts what this source published on this key, from 0."""
    origin: Origin | None = None
    """None where no operator sample caused the message."""


# --- the fast loop: operator, fixture, robot ------------------------------------------------------


class Motion(Message):
    """One sample of the operator's device."""

    SCHEMA = "motion"

    position: Vector3
    """Of the hand, m, operator frame, shape (3,)."""
    velocity: Vector3
    """Of the hand, m/s, shape (3,)."""
    orientation: Quaternion | None = None
    """Of the hand, x y z w, shape (4,); None where the device has none."""
    angular_velocity: Vector3 | None = None
    """rad/s, shape (3,); None where the device has none."""
    wrench: Vector6 | None = None
    """The operator's force, N, then torque, N·m, shape (6,); None where the device has none."""
    dead_man: bool
    """True while the operator holds the enabling switch: without it the robot does not move."""
    clutch: bool = False
    """True while the hand is being repositioned: the robot stays where it is."""
    pedal: bool = False
    """A second switch, for marking and for explicit cues."""


class Command(Message):
    """What the robot is to do now."""

    SCHEMA = "command"

    twist: Vector6
    """Reference velocity of the tool, m/s and rad/s, shape (6,)."""
    valid_for_ns: Annotated[int, Field(gt=0, le=1_000_000_000)]
    """How long after its arrival the robot may act on it."""
    engaged: bool
    """False commands a stop. After a stop of its own the robot moves again only once it has seen
    False and then True: a deliberate re-engage."""


class Handle(Message):
    """What an operator's page does with its handle; an input device makes Motion of it."""

    SCHEMA = "handle"

    operator: Name
    """Who holds it: one page of one console. Another's is refused until this one has lapsed."""
    position: Vector3
    """Of the handle, m, operator frame, shape (3,)."""
    dead_man: bool
    """True while it is held."""
    clutch: bool = False
    """True while the handle is being repositioned."""
    pedal: bool = False
    """The page's pedal key."""


class FixtureState(Message):
    """What the fixture is doing, and why."""

    SCHEMA = "fixture_state"
    VERSION = 2

    law: Name
    """The law that made the command."""
    model: str
    """The active recognizer's model; empty while there is none."""
    state: str
    """The task state whose fixture is applied; empty in free motion."""
    factor: Annotated[float, Field(ge=0, le=1)]
    """Fixturing factor k: how strongly motion across the preferred direction is reduced."""
    compliance: Annotated[float, Field(ge=0, le=1)]
    """c_τ: 1 is free motion, 0 a hard fixture."""
    preferred_direction: Vector3
    """Unit vector, or zero in free motion, shape (3,)."""
    progress: Annotated[float, Field(ge=0, le=1)]
    """How far along the state's learned path, by path length."""
    gesteme: str = ""
    """Whose learned path it is; empty in free motion."""
    guide_origin: Vector3 | None = None
    """Where that path begins for the robot, m, base frame, shape (3,); None in free motion, and
    where nobody knows."""
    off_guide_m: Annotated[float, Field(ge=0), Within(LARGEST)] | None = None
    """How far the robot is beside the path; None as for `guide_origin`."""
    operator_twist: Vector6
    """The operator's velocity as the law saw it, shape (6,)."""
    command_twist: Vector6
    """The reference velocity it made of it, shape (6,)."""
    wrench: Vector6
    """The fixture's force on the operator, for a haptic device, N and N·m, shape (6,)."""
    engaged: bool
    """Whether the operator is driving."""
    asks_for_help: bool = False
    """True while a plan with shared axes is stuck and waits for the operator."""
    reason: Literal[
        "guiding",
        "unsure",
        "no_belief",
        "belief_stale",
        "belief_degraded",
        "unknown_motion",
        "disengaged",
        "input_stale",
    ]
    """Why the fixture is as stiff as it is."""


class Pairing(Message):
    """Which input device drives which robot, as the fixture controller has decided it.

    Published when it changes, and a few times a second. Recognizers follow the steps of that device
    alone; a robot that is not named takes no commands of this fixture controller.
    """

    SCHEMA = "pairing"

    device: str
    """Boot of the input device that drives; empty while none does."""
    device_instance: str
    """Its instance; empty while none does."""
    robot: str
    """Boot of the robot that follows, and whose pose the fixture takes; empty while none does."""
    robot_instance: str
    """Its instance; empty while none does."""


class StopRequest(Message):
    """Somebody wants every robot of the cell to stand.

    It holds like the answer to the question `stop`: until the operator lets go and takes hold
    again. It needs no answer, so that a robot hears it whatever hangs beside it.
    """

    SCHEMA = "stop_request"

    reason: str
    """Who wants it and why, in one line."""


class RobotState(Message):
    """Where the robot is and what it touches."""

    SCHEMA = "robot_state"
    VERSION = 3

    robot: Name
    """Which robot, e.g. `puma560`."""
    joint_names: tuple[str, ...] = ()
    """As in the robot's URDF, in the order of `joint_positions`; empty where they have none."""
    joint_positions: Floats
    """rad, shape (n,)."""
    joint_velocities: Floats
    """rad/s, shape (n,)."""
    tool_position: Vector3
    """m, base frame, shape (3,)."""
    tool_orientation: Quaternion
    """x y z w, base frame, shape (4,)."""
    tool_twist: Vector6
    """m/s and rad/s, base frame, shape (6,)."""
    reference_twist: Vector6
    """The velocity it is following now, after its own limits, shape (6,)."""
    nearest_obstacle: str
    """Name of the nearest obstacle; empty where none is within reach of the search."""
    nearest_distance_m: Annotated[float, Field(ge=-1), Within(LARGEST)] | None
    """Distance to it; None where none is within reach of the search; negative in penetration."""
    contacts: tuple[str, ...]
    """Names of what the robot touches."""
    stop: Literal[
        "none",
        "disengaged",
        "no_command",
        "stale_command",
        "refused_command",
        "second_writer",
        "not_paired",
        "late_tick",
        "collision",
        "asked",
    ]
    """Why the robot stands; `none` while it follows commands, `asked` after somebody asked it to
    `stop`, `not_paired` while the fixture controller drives another robot, `late_tick` after its
    own control loop came too late."""
    limited: tuple[str, ...]
    """Limits that shape the motion now, e.g. `speed`, `workspace`, `region`, `joint_3`,
    `singularity`."""
    region_distance_m: Annotated[float, Field(ge=-1), Within(LARGEST)] | None = None
    """From the tool to the nearest forbidden region of its task; negative inside; None where there
    is none within reach of the search."""
    late_ticks: Count = 0
    """Control ticks that came later than a period after they were due, since the robot started."""
    command_age_s: Annotated[float, Field(ge=0), Within(LARGEST)] | None = None
    """Since the last command was taken, by the robot's own clock; None before the first."""


# --- the slow loop: steps, evidence, belief -------------------------------------------------------


class Step(Message):
    """The hand has moved by the dead zone δ: the classifiers' common clock."""

    SCHEMA = "step"

    index: Count
    """t, without gaps within one boot of the input device."""
    position: Vector3
    """x_t, where the step begins, m, shape (3,). The path of the *engaged* hand: motion made with
    the dead-man released or the clutch pressed is taken out, so the path has no jumps."""
    displacement: Vector3
    """x_{t+1} − x_t, m, shape (3,); at least δ long."""
    orientation: Quaternion | None = None
    """Of the hand where the step ends, x y z w, shape (4,), with the sign nearer to that of the
    step before; None where the device has none."""
    wrench: Vector6 | None = None
    """The operator's force, N, then torque, N·m, shape (6,): the mean over the samples of the step,
    the one that ends it included; None where the device has none."""
    mark: bool = False
    """True where the pedal went down in this step, its first sample included and its last one not:
    the operator says that a new part of the task begins with it."""


class Evidence(Message):
    """What one classifier makes of one step: a sparse list of living (gesteme, start) pairs."""

    SCHEMA = "evidence"

    model_hash: Name
    """Of the model file; a task refuses another model's evidence."""
    clock: Name
    """Boot of the input device whose steps are meant."""
    step: Count
    """t."""
    gestemes: tuple[Name, ...]
    """The gestemes this classifier holds, with or without a living pair."""
    pair_gesteme: Indices
    """Index into `gestemes` of each pair, shape (p,)."""
    pair_start: Indices
    """Start step s of each pair, shape (p,)."""
    exit: EvidenceFloats
    """Probability of leaving before step t, given steps s..t−1; 0 for s = t; shape (p,)."""
    log_ratio: EvidenceFloats
    """Tempered log-likelihood ratio of step t against the model's background level, given no exit,
    nats, shape (p,)."""


class Belief(Message):
    """What the task recognizer holds to be true after one step."""

    SCHEMA = "belief"

    model_hash: Name
    """Of the model file."""
    clock: Name
    """Boot of the input device whose steps are meant."""
    step: Count
    """t."""
    states: tuple[Name, ...]
    """Task states in the order of the model."""
    probabilities: Floats
    """P(state | steps 0..t), one for each state, shape (len(states),)."""
    unknown: Annotated[float, Field(ge=0, le=1)] = 0.0
    """P(motion is no part of the task | steps 0..t); with `probabilities` sums to one."""
    likely_gesteme: str
    """The most probable gesteme in the most probable state; empty while nothing is likely."""
    segment_start: Count
    """The most probable start step s of the most probable state's segment."""
    log_likelihood: Real = 0.0
    """Of step t given all before it, against the background level, nats."""
    mean_log_likelihood: Real = 0.0
    """How well the last steps fit the task: mean over the model's alarm window, nats."""
    unknown_alarm: bool = False
    """True where that mean is below the threshold learned from the demonstrations."""
    missing_gestemes: tuple[Name, ...] = ()
    """Gestemes of the task no evidence came for; the belief is degraded unless this is empty."""

    @property
    def likely_state(self) -> str:
        """The most probable task state."""
        return self.states[int(self.probabilities.argmax())]

    @property
    def confidence(self) -> float:
        """Probability of the most probable task state."""
        return float(self.probabilities.max())


# --- teaching: what the operator says of the motion, and what becomes of it -----------------------


class Label(Message):
    """The operator says in which state of the task the hand is from now on."""

    SCHEMA = "label"

    state: str
    """A task state, or `state/gesteme` where a state has several; empty ends what was labeled."""
    clock: str = ""
    """Boot of the input device whose steps are meant; empty where none was heard of."""
    step: Count = 0
    """The first step the label is true of."""


class TrainingProgress(Message):
    """How far a training is."""

    SCHEMA = "training_progress"

    model: Name
    """What the model is to be called."""
    stage: Literal["checking", "learning", "judging", "done", "failed", "canceled"]
    """What is being done; the last three end it."""
    detail: str
    """One line: what is done now, or what came of it, or what was wrong."""
    share: Annotated[float, Field(ge=0, le=1)]
    """Of the whole that is done."""
    path: str = ""
    """Of the model file, once it is written; as the trainer sees it."""
    report: str = ""
    """Of the report page beside it."""


# --- questions and answers ------------------------------------------------------------------------


class Ask(Message):
    """A question without arguments (`health`, `describe`, `settings`)."""

    SCHEMA = "ask"


class Refusal(Message):
    """The answer to a question that could not be answered."""

    SCHEMA = "refusal"

    reason: str
    """What was wrong, what was expected, what to do."""


class Health(Message):
    """How a process is."""

    SCHEMA = "health"

    healthy: bool
    """True when it does what it is for."""
    detail: str
    """One line: what it does, or what it waits for."""
    uptime_s: Real
    """Since the process started."""
    loop_rate_hz: Real
    """Messages and timers handled per second, over the last second."""
    cpu_s: Real
    """Processor time used since the process started."""
    received: dict[str, int]
    """Messages received, per schema."""
    sent: dict[str, int]
    """Messages sent, per schema."""
    lost: dict[str, int]
    """Messages missing in the sequence numbers of their sources, per schema."""
    refused: dict[str, int]
    """Messages refused (malformed, unknown schema or version, another model's), per schema."""
    late: dict[str, int]
    """Messages that came too late to be used, per schema."""


class Description(Message):
    """What a process is."""

    SCHEMA = "description"

    version: str
    """Of the software."""
    publishes: tuple[str, ...]
    """Key expressions."""
    subscribes: tuple[str, ...]
    """Key expressions."""
    answers: tuple[str, ...]
    """Key expressions."""
    facts: dict[str, str]
    """What else is worth knowing, e.g. `model`, `model_hash`, `gestemes`, `active_model`."""


class SettingsReport(Message):
    """The settings in force."""

    SCHEMA = "settings_report"

    settings: dict[str, Any]
    """Field name to value, as in the service's settings file."""


class LastStepsQuestion(Message):
    """Asks the input device for steps again."""

    SCHEMA = "last_steps_question"

    count: Annotated[int, Field(gt=0, le=10_000)]
    """At most so many."""
    before: Count | None = None
    """Only steps with an index below this; None for the newest."""


class LastSteps(Message):
    """The last steps, oldest first."""

    SCHEMA = "last_steps"

    clock: Name
    """Boot of the input device."""
    steps: tuple[Step, ...]
    """Consecutive, oldest first."""
    origins: tuple[Origin, ...]
    """The operator sample that completed each step, as many as steps."""


class LoadModel(Message):
    """Asks a recognizer process to work with another model file."""

    SCHEMA = "load_model"

    path: str
    """Of the model file, as the asked process sees it."""


class ActivateRecognizer(Message):
    """Asks the fixture controller to follow another recognizer's belief."""

    SCHEMA = "activate_recognizer"

    model: Name
    """The `{model}` of its keys."""


class RobotLooks(Message):
    """How a robot looks: what is needed to draw it."""

    SCHEMA = "robot_looks"

    robot: Name
    """Which robot, e.g. `puma560`."""
    urdf: str
    """The robot's description; files it names are in `files`."""
    joints: tuple[str, ...]
    """Names in the URDF of the joints of `joint_positions`, in their order."""
    files: dict[str, bytes]
    """Meshes by the name the URDF gives them."""


class Record(Message):
    """Asks the recorder to begin or to end a recording."""

    SCHEMA = "record"

    on: bool
    """True begins one, False ends it."""
    name: str = ""
    """Of the file; by date and time where it is empty."""


class Train(Message):
    """Asks the trainer to learn a model from recordings or demonstrations."""

    SCHEMA = "train"
    VERSION = 2

    model: Name
    """What it is to be called."""
    task: str
    """Name of a task that comes along, or path of a task file, as the trainer sees it."""
    demonstrations: tuple[str, ...]
    """Recordings and CSV files, as the trainer sees them."""
    recognizer: str = ""
    """Kind of recognizer; the default one where it is empty."""
    find_states: bool = False
    """True has gestemes and states found in the motion itself, whatever labels it has: they are
    written as labels beside the recordings, and as a task of their own beside the model."""


class OutlineQuestion(Message):
    """Asks the recorder for the motion in a recording, to set labels by."""

    SCHEMA = "outline_question"

    recording: str = ""
    """Name of the file, without folder; the newest one where it is empty."""


class Outline(Message):
    """The motion in a recording, and which part of the task it was."""

    SCHEMA = "outline"

    recordings: tuple[str, ...]
    """Names of all files in the folder, the newest first."""
    recording: str
    """Name of the file this is the outline of."""
    path: str
    """Of that file, as the recorder sees it."""
    duration_s: Annotated[float, Field(ge=0), Within(LARGEST)]
    """From its first message to its last."""
    time_s: Floats
    """Since its first message, rising, shape (n,)."""
    position: Points
    """Of the hand, m, operator frame, shape (n, 3)."""
    begin_s: Floats
    """Where each label begins, s since the first message, shape (m,)."""
    end_s: Floats
    """Where it ends, shape (m,)."""
    states: tuple[str, ...]
    """What it says, as in Label, m of them."""


class SetLabels(Message):
    """Asks the recorder to write labels beside a recording, instead of those there are."""

    SCHEMA = "set_labels"

    recording: str
    """Name of the file, without folder."""
    begin_s: Floats
    """Where each label begins, s since the recording's first message, shape (m,)."""
    end_s: Floats
    """Where it ends, shape (m,)."""
    states: tuple[str, ...]
    """What it says, as in Label, m of them."""


class Done(Message):
    """The answer to a request that was carried out."""

    SCHEMA = "done"

    detail: str
    """One line: what is so now."""


MESSAGES: tuple[type[Message], ...] = (
    Motion,
    Step,
    Evidence,
    Belief,
    Command,
    FixtureState,
    Pairing,
    StopRequest,
    RobotState,
    Handle,
    Label,
    TrainingProgress,
    Ask,
    Refusal,
    Health,
    Description,
    SettingsReport,
    LastStepsQuestion,
    LastSteps,
    LoadModel,
    ActivateRecognizer,
    RobotLooks,
    Record,
    Train,
    OutlineQuestion,
    Outline,
    SetLabels,
    Done,
)
"""Every message there is, for schemas, golden bytes and tables."""
