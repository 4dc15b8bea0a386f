"""The service over a real router, pumped by the test."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hmcs.bus.messages import Ask, Done, Handle, LastSteps, LastStepsQuestion, Motion, RobotState
from hmcs.bus.service import run
from hmcs.bus.session import Bus, Received, RequestRefusedError
from hmcs.bus.wire import encode
from hmcs.motion.demonstrations import Demonstration, write_csv
from hmcs.motion.steps import steps_of
from hmcs_input_device import guarded, held, press_gate
from hmcs_input_device import service as service_module
from hmcs_input_device.service import InputDevice
from hmcs_input_device.sources import LIVE, DeviceSample

MakeDesk = Callable[..., Any]


@pytest.fixture
def play(make_desk: MakeDesk, line_file: Path) -> MakeDesk:
    """Bring up an input device that plays the line."""
    settings = {
        "source": "recorded",
        "demonstration": line_file,
        "lead_in_s": 0.2,
        "rate_hz": 100.0,
        "dead_zone_m": 0.02,
    }
    return lambda **changes: make_desk(**(settings | changes))


def test_every_sample_is_published_and_is_its_own_origin(play: MakeDesk) -> None:
    desk = play()
    desk.until_finished()
    for received in desk.motions:
        envelope = received.envelope
        assert envelope.origin is not None
        assert (envelope.origin.boot, envelope.origin.seq) == (envelope.source.boot, envelope.seq)
    captured = [received.envelope.origin.captured_ns for received in desk.motions]
    assert captured == sorted(captured)
    held = [received.body.dead_man for received in desk.motions]
    assert not held[0]
    assert not held[-1]
    assert any(held)


def test_steps_are_those_of_the_recording_and_name_the_sample_that_completed_them(
    play: MakeDesk, line: Demonstration
) -> None:
    desk = play()
    desk.until_finished()
    expected = steps_of(line.positions, 0.02)
    # A busy machine may skip a tick, and a step is then one sample longer.
    assert len(desk.steps) == pytest.approx(len(expected), abs=1)
    assert [received.body.index for received in desk.steps] == list(range(len(desk.steps)))
    sampled = {received.envelope.seq: received.body for received in desk.motions}
    for received in desk.steps:
        step, origin = received.body, received.envelope.origin
        assert np.linalg.norm(step.displacement) >= 0.02
        if origin.seq in sampled:
            np.testing.assert_allclose(
                step.position + step.displacement, sampled[origin.seq].position, atol=1e-12
            )


def test_the_last_steps_are_told_again_with_their_origins(play: MakeDesk) -> None:
    desk = play()
    desk.until_finished()
    clock = desk.bus.source.boot
    told = desk.ask("last_steps", LastStepsQuestion(count=10_000), LastSteps)
    assert told.clock == clock
    assert [step.index for step in told.steps] == [r.body.index for r in desk.steps]
    assert list(told.origins) == [r.envelope.origin for r in desk.steps]
    for question, indices in (
        (LastStepsQuestion(count=3), slice(-3, None)),
        (LastStepsQuestion(count=2, before=5), slice(3, 5)),
        (LastStepsQuestion(count=10, before=2), slice(0, 2)),
        (LastStepsQuestion(count=10, before=0), slice(0, 0)),
        (LastStepsQuestion(count=2, before=10**6), slice(-2, None)),
    ):
        told = desk.ask("last_steps", question, LastSteps)
        expected = list(range(len(desk.steps)))[indices]
        assert [step.index for step in told.steps] == expected


def test_it_rests_until_it_is_told_to_play_and_plays_as_often_as_told(play: MakeDesk) -> None:
    desk = play(autoplay=False)
    desk.until(lambda: len(desk.motions) > 20, "samples at rest")
    assert not any(received.body.dead_man for received in desk.motions)
    assert desk.service.health() == (True, "waiting to be told to play")
    assert isinstance(desk.ask("play", Ask(), Done), Done)
    desk.until_finished()
    once = len(desk.steps)
    assert once > 5
    assert desk.service.facts()["remaining_s"] == "0.00"
    desk.ask("play", Ask(), Done)
    desk.until_finished()
    indices = [received.body.index for received in desk.steps]
    assert indices == list(range(len(desk.steps)))
    assert len(indices) >= 2 * once - 2
    assert max(np.linalg.norm(r.body.displacement) for r in desk.steps) < 0.1


def test_it_waits_for_those_it_is_told_to_wait_for(play: MakeDesk) -> None:
    desk = play(wait_for=("robot", "robot", "task_hmm"))
    assert desk.service.health() == (True, "waiting for robot, robot, task_hmm")
    refused = desk.ask("play", Ask(), Done)
    assert isinstance(refused, RequestRefusedError)
    assert "robot" in str(refused)
    keys = desk.listener.keys
    desk.listener.announce(keys.presence("robot", "a"))
    desk.listener.announce(keys.presence("task_hmm", "a"))
    desk.until(lambda: desk.service.health()[1] == "waiting for robot", "two of three")
    desk.listener.announce(keys.presence("robot", "b"))
    desk.until(lambda: desk.service.health()[1] == "playing", "the third")
    desk.until(lambda: desk.steps, "steps")


def test_a_dead_zone_larger_than_the_motion_makes_a_simulated_device_unhealthy(
    make_desk: MakeDesk, caplog: pytest.LogCaptureFixture
) -> None:
    desk = make_desk(primitive_scale=0.02, segments=1, dead_zone_m=0.2, step_m=0.001)
    healthy, detail = desk.service.health()
    assert not healthy
    assert "no step possible" in detail
    assert "no step possible" in caplog.text


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--dead-zone-m", "0.2", "--demonstration", "SMALL"], "less than the dead zone of 0.2 m"),
        (["--demonstration", "none.csv"], "none.csv: cannot be read"),
        (["--task", "none"], "human-shapes, lines-through-obstacles"),
        (
            ["--source", "joystick"],
            "choose of: gamepad, keyboard, mouse, page, recorded, recording, simulated, spacemouse,"
            " synthetic",
        ),
        (["--device", '{"axes": {"x": "up"}}'], "device.axes.x"),
        (["--source", "gamepad", "--device.axes.z", "rz"], "this device has no axis 'rz'"),
        (["--rate-hz", "7"], "rate_hz"),
    ],
)
def test_a_mistake_of_the_user_ends_it_with_code_2_and_one_message(
    router: str,
    tmp_path: Path,
    line: Demonstration,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    said: str,
) -> None:
    write_csv(tmp_path / "small.csv", line._replace(positions=line.positions / 2))
    small = [str(tmp_path / "small.csv") if word == "SMALL" else word for word in arguments]
    assert run(InputDevice, ["--router", router, "--source", "recorded", *small]) == 2
    message = capsys.readouterr().err.splitlines()[-1]
    assert message.startswith("input_device: ")
    assert said in message


class Robot:
    """Follows while the dead-man is held, after a stop only once it was released."""

    def __init__(self, bus: Bus) -> None:
        self.may_follow = False
        self.stands = False
        self.asked_until_s = 0.0
        self._states = bus.publisher(RobotState, bus.keys.robot_state)
        bus.subscribe(Motion, bus.keys.motion, self._on_motion)

    def stop(self) -> None:
        self.may_follow = False

    def ask_to_stop(self) -> None:
        """As `hmcs stop` does; it is told for half a second, or until it moves again."""
        self.may_follow = False
        self.asked_until_s = time.monotonic() + 0.5

    def _on_motion(self, received: Received[Motion]) -> None:
        held = received.body.dead_man
        self.may_follow = self.may_follow or not held
        self.stands = not (self.may_follow and held)
        if not self.stands:
            self.asked_until_s = 0.0
        told = self.asked_until_s and (held or time.monotonic() < self.asked_until_s)
        stop = "asked" if told else "stale_command" if self.stands else "none"
        self._states.put(
            RobotState(
                robot="fake",
                joint_positions=np.zeros(6),
                joint_velocities=np.zeros(6),
                tool_position=np.zeros(3),
                tool_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
                tool_twist=np.zeros(6),
                reference_twist=np.zeros(6),
                nearest_obstacle="",
                nearest_distance_m=None,
                contacts=(),
                stop=stop,
                limited=(),
            )
        )


@pytest.mark.parametrize("re_engage", [True, False])
def test_operator_of_a_recording_lets_go_and_presses_again_when_the_robot_stands(
    play: MakeDesk, line: Demonstration, re_engage: bool
) -> None:
    desk = play(re_engage=re_engage, lead_in_s=0.5, speed=0.5, autoplay=False)
    robot = Robot(desk.open_bus("robot"))
    desk.ask("play", Ask(), Done)
    desk.until(lambda: len(desk.steps) >= 3, "steps")
    assert not robot.stands
    robot.stop()
    desk.until_finished()
    held = [received.body.dead_man for received in desk.motions]
    assert int(np.diff(np.array(held, dtype=int)).clip(0).sum()) == 1 + re_engage
    assert desk.service.facts()["re_engagements"] == str(int(re_engage))
    # A tick that a busy machine skips makes a step one sample longer, and no motion is lost.
    expected = steps_of(line.positions, 0.02)
    assert len(desk.steps) == pytest.approx(len(expected), abs=1)
    assert [received.body.index for received in desk.steps] == list(range(len(desk.steps)))
    sampled = {received.envelope.seq: received.body for received in desk.motions}
    for received in desk.steps:
        origin = received.envelope.origin
        assert received.body.displacement[1] < 0.05
        if origin.seq in sampled:
            np.testing.assert_allclose(
                received.body.position + received.body.displacement,
                sampled[origin.seq].position,
                atol=1e-9,
            )


@pytest.mark.parametrize("source", ["recorded", "synthetic", "simulated"])
@pytest.mark.parametrize("re_engage", [True, False])
def test_a_stop_that_was_asked_for_holds_until_a_person_asks_to_play(
    make_desk: MakeDesk,
    line_file: Path,
    caplog: pytest.LogCaptureFixture,
    source: str,
    re_engage: bool,
) -> None:
    recorded = {"demonstration": line_file, "repeat": 0, "speed": 0.5}
    desk = make_desk(
        source=source,
        re_engage=re_engage,
        lead_in_s=0.3,
        rate_hz=100.0,
        dead_zone_m=0.02,
        autoplay=False,
        **(recorded if source == "recorded" else {"repeat": 0} if source == "synthetic" else {}),
    )
    robot = Robot(desk.open_bus("robot"))
    assert "from its beginning" in desk.ask("play", Ask(), Done).detail
    desk.until(lambda: len(desk.steps) >= 2, "steps")
    for _ in range(2):
        stop_and_go_on(desk, robot)
    assert caplog.text.count("lets go, as a stop was asked for") == 2
    assert [received.body.index for received in desk.steps] == list(range(len(desk.steps)))
    assert max(np.linalg.norm(received.body.displacement) for received in desk.steps) < 0.1


def stop_and_go_on(desk: Any, robot: Robot) -> None:
    """Ask for a stop, look for long that it holds, and ask to play."""
    before_s = float(desk.service.facts()["played_s"])
    robot.ask_to_stop()
    desk.until(lambda: desk.service.facts()["stopped"] == "x", "the stop to be heard")
    healthy, detail = desk.service.health()
    assert healthy
    assert detail.startswith("stopped: x was asked to stand; goes on when it is asked to play")
    desk.until(lambda: not desk.motions[-1].body.dead_man, "the hand to let go")
    count, steps = len(desk.motions), len(desk.steps)
    # Longer than a played operator takes to react, and than a pass with its lead-in.
    until_s = time.monotonic() + 2.0
    desk.until(lambda: time.monotonic() > until_s, "time to pass")
    assert len(desk.motions) > count
    assert not any(received.body.dead_man for received in desk.motions[count:])
    assert not any(received.body.velocity.any() for received in desk.motions[count:])
    assert len(desk.steps) == steps
    assert "takes hold again and goes on at" in desk.ask("play", Ask(), Done).detail
    desk.until(lambda: not robot.stands, "the robot to follow again")
    assert desk.service.facts()["stopped"] == ""
    desk.until(lambda: len(desk.steps) > steps + 1, "steps where it goes on")
    assert float(desk.service.facts()["played_s"]) >= before_s


def test_a_stop_before_it_plays_is_not_undone_by_its_own_beginning(play: MakeDesk) -> None:
    desk = play(wait_for=("robot",), re_engage=True)
    robot_bus = desk.open_bus("robot")
    robot = Robot(robot_bus)
    robot.ask_to_stop()
    desk.until(lambda: desk.service.facts()["stopped"] == "x", "the stop to be heard")
    desk.listener.announce(desk.listener.keys.presence("robot", "x"))
    count = len(desk.motions)
    desk.until(lambda: len(desk.motions) > count + 100, "time to begin")
    assert not any(received.body.dead_man for received in desk.motions)
    assert "from its beginning" in desk.ask("play", Ask(), Done).detail
    desk.until(lambda: not robot.stands, "the robot to follow")


def test_what_is_no_robot_of_the_cell_stops_nothing(play: MakeDesk) -> None:
    desk = play(repeat=0)
    desk.listener.announce(desk.listener.keys.presence("robot", "true"))
    stranger = Robot(desk.open_bus("robot"))
    desk.until(lambda: "robot" in str(desk.service._present), "the robot's token")
    stranger.ask_to_stop()
    count = len(desk.motions)
    desk.until(lambda: len(desk.motions) > count + 50, "time to pass")
    assert desk.service.facts()["stopped"] == ""


def test_after_its_end_a_stop_is_ended_by_playing_anew(play: MakeDesk) -> None:
    desk = play()
    robot = Robot(desk.open_bus("robot"))
    desk.until_finished()
    robot.ask_to_stop()
    desk.until(lambda: desk.service.facts()["stopped"] == "x", "the stop to be heard")
    steps = len(desk.steps)
    assert "from its beginning" in desk.ask("play", Ask(), Done).detail
    desk.until(lambda: len(desk.steps) > steps, "steps")


class Hand:
    """A device that says what it is told to."""

    rate_hz, duration_s, reach_m = 200.0, LIVE, None

    def __init__(self) -> None:
        self.says: DeviceSample | None = DeviceSample(np.zeros(3), np.zeros(3), dead_man=False)
        self.closed = False

    def move(self, x_m: float, **fields: Any) -> None:
        position = np.array([x_m, 0.0, 0.0])
        self.says = DeviceSample(position, np.zeros(3), **({"dead_man": True} | fields))

    def sample(self, elapsed_s: float | None) -> DeviceSample | None:
        return self.says

    def close(self) -> None:
        self.closed = True


def seen(desk: Any) -> None:
    """Pump until what the device says now was published."""
    count = len(desk.motions)
    desk.until(lambda: len(desk.motions) > count + 3, "the device to be seen")


def press(desk: Any, hand: Hand, **fields: Any) -> None:
    """Let go and press."""
    for dead_man in (False, True):
        hand.move(0.0, dead_man=dead_man, **fields)
        seen(desk)
    assert desk.motions[-1].body.dead_man


@pytest.fixture
def hand(monkeypatch: pytest.MonkeyPatch) -> Hand:
    device = Hand()
    monkeypatch.setattr(service_module, "BUILT_IN", {"hand": lambda *_: device})
    # A busy machine may hold this test up; what becomes of a hang is tested without a clock.
    monkeypatch.setattr(press_gate, "HANG_S", 60.0)
    monkeypatch.setattr(guarded, "FROZEN_S", 60.0)
    return device


def test_motion_made_while_clutched_or_released_is_taken_out_of_the_steps(
    make_desk: MakeDesk, hand: Hand
) -> None:
    desk = make_desk(source="hand", dead_zone_m=0.02)

    def let(x_m: float, **fields: Any) -> None:
        hand.move(x_m, **fields)
        seen(desk)

    press(desk, hand)
    let(0.03)
    let(0.03, clutch=True)
    let(0.50, clutch=True)
    let(0.50)
    let(0.53)
    let(0.53, dead_man=False)
    let(0.0, dead_man=False)
    let(0.0)
    let(0.03)
    desk.until(lambda: len(desk.steps) == 3, "three steps")
    for index, received in enumerate(desk.steps):
        np.testing.assert_allclose(received.body.position, (0.03 * index, 0, 0), atol=1e-12)
        np.testing.assert_allclose(received.body.displacement, (0.03, 0, 0), atol=1e-12)


def test_steps_tell_what_was_felt_and_signaled_and_are_told_again_alike(
    make_desk: MakeDesk, hand: Hand
) -> None:
    desk = make_desk(source="hand", dead_zone_m=0.02)
    turns = [np.array([0, 0, np.sin(a), np.cos(a)]) for a in (0.0, 0.2, 0.4, 0.6)]

    def let(x_m: float, turn: int, **fields: Any) -> None:
        hand.move(x_m, orientation=turns[turn], wrench=np.full(6, float(turn)), **fields)
        seen(desk)

    press(desk, hand, orientation=turns[0], wrench=np.zeros(6))
    let(0.03, 1)
    let(0.03, 1, pedal=True, dead_man=False)
    let(0.03, 1, dead_man=False)
    let(0.03, 1)
    let(0.06, 2)
    let(0.09, 3)
    desk.until(lambda: len(desk.steps) == 3, "three steps")
    steps = [received.body for received in desk.steps]
    assert [step.mark for step in steps] == [False, True, False]
    for k, step in enumerate(steps):
        np.testing.assert_allclose(step.orientation, turns[k + 1], atol=1e-12)
        assert k < step.wrench[0] <= k + 1
        np.testing.assert_array_equal(step.wrench, step.wrench[0])
    told = desk.ask("last_steps", LastStepsQuestion(count=10), LastSteps).steps
    for step, again in zip(steps, told, strict=True):
        for name in type(step).model_fields:
            np.testing.assert_array_equal(getattr(step, name), getattr(again, name))


def test_an_orientation_that_is_no_rotation_is_refused(make_desk: MakeDesk, hand: Hand) -> None:
    desk = make_desk(source="hand", dead_zone_m=0.02)
    press(desk, hand)
    hand.move(0.0, orientation=np.zeros(4))
    desk.until(lambda: desk.bus.counters.refused["motion"] > 2, "refusals")
    assert not desk.service.health()[0]
    turned = np.array([0, 0, 1.0, 0])
    press(desk, hand, orientation=turned)
    hand.move(0.05, orientation=turned)
    desk.until(lambda: desk.steps, "a step")
    assert desk.service.health()[0]


def test_a_sample_that_is_none_is_refused_counted_and_only_a_new_press_moves_again(
    make_desk: MakeDesk, hand: Hand
) -> None:
    desk = make_desk(source="hand", dead_zone_m=0.02)
    press(desk, hand)
    hand.move(float("nan"))
    desk.until(lambda: desk.bus.counters.refused["motion"] > 2, "refusals")
    assert not desk.service.health()[0]
    hand.move(0.05)
    count = len(desk.motions)
    desk.until(lambda: len(desk.motions) > count + 20, "samples at rest")
    assert not desk.motions[-1].body.dead_man
    assert "let go of it and press it anew" in desk.service.health()[1]
    press(desk, hand)
    hand.move(0.05)
    desk.until(lambda: desk.steps, "a step")
    assert desk.steps[0].body.displacement[0] == pytest.approx(0.05)
    assert desk.service.health() == (True, "playing")
    assert all(np.isfinite(received.body.position).all() for received in desk.motions)
    assert desk.listener.counters.lost["motion"] == 0


def test_a_device_that_falls_silent_rests_is_unhealthy_and_closed_at_the_end(
    make_desk: MakeDesk, hand: Hand, caplog: pytest.LogCaptureFixture
) -> None:
    desk = make_desk(source="hand")
    press(desk, hand)
    hand.says = None
    desk.until(lambda: not desk.service.health()[0], "bad health")
    assert "hand: gives no samples" in desk.service.health()[1]
    count = len(desk.motions)
    desk.until(lambda: len(desk.motions) > count + 3, "samples at rest")
    assert not desk.motions[-1].body.dead_man
    assert caplog.text.count("the hand rests") == 1
    assert isinstance(desk.ask("play", Ask(), Done), RequestRefusedError)
    desk.service.close()
    assert hand.closed


def test_a_hand_that_is_there_ends_a_stop_by_itself(make_desk: MakeDesk, hand: Hand) -> None:
    """A person lets go and takes hold again; nobody else has to be asked."""
    desk = make_desk(source="hand")
    robot = Robot(desk.open_bus("robot"))
    press(desk, hand)
    robot.ask_to_stop()
    seen(desk)
    assert robot.stands
    assert desk.motions[-1].body.dead_man
    assert desk.service.facts()["stopped"] == ""
    press(desk, hand)
    desk.until(lambda: not robot.stands, "the robot to follow")


# --- the page's handle ----------------------------------------------------------------------------


@pytest.fixture
def page(make_desk: MakeDesk, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A device that is the handle of a page, and a page."""
    monkeypatch.setattr(press_gate, "HANG_S", 60.0)
    monkeypatch.setattr(held, "SILENT_S", 60.0)
    desk = make_desk(source="page", dead_zone_m=0.02)
    desk.handles = desk.open_bus("console").publisher(Handle, desk.bus.keys.handle)
    return desk


def tell(page: Any, x_m: float, operator: str = "page-1", *, dead_man: bool = True) -> None:
    page.handles.put(
        Handle(operator=operator, position=np.array([x_m, 0.0, 0.0]), dead_man=dead_man)
    )
    received = page.bus.counters.received["handle"]
    page.until(lambda: page.bus.counters.received["handle"] > received, "the handle to be heard")
    seen(page)


def test_a_page_that_is_hostile_leaves_no_trace(page: Any) -> None:
    tell(page, 0.0, dead_man=False)
    tell(page, 0.0)
    assert page.motions[-1].body.dead_man
    for x_m in (1e9, -1e9, 2e4, -2e4):
        tell(page, x_m)
    assert not page.motions[-1].body.dead_man
    assert page.bus.counters.refused["handle"] == 4
    assert "out of reach" in page.service.health()[1]
    for seq in (2**53, 0, 2**52, 1):
        body = Handle(operator="page-1", position=np.full(3, 5.0), dead_man=True)
        stamped = page.handles._stamp(None).model_copy(update={"seq": seq})
        page.handles._publisher.put(encode(body, stamped), attachment=page.handles._sender)
    for operator in ("\x1b[2J", "<script>", "x" * 64, "\u202e", "page-2"):
        tell(page, 0.3, operator)
    assert not page.motions[-1].body.dead_man
    assert np.abs(page.motions[-1].body.position).max() == 0.0
    tell(page, 0.0, dead_man=False)
    tell(page, 0.0)
    page.until(lambda: page.motions[-1].body.dead_man, "a new press")
    assert page.service.health() == (True, "playing")
    tell(page, 0.1)
    page.until(lambda: len(page.steps) >= 2, "steps")
    assert np.abs(page.motions[-1].body.position).max() <= 0.1
