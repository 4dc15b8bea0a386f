from __future__ import annotations

from types import SimpleNamespace as Ros
from typing import Any, cast

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs.motion.admittance import Admittance
from hmcs.task import load_task
from hmcs_ros2_bridge.fields import NonsenseError, header
from hmcs_ros2_bridge.hand import Hand, Switches, moved_by, stick_in, switches_in
from hmcs_ros2_bridge.operator import OperatorOptions, RosOperator, open_source
from hmcs_ros2_bridge.ros import Node, Topic

HELD = Switches(dead_man=True)


class FakeNode:
    """A node whose messages a test gives."""

    def __init__(self) -> None:
        self.handlers: dict[str, Any] = {}

    def subscribe(self, topic: Topic, handler: Any) -> None:
        self.handlers[topic.name] = handler

    def start(self) -> None: ...

    def close(self) -> None: ...


class Bench:
    """An operator on a clock of its own."""

    def __init__(self, **options: Any) -> None:
        self.now_s = 0.0
        self.node = FakeNode()
        self.operator = RosOperator(
            OperatorOptions(**options), Admittance(), cast(Node, self.node), lambda: self.now_s
        )

    def joy(self, *, held: bool, axes: tuple[float, ...] = (0.0,) * 6) -> None:
        self.node.handlers["joy"](Ros(buttons=[0, 0, 0, 0, int(held), 0], axes=list(axes)))

    def told(self, frame: str = "base_link", **parts: Any) -> None:
        stamp = header(round(self.now_s * 1e9), frame)
        told = Ros(header=Ros(stamp=Ros(**stamp["stamp"]), frame_id=frame), **parts)
        self.node.handlers["operator"](told)

    def twist(self, x: float, frame: str = "base_link") -> None:
        still = Ros(x=0.0, y=0.0, z=0.0)
        self.told(frame, twist=Ros(linear=Ros(x=x, y=0.0, z=0.0), angular=still))


def test_a_twist_moves_the_hand_while_the_dead_man_is_held_only() -> None:
    bench = Bench()
    for held, expected in ((False, 0.0), (True, 0.001), (False, 0.001)):
        bench.now_s += 0.01
        bench.joy(held=held)
        bench.twist(0.1)
        sample = bench.operator.sample(1.0)
        assert sample.dead_man == (held and expected > 0)
        assert sample.position[0] == pytest.approx(expected if held else sample.position[0])
    assert bench.operator.sample(1.0).velocity.tolist() == [0.0, 0.0, 0.0]


def test_a_release_between_two_samples_is_a_release() -> None:
    bench = Bench()
    for held in (True, False, True):
        bench.joy(held=held)
    bench.twist(0.1)
    assert not bench.operator.sample(1.0).dead_man
    assert bench.operator.sample(1.0).dead_man


def test_the_age_is_that_of_the_older_topic_by_the_receivers_clock() -> None:
    bench = Bench()
    bench.joy(held=True)
    bench.now_s = 0.2
    bench.twist(0.1)
    bench.now_s = 0.25
    assert bench.operator.sample(1.0).age_s == pytest.approx(0.25)


def test_another_frame_or_nonsense_lets_go_and_says_why() -> None:
    bench = Bench()
    bench.joy(held=True)
    for tell, why in ((lambda: bench.twist(0.1, "camera"), "camera"),
                      (lambda: bench.twist(float("nan")), "finite")):  # fmt: skip
        tell()
        assert not bench.operator.sample(1.0).dead_man
        assert why in bench.operator.trouble
    bench.twist(0.1)
    assert bench.operator.sample(1.0).dead_man
    assert bench.operator.trouble == ""


def test_before_anything_was_heard_it_says_which_topics_it_waits_for() -> None:
    bench = Bench()
    assert not bench.operator.sample(None).dead_man
    assert "joy and operator" in bench.operator.trouble


def test_a_pose_moves_the_hand_by_the_senders_clock() -> None:
    bench = Bench(motion="pose")
    turn = Ros(x=0.0, y=0.0, z=0.0, w=1.0)
    for x, now_s in ((0.0, 0.0), (0.01, 0.1)):
        bench.now_s = now_s
        bench.joy(held=True)
        bench.told(pose=Ros(position=Ros(x=x, y=0.0, z=0.0), orientation=turn))
        sample = bench.operator.sample(1.0)
    assert sample.velocity == pytest.approx([0.1, 0.0, 0.0])
    assert sample.position == pytest.approx([0.01, 0.0, 0.0])


def test_a_push_moves_the_hand_by_the_admittance_and_is_handed_on() -> None:
    bench = Bench(motion="wrench")
    still = Ros(x=0.0, y=0.0, z=0.0)
    bench.joy(held=True)
    bench.told(wrench=Ros(force=Ros(x=12.0, y=0.0, z=0.0), torque=still))
    sample = bench.operator.sample(1.0)
    assert sample.velocity == pytest.approx([0.1, 0.0, 0.0])
    assert sample.wrench is not None
    assert sample.wrench[0] == 12.0


def test_a_stick_moves_the_hand_and_rests_within_its_dead_band() -> None:
    joy = Ros(axes=[1.0, 0.05, 0.0, 0.0, 0.0], buttons=[])
    assert stick_in(joy, (0, 1, None), 0.1).tolist() == [1.0, 0.0, 0.0]
    corner = stick_in(Ros(axes=[1.0, 1.0], buttons=[]), (0, 1, None), 0.1)
    assert np.linalg.norm(corner) == pytest.approx(1.0), "a corner is no faster than an edge"


def test_a_joy_without_the_button_or_axis_is_refused() -> None:
    joy = Ros(axes=[0.0], buttons=[1])
    with pytest.raises(NonsenseError, match="1 buttons, none with the index 4"):
        switches_in(joy, (4, None, None))
    with pytest.raises(NonsenseError, match="1 axes, none with the index 3"):
        stick_in(joy, (3, None, None), 0.1)


def test_the_clutch_holds_the_hand() -> None:
    fast = np.array([0.1, 0, 0, 0, 0, 0])
    clutched = moved_by(Hand(), fast, 0.01, Switches(dead_man=True, clutch=True))
    assert not clutched.position.any()
    assert moved_by(Hand(), fast, 100.0, HELD).position[0] == pytest.approx(0.005)


def test_an_option_that_is_none_is_refused_by_its_name() -> None:
    settings = Ros(options={"dead_man": 3})
    with pytest.raises(UserError, match=r"options\.dead_man"):
        open_source(settings, load_task("human-shapes"))


def test_without_ros_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "rclpy", None)
    with pytest.raises(UserError, match=r"uv pip install 'hmcs-ros2-bridge\[ros\]'"):
        Node("nobody")
