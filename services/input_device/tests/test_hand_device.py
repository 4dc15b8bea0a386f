"""Steps of a hand that moves a device: clutch, wrench, orientation, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from hmcs.bus.messages import Ask, Done, LastSteps, LastStepsQuestion
from hmcs.bus.session import RequestRefusedError
from support.hand_device import Hand, press, seen

MakeDesk = Callable[..., Any]


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


def test_steps_tell_what_was_felt_and_signaled_and_are_reported_again_alike(
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
    reported = desk.ask("last_steps", LastStepsQuestion(count=10), LastSteps).steps
    for step, again in zip(steps, reported, strict=True):
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
