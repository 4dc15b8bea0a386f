"""The recorder on the bus."""

from __future__ import annotations

import json
import logging
import shutil
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from threading import Event
from typing import Any

import msgpack
import numpy as np
import pytest
from mcap.reader import make_reader

from hmcs.bus.arrays import to_wire
from hmcs.bus.mailbox import Arrival
from hmcs.bus.messages import (
    Ask,
    Envelope,
    Health,
    Motion,
    Origin,
    Record,
    RobotLooks,
    RobotState,
    Step,
)
from hmcs.bus.session import Bus, RequestRefusedError
from hmcs.bus.wire import encode
from hmcs.errors import UserError
from hmcs.motion.steps import DeadZone
from hmcs.recordings import labels, writing
from hmcs.recordings.inspection import inspected
from hmcs.recordings.reading import RecordingContent, read
from hmcs_recorder import robots, service
from hmcs_recorder.service import Recorder
from hmcs_recorder.settings import RecorderSettings
from support.hand import Hand
from support.stack import Stack

LOG = logging.getLogger("test")


class Bench:
    """A recorder, a hand and somebody who asks, all in this thread."""

    def __init__(self, stack: Stack, folder: Path, **settings: Any) -> None:
        self.stack, self.folder = stack, folder
        self.hand = Hand(stack.open_bus("input_device", "hand"))
        self.bus = stack.open_bus("recorder", "here")
        told = RecorderSettings(folder=folder, flush_s=0.05, free_mb=0.0, **settings)
        self.service = Recorder(told, self.bus, LOG)
        self.service.start()
        stack.until(lambda: self.hand._motions.matching)

    def sample(self, count: int) -> None:
        """Send so many samples, and wait until the recorder has seen them."""
        wanted = self.bus.counters.received[Motion.SCHEMA] + count
        for k in range(count):
            self.hand.sample([0.001 * k, 0.0, 0.0], np.zeros(3))
        self.stack.until(lambda: self.bus.counters.received[Motion.SCHEMA] >= wanted)

    def sample_unrecorded(self) -> None:
        """Send a sample that nobody is to write down."""
        self.hand.sample(np.zeros(3), np.zeros(3))
        for _ in range(5):
            self.stack.until(lambda: self.bus.pump(0.02) >= 0)

    def content(self) -> RecordingContent:
        (file,) = self.folder.glob("*.mcap")
        return read(file)


@pytest.fixture
def stack(tmp_path: Path) -> Iterator[Stack]:
    with Stack(tmp_path) as made:
        yield made


def test_every_message_is_recorded_in_order_with_when_it_was_taken(
    stack: Stack, tmp_path: Path
) -> None:
    bench = Bench(stack, tmp_path / "recordings")
    bench.sample(50)
    bench.service.close()
    content = bench.content()
    motions = [motion for _, _, motion in content.of(Motion)]
    assert len(motions) == 50
    np.testing.assert_array_equal([m.position[0] for m in motions], 0.001 * np.arange(50))
    for recorded, envelope, _ in content.of(Motion):
        assert envelope.origin is not None
        assert 0 <= recorded.log_ns - recorded.captured_ns < 5_000_000_000
    assert inspected(content).channels[0].lost == 0


def test_recording_begins_and_ends_when_asked(stack: Stack, tmp_path: Path) -> None:
    bench = Bench(stack, tmp_path / "recordings", autostart=False)
    assert "waiting" in bench.service.health()[1]
    with pytest.raises(RequestRefusedError, match="nothing is being recorded"):
        bench.service._asked(Record(on=False))
    assert "take-1.mcap" in bench.service._asked(Record(on=True, name="take-1")).detail
    with pytest.raises(RequestRefusedError, match="being recorded already"):
        bench.service._asked(Record(on=True))
    bench.sample(3)
    assert "ended" in bench.service._asked(Record(on=False)).detail
    assert len(list(read(tmp_path / "recordings" / "take-1.mcap").of(Motion))) == 3


def test_a_full_disk_ends_the_recording_which_is_told_and_counted(
    stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(stack, tmp_path / "recordings")
    bench.sample(5)

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    assert bench.service._recording is not None
    monkeypatch.setattr(bench.service._recording._file, "write", full)
    bench.hand.sample(np.zeros(3), np.zeros(3))
    bench.hand.sample(np.zeros(3), np.zeros(3))
    stack.until(lambda: bench.bus.counters.lost["recording"] == 2)
    well, detail = bench.service.health()
    assert not well
    assert "2 messages lost" in detail
    assert "No space left" in detail
    # There is room again: it goes on by itself, in a new file.
    bench.service._again_s = 0.0
    stack.until(lambda: bench.service.health()[0])
    bench.sample(4)
    bench.service.close()
    parts = sorted(bench.folder.glob("*.mcap"), key=lambda file: file.stat().st_mtime)
    assert sum(len(list(read(part).of(Motion))) for part in parts) >= 4


def test_what_is_no_message_is_refused_and_the_rest_recorded(stack: Stack, tmp_path: Path) -> None:
    bench = Bench(stack, tmp_path / "recordings")
    stranger = stack.open_bus("stranger", "one")
    stranger._session.put(stranger.keys.step, b"\xc1")
    stack.until(lambda: bench.bus.counters.refused["recording"] == 1)
    bench.sample(2)
    bench.service.close()
    assert len(bench.content().messages) == 2


def test_who_was_there_and_the_models_are_kept_with_a_recording(
    stack: Stack, tmp_path: Path
) -> None:
    model = tmp_path / "models" / "mine.hmcs"
    model.parent.mkdir()
    model.write_bytes(b"a model")
    stack.watch(stack.open_bus("observer", "one"))
    stack.bring_up("input_device", "device", "--task", "human-shapes")
    bench = Bench(stack, tmp_path / "recordings", models=(model.parent,))
    bench.service.close()
    content = bench.content()
    assert content.attachments == {"mine.hmcs": b"a model"}
    device = content.metadata["input_device/device"]
    assert device["task"] == "human-shapes"
    assert "dead_zone_m" in device["settings"]
    assert content.metadata["hmcs"]["cell"] == "test"


def test_what_was_flushed_outlives_kill_9_and_the_others_go_on(
    stack: Stack, tmp_path: Path
) -> None:
    bus = stack.open_bus("input_device", "hand")
    stack.watch(bus)
    hand = Hand(bus)
    folder = tmp_path / "recordings"
    recorder = stack.bring_up(
        "recorder", "disk", "--folder", folder, "--flush-s", "0.05", "--free-mb", "0"
    )
    key = bus.keys.rpc("recorder", "disk", "health")

    def recorded() -> int:
        hand.sample(np.zeros(3), np.zeros(3))
        answers = bus.ask(key, Ask(), Health)
        return answers[0].body.received.get(Motion.SCHEMA, 0) if answers else 0

    stack.until(lambda: recorded() >= 20)
    sent = hand._samples

    def safe() -> int:
        hand.sample(np.zeros(3), np.zeros(3))
        (file,) = folder.glob("*.mcap")
        return len(list(read(file).of(Motion)))

    stack.until(lambda: safe() >= sent)
    recorder.kill()
    stack.until_gone(recorder)
    hand.sample(np.zeros(3), np.zeros(3))
    (file,) = folder.glob("*.mcap")
    content = read(file)
    assert len(list(content.of(Motion))) >= sent
    assert any("cut off" in problem for problem in inspected(content).problems)


def test_a_recorder_says_where_it_records(stack: Stack, tmp_path: Path) -> None:
    bench = Bench(stack, tmp_path / "recordings")
    facts = bench.service.facts()
    assert facts["recording"].endswith(".mcap")
    assert facts["folder"] == str(tmp_path / "recordings")


def test_steps_made_before_it_began_are_in_a_recording(stack: Stack, tmp_path: Path) -> None:
    early = Hand(stack.open_bus("input_device", "early"))
    zone = DeadZone(0.01)
    made = [step for k in range(30) if (step := zone.push([0.01 * k, 0.0, 0.0])) is not None]
    for step in made[:20]:
        early.keep(step)
    with pumped(early.bus):
        bench = Bench(stack, tmp_path / "recordings")
    for step in made[20:]:
        early.step(step)
    stack.until(lambda: bench.bus.counters.received[Step.SCHEMA] >= len(made) - 20)
    bench.service.close()
    steps = [step.index for _, _, step in bench.content().of(Step)]
    assert steps == [step.index for step in made]


@contextmanager
def pumped(bus: Bus) -> Iterator[None]:
    """A bus that answers on a thread of its own."""
    over = Event()

    def pump() -> None:
        while not over.is_set():
            bus.pump(0.01)

    with ThreadPoolExecutor(1) as aside:
        answering = aside.submit(pump)
        try:
            yield
        finally:
            over.set()
        answering.result()


# --- time -----------------------------------------------------------------------------------------


class SetClock:
    """`time` whose wall clock is set by so many ns."""

    def __init__(self) -> None:
        self.by_ns = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(time, name)

    def time_ns(self) -> int:
        return time.time_ns() + self.by_ns


@pytest.mark.parametrize("by_s", [8 * 3600, -7200])
def test_messages_carry_the_time_on_the_wall_whenever_the_clock_is_set(
    stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, by_s: int
) -> None:
    clock = SetClock()
    monkeypatch.setattr(service, "time", clock)
    bench = Bench(stack, tmp_path / "recordings", autostart=False)
    clock.by_ns = by_s * 10**9
    bench.service._asked(Record(on=True, name="take"))
    bench.sample(5)
    # And once more while it records.
    clock.by_ns = 2 * by_s * 10**9
    bench.sample(7)
    now_ns = clock.time_ns()
    bench.service.close()
    before, after = (read(bench.folder / f"take{part}.mcap") for part in ("", "-002"))
    assert [len(list(content.of(Motion))) for content in (before, after)] == [5, 7]
    assert abs(after.last_ns - now_ns) < 60 * 10**9
    assert abs(before.last_ns + by_s * 10**9 - now_ns) < 60 * 10**9
    for content in (before, after):
        times = [message.log_ns for message in content.messages]
        assert times == sorted(times)
    assert sorted(file.name for file in bench.folder.iterdir()) == ["take-002.mcap", "take.mcap"]


def test_a_capture_told_by_another_machines_clock_is_as_if_it_were_not_told(
    stack: Stack, tmp_path: Path
) -> None:
    bench = Bench(stack, tmp_path / "recordings")
    hand = bench.hand
    motion = Motion(position=np.zeros(3), velocity=np.zeros(3), dead_man=True)
    now_ns = time.monotonic_ns()
    captures = [now_ns, now_ns - 60 * 10**9, now_ns + 60 * 10**9, 0, -(2**62), 2**62]
    for captured_ns in captures:
        origin = Origin(boot=hand.clock, seq=0, captured_ns=captured_ns)
        hand._motions.put(motion, origin)
    stack.until(lambda: bench.bus.counters.received[Motion.SCHEMA] >= len(captures))
    bench.service.close()
    apart = [m.log_ns - m.captured_ns for m, _, _ in bench.content().of(Motion)]
    assert 0 < apart[0] <= 5_000_000_000
    assert apart[1:] == [0] * 5


def test_what_was_received_while_it_began_is_not_logged_before_it_began(
    stack: Stack, tmp_path: Path
) -> None:
    bench = Bench(stack, tmp_path / "recordings", autostart=False)
    bench.service._begin("take")
    begun_ns = bench.service._earliest_ns
    motion = Motion(position=np.zeros(3), velocity=np.zeros(3), dead_man=True)
    envelope = Envelope(source=bench.hand.bus.source, seq=0)
    for ago_ns in (10**9, 2 * 10**9):
        payload = encode(motion, envelope)
        bench.service._on_arrival(Arrival("k", payload, time.monotonic_ns() - ago_ns))
    bench.service.close()
    content = bench.content()
    assert content.first_ns == content.last_ns == begun_ns


# --- names and folders ----------------------------------------------------------------------------


def test_a_part_whose_name_is_taken_goes_on_under_the_next_one(
    stack: Stack, tmp_path: Path
) -> None:
    folder = tmp_path / "recordings"
    folder.mkdir()
    (folder / "take-002.mcap").write_bytes(b"an earlier recording")
    (folder / "take-003.mcap").symlink_to("nowhere")
    bench = Bench(stack, folder, autostart=False, part_s=0.05)
    bench.service._asked(Record(on=True, name="take"))
    sent = 0
    while not (folder / "take-005.mcap").exists():
        bench.sample(5)
        sent += 5
    assert bench.service.health()[0]
    assert bench.service.facts()["recording"].endswith(".mcap")
    bench.service.close()
    assert (folder / "take-002.mcap").read_bytes() == b"an earlier recording"
    parts = [
        file
        for file in folder.glob("take*.mcap")
        if file.name[4:] not in ("-002.mcap", "-003.mcap")
    ]
    assert sum(len(list(read(part).of(Motion))) for part in parts) == sent


def test_a_name_that_is_taken_is_refused_and_nothing_begins_later(
    stack: Stack, tmp_path: Path
) -> None:
    bench = Bench(stack, tmp_path / "recordings", autostart=False)
    bench.service._asked(Record(on=True, name="take"))
    bench.service._asked(Record(on=False))
    with pytest.raises(UserError, match="there is a recording already: choose another name"):
        bench.service._asked(Record(on=True, name="take"))
    bench.service._again_s = 0.0
    bench.service._on_flush()
    assert "waiting" in bench.service.health()[1]
    assert [file.name for file in bench.folder.iterdir()] == ["take.mcap"]


def test_a_recorder_that_begins_by_itself_takes_the_next_free_name(
    stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(service, "_now", lambda: datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC))
    benches = [Bench(stack, tmp_path / "recordings") for _ in range(2)]
    assert sorted(file.name for file in benches[0].folder.iterdir()) == [
        "20260102-030405-002.mcap",
        "20260102-030405.mcap",
    ]
    for bench in benches:
        bench.service.close()


def test_a_request_that_fails_is_refused_and_not_carried_out_later(
    stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(stack, tmp_path / "recordings", autostart=False)
    with monkeypatch.context() as patch:
        patch.setattr(Path, "mkdir", denied)
        with pytest.raises(RequestRefusedError, match="Permission denied"):
            bench.service._asked(Record(on=True, name="take"))
    assert bench.service.health() == (True, "waiting to be told to record")
    bench.service._again_s = 0.0
    bench.service._on_flush()
    bench.sample_unrecorded()
    assert bench.bus.counters.lost["recording"] == 0
    assert not bench.folder.exists()


def denied(*_: object, **__: object) -> None:
    raise PermissionError(13, "Permission denied")


@pytest.mark.parametrize("how", ["folder", "file", "other file", "denied"])
def test_recording_goes_on_whatever_becomes_of_its_folder(
    stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, how: str
) -> None:
    bench = Bench(stack, tmp_path / "recordings")
    (bench.folder / "other.mcap").write_bytes(b"x")
    bench.sample(5)
    if how == "folder":
        shutil.rmtree(bench.folder)
    elif how == "file":
        Path(bench.service.facts()["recording"]).unlink()
    elif how == "other file":
        # It vanishes just as the files are counted.
        (bench.folder / "gone-1.mcap").symlink_to("nowhere")
    else:
        with monkeypatch.context() as patch:
            patch.setattr(shutil, "disk_usage", denied)
            stack.until(lambda: not bench.service.health()[0])
            assert "Permission denied" in bench.service.health()[1]
    stack.until(lambda: Path(bench.service.facts()["recording"] or "-").exists() or _due(bench))
    bench.sample(4)
    bench.service.close()
    files = [file for file in bench.folder.glob("*-*.mcap") if file.exists()]
    assert sum(len(list(read(file).of(Motion))) for file in files) >= 4


def _due(bench: Bench) -> bool:
    bench.service._again_s = 0.0
    return False


def test_labels_that_lie_where_a_recording_begins_are_told(stack: Stack, tmp_path: Path) -> None:
    bench = Bench(stack, tmp_path / "recordings", autostart=False)
    said = bench.service._asked(Record(on=True, name="take")).detail
    assert said == f"recording to {bench.folder / 'take.mcap'}"
    bench.sample(3)
    bench.service._asked(Record(on=False))
    labels.write_labels(read(bench.folder / "take.mcap"), [])
    (bench.folder / "take.mcap").unlink()
    said = bench.service._asked(Record(on=True, name="take")).detail
    assert "take.labels.csv are of an earlier one and do not count for it" in said
    bench.service._asked(Record(on=False))
    (bench.folder / "take.mcap").unlink()
    (bench.folder / "take.labels.csv").write_text("begin_s,end_s,state\n")
    said = bench.service._asked(Record(on=True, name="take")).detail
    assert "do not say of which recording they are and will count for it" in said
    bench.service.close()


# --- what others send -----------------------------------------------------------------------------


def packed(**fields: object) -> bytes:
    zeros = to_wire(np.zeros(3))
    source = {"service": "stranger", "instance": "one", "boot": "b"}
    legal = {"schema": "motion/1", "source": source, "seq": 0, "dead_man": True}
    data: bytes = msgpack.packb({**legal, "position": zeros, "velocity": zeros, **fields})
    return data


MALFORMED = [
    b"",
    b"\xc1",
    b"\x01",
    packed(schema=["motion/1"]),
    packed(schema=b"motion/1"),
    packed(schema=7),
    packed(schema="motion/99"),
    packed(source=None),
    packed(source=["a"]),
    packed(seq=None),
    packed(seq=[1]),
    packed(position=[0.0, 0.0, 0.0]),
    packed(position={"dtype": "<f8", "shape": [3], "data": b""}),
    packed(position={"dtype": ["<f8"], "shape": "x", "data": b"12345678"}),
    packed(position=to_wire(np.full(3, np.nan))),
    packed(origin=[]),
    packed(dead_man="yes"),
    b"\x91" * 5000 + b"\x01",
]


def test_malformed_messages_are_refused_one_by_one_and_every_other_is_recorded(
    stack: Stack, tmp_path: Path
) -> None:
    bench = Bench(stack, tmp_path / "recordings")
    stranger = stack.open_bus("stranger", "one")
    for number, payload in enumerate(MALFORMED):
        stranger._session.put(stranger.keys.motion, payload)
        stranger._session.put(stranger.keys.motion, packed(seq=number))
    stack.until(lambda: bench.bus.counters.received[Motion.SCHEMA] >= len(MALFORMED))
    stack.until(lambda: bench.bus.counters.refused["recording"] >= len(MALFORMED))
    bench.sample(3)
    bench.service.close()
    assert bench.bus.counters.refused["recording"] == len(MALFORMED)
    content = bench.content()
    assert len(list(content.of(Motion))) == len(content.messages) == len(MALFORMED) + 3
    assert inspected(content).channels[0].lost == 0


def test_what_nobody_thought_of_costs_one_message(
    stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(stack, tmp_path / "recordings")
    recording = bench.service._recording
    assert recording is not None
    write, calls = recording._file.write, iter(range(100))

    def fails_once(*args: Any) -> None:
        if next(calls) == 0:
            raise KeyError("surprise")
        write(*args)

    monkeypatch.setattr(recording._file, "write", fails_once)
    for k in range(4):
        bench.hand.sample([0.001 * k, 0.0, 0.0], np.zeros(3))
    stack.until(lambda: bench.bus.counters.received[Motion.SCHEMA] >= 3)
    bench.service.close()
    assert bench.bus.counters.refused["recording"] == 1
    assert len(bench.content().messages) == 3


def test_more_kinds_and_keys_than_a_file_has_room_for_are_refused(
    stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writing, "MOST_CHANNELS", 3)
    bench = Bench(stack, tmp_path / "recordings")
    for number in range(10):
        bench.service._on_arrival(Arrival(f"a/b/c/k{number}", packed(), time.monotonic_ns()))
    bench.service.close()
    # Two of the three are for what viewers show.
    assert 0 < len(bench.content().messages) < 3
    assert bench.bus.counters.refused["recording"] >= 7


# --- what is kept with it -------------------------------------------------------------------------


def test_models_that_cannot_be_read_are_left_out_and_two_of_a_name_told_apart(
    stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    places = [tmp_path / "one", tmp_path / "two", tmp_path / "bad"]
    for place in places:
        place.mkdir()
        (place / "mine.hmcs").write_bytes(place.name.encode())
    read_bytes = Path.read_bytes

    def broken(file: Path) -> bytes:
        return denied() if file.parent.name == "bad" else read_bytes(file)  # type: ignore[func-returns-value, return-value]

    monkeypatch.setattr(Path, "read_bytes", broken)
    bench = Bench(stack, tmp_path / "recordings", models=(*places, tmp_path / "none"))
    bench.service.close()
    monkeypatch.undo()
    assert bench.content().attachments == {"mine.hmcs": b"one", "mine-2.hmcs": b"two"}


class Robot:
    """Publishes states of a robot, and says how it looks where it does."""

    def __init__(self, stack: Stack, *, answers: bool) -> None:
        self.bus = stack.open_bus("robot", f"arm-{answers}")
        self._states = self.bus.publisher(RobotState, self.bus.keys.robot_state)
        looks = RobotLooks(
            robot="two-joints", urdf="<robot/>", joints=("waist", "elbow"), files={"a": b"mesh"}
        )
        if answers:
            self.bus.answer("looks", Ask, lambda _: looks)

    def state(self) -> None:
        still = np.zeros(6)
        self._states.put(
            RobotState(
                robot="two-joints",
                joint_positions=np.array([0.1, 0.2]),
                joint_velocities=np.zeros(2),
                tool_position=np.zeros(3),
                tool_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
                tool_twist=still,
                reference_twist=still,
                nearest_obstacle="",
                nearest_distance_m=None,
                contacts=(),
                stop="none",
                limited=(),
            )
        )


def shown_joints(file: Path) -> list[list[str]]:
    """What viewers are shown of a robot's joints."""
    with file.open("rb") as stream:
        return [
            [joint["name"] for joint in json.loads(message.data)["joints"]]
            for _, channel, message in make_reader(stream).iter_messages()
            if channel.topic == "/foxglove/joints"
        ]


def test_joints_are_shown_by_the_names_that_the_robot_says_they_have(
    stack: Stack, tmp_path: Path
) -> None:
    """Though the robot came when it was being recorded already."""
    bench = Bench(stack, tmp_path / "recordings")
    robot = Robot(stack, answers=True)
    (file,) = bench.folder.glob("*.mcap")
    robots = bench.service._robots
    with pumped(robot.bus):
        stack.until(lambda: robot.state() or "two-joints" in robots._looks)
        stack.until(lambda: robot.state() or not bench.service._recording.undescribed)  # type: ignore[union-attr]
        time_out = bench.bus.counters.received[RobotState.SCHEMA] + 20
        stack.until(
            lambda: robot.state() or bench.bus.counters.received[RobotState.SCHEMA] > time_out
        )
    bench.service.close()
    shown = shown_joints(file)
    assert shown[0] == []
    assert shown[-1] == ["waist", "elbow"]
    content = read(file)
    assert content.metadata["joints/two-joints"]["joints"] == "waist elbow"
    assert content.attachments["two-joints.urdf"] == b"<robot/>"


def test_that_a_robot_does_not_say_how_it_looks_is_told_and_no_names_are_invented(
    stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(robots, "RETRY_S", 0.01)
    bench = Bench(stack, tmp_path / "recordings")
    robot = Robot(stack, answers=False)
    asked = bench.service._robots._asked
    stack.until(lambda: robot.state() or asked.get("two-joints", 0) == robots.MOST_ASKED)
    bench.service.close()
    (file,) = bench.folder.glob("*.mcap")
    assert {name for names in shown_joints(file) for name in names} == set()
    assert "gives no answer" in read(file).metadata["joints/two-joints"]["unknown"]
