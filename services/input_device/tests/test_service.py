"""The service over a real router, pumped by the test itself: what it publishes and answers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hmcs.bus.messages import Ask, Done, LastSteps, LastStepsQuestion
from hmcs.bus.service import run
from hmcs.bus.session import RequestRefusedError, StoppedError
from hmcs.motion.demonstrations import Demonstration, write_csv
from hmcs.motion.steps import steps_of
from hmcs_input_device.service import InputDevice

MakeDesk = Callable[..., Any]


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


def test_the_last_steps_are_reported_again_with_their_origins(play: MakeDesk) -> None:
    desk = play()
    desk.until_finished()
    clock = desk.bus.source.boot
    reported = desk.ask("last_steps", LastStepsQuestion(count=10_000), LastSteps)
    assert reported.clock == clock
    assert [step.index for step in reported.steps] == [r.body.index for r in desk.steps]
    assert list(reported.origins) == [r.envelope.origin for r in desk.steps]
    for question, indices in (
        (LastStepsQuestion(count=3), slice(-3, None)),
        (LastStepsQuestion(count=2, before=5), slice(3, 5)),
        (LastStepsQuestion(count=10, before=2), slice(0, 2)),
        (LastStepsQuestion(count=10, before=0), slice(0, 0)),
        (LastStepsQuestion(count=2, before=10**6), slice(-2, None)),
    ):
        reported = desk.ask("last_steps", question, LastSteps)
        expected = list(range(len(desk.steps)))[indices]
        assert [step.index for step in reported.steps] == expected


@pytest.mark.long
def test_it_rests_until_it_is_asked_to_play_and_plays_as_often_as_asked(play: MakeDesk) -> None:
    desk = play(autoplay=False)
    desk.until(lambda: len(desk.motions) > 20, "samples at rest")
    assert not any(received.body.dead_man for received in desk.motions)
    assert desk.service.health() == (True, "waiting for a request to play")
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


def test_it_waits_for_those_it_is_asked_to_wait_for(play: MakeDesk) -> None:
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
            "choose of: gamepad, keyboard, mouse, page, recorded, recording, ros2, simulated, "
            "spacemouse, synthetic",
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


def test_a_process_that_is_to_end_with_what_it_plays_ends_once_the_hand_was_seen_to_let_go(
    play: MakeDesk,
) -> None:
    desk = play(exit_when_played=True)
    with pytest.raises(StoppedError):
        desk.until(lambda: False, "its end")
    held = [received.body.dead_man for received in desk.motions]
    assert any(held)
    assert not any(held[-20:])
