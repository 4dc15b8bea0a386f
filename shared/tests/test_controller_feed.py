"""A controller gets what one device, its recognizers and one robot say, whatever else is said."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hmcs.bus.messages import Belief, Motion, Origin, RobotState, Source, Step
from hmcs.controller_feed import EARLY_KEPT, EARLY_WITHIN, ControllerFeed
from hmcs.driving import TAKEOVER_S
from hmcs.fixtures.controller.controller import Controller
from hmcs.fixtures.controller.interface import Fixture, Guides
from hmcs.fixtures.controller.rules import Rules, Safeguards
from hmcs.motion.paths import Path

PATH = Path(np.array([[0.0, 0, 0], [1.0, 0, 0]]))


def source(boot: str, service: str = "input_device") -> Source:
    return Source(service=service, instance=boot, boot=boot)


class Scene:
    """Devices at 100 Hz at the feed of a controller that follows the recognizer `m`."""

    def __init__(self) -> None:
        controller = Controller(Safeguards())
        controller.load("m", Guides({"g": PATH}, Rules()))
        controller.activate("m")
        self.feed, self.now_s, self.seq, self.step = ControllerFeed(controller), 100.0, 0, 0

    def sample(self, boot: str, pressed: bool, speed: float = 0.1) -> Fixture | None:
        self.now_s += 0.01
        self.seq += 1
        motion = Motion(
            position=np.array([0.001 * self.seq, 0, 0]),
            velocity=np.array([speed, 0, 0]),
            dead_man=pressed,
        )
        return self.feed.on_motion(self.now_s, source(boot), self.seq, motion, None)

    def samples(self, count: int, **pressed: bool) -> Fixture | None:
        made = None
        for _ in range(count):
            for boot, down in pressed.items():
                made = self.sample(boot, down) or made
        return made

    def make_step(self, boot: str, index: int) -> str:
        move = np.array([0.01, 0, 0])
        step = Step(index=index, position=min(index, 999) * move, displacement=move)
        origin = Origin(boot=boot, seq=self.seq, captured_ns=0)
        return self.feed.on_step(self.now_s, source(boot), step, origin)

    def believe(self, step: int, clock: str = "a", name: str = "m", **said: Any) -> str:
        fields: dict[str, Any] = {
            "model_hash": "h", "clock": clock, "step": step, "states": ("s",),
            "probabilities": np.array([1.0]), "likely_gesteme": "g", "segment_start": 0,
        }  # fmt: skip
        return self.feed.on_belief(name, Belief(**(fields | said)))

    def guide(self, count: int) -> Fixture | None:
        """Move `a` on, each sample a step with its belief."""
        made = None
        for _ in range(count):
            made = self.sample("a", True)
            self.make_step("a", self.step)
            self.believe(self.step)
            self.step += 1
        return made


def test_a_deliberate_press_of_an_idle_devices_neighbor_drives_at_once() -> None:
    scene = Scene()
    scene.samples(80, a=False, b=False)
    made = scene.samples(2, a=False, b=True)
    assert made is not None
    assert made.engaged
    assert scene.feed.clock == "b"


def test_a_device_that_takes_over_from_a_silent_one_drives_only_after_letting_go() -> None:
    scene = Scene()
    scene.samples(10, a=False)
    scene.samples(10, a=True)
    made = scene.samples(round(TAKEOVER_S * 100) + 20, b=True)
    assert made is not None
    assert not made.engaged
    scene.samples(40, b=False)
    assert scene.samples(2, b=True).engaged


def test_steps_of_another_device_than_the_one_that_drives_are_no_steps() -> None:
    scene = Scene()
    scene.samples(10, a=True)
    assert scene.make_step("a", 0) == "taken"
    assert scene.make_step("b", 0) == "second"
    assert scene.believe(0, clock="b") == "other_clock"


def test_a_sample_of_another_device_than_the_one_that_drives_moves_nothing() -> None:
    scene = Scene()
    scene.samples(10, a=False)
    assert scene.samples(10, a=True).engaged
    assert scene.sample("b", True) is None
    assert scene.sample("b", False) is None


def test_steps_count_though_no_sample_was_heard_yet() -> None:
    scene = Scene()
    assert scene.make_step("a", 0) == "taken"
    assert scene.believe(0) == "taken"


def test_the_steps_of_a_new_device_begin_anew() -> None:
    scene = Scene()
    scene.samples(10, a=False)
    scene.make_step("a", 7)
    scene.samples(60, b=False)
    assert scene.make_step("b", 0) == "taken"
    assert scene.believe(7) == "other_clock"
    assert scene.believe(0, clock="b") == "taken"


def test_beliefs_of_a_new_device_wait_for_its_own_steps() -> None:
    scene = Scene()
    scene.samples(10, a=False)
    for index in range(8):
        scene.make_step("a", index)
    assert scene.believe(8) == "early"
    scene.samples(60, b=False)
    assert scene.believe(0, clock="b") == "early"
    scene.make_step("b", 0)
    assert scene.believe(3, clock="b") == "early"


def test_a_belief_that_overtook_a_step_of_the_device_before_is_forgotten() -> None:
    scene = Scene()
    scene.samples(10, a=False)
    scene.make_step("a", 7)
    assert scene.believe(8) == "early"
    scene.samples(60, b=False)
    scene.make_step("b", 8)
    assert "m" not in scene.feed.controller._recognizers.beliefs


def test_a_step_that_comes_again_is_old() -> None:
    scene = Scene()
    scene.samples(10, a=False)
    assert [scene.make_step("a", index) for index in (0, 1, 1)] == ["taken", "taken", "old"]


def test_a_step_names_the_sample_that_completed_it() -> None:
    scene = Scene()
    scene.samples(10, a=False)
    taken: list[tuple[Any, ...]] = []
    scene.feed.controller.on_step = lambda *step: taken.append(step)  # type: ignore[method-assign]
    scene.make_step("a", 0)
    assert taken[0][-1] == scene.seq


def test_of_recognizers_that_overtake_their_step_the_last_ones_are_kept() -> None:
    scene = Scene()
    scene.samples(10, a=False)
    scene.guide(5)
    names = [f"r{k}" for k in range(EARLY_KEPT + 3)]
    for name in names:
        scene.feed.load(name, Guides({"g": PATH}, Rules()))
        assert scene.believe(scene.step, name=name) == "early"
    scene.make_step("a", scene.step)
    believed = scene.feed.controller._recognizers.beliefs.keys() - {"m"}
    assert believed == set(names[3:])


def test_a_belief_that_overtook_its_step_counts_once_the_step_is_there() -> None:
    scene = Scene()
    scene.samples(10, a=False)
    scene.guide(40)
    assert scene.believe(scene.step) == "early"
    scene.make_step("a", scene.step)
    assert scene.believe(scene.step) == "old"


def test_a_belief_that_overtook_its_step_goes_with_its_recognizer() -> None:
    scene = Scene()
    scene.samples(10, a=False)
    scene.guide(40)
    scene.feed.load("other", Guides({"g": PATH}, Rules()))
    assert scene.believe(scene.step, name="other") == "early"
    scene.feed.unload("other")
    assert scene.make_step("a", scene.step) == "taken"
    assert "other" not in scene.feed.controller._recognizers.beliefs


def test_a_belief_that_overtook_its_step_is_none_of_the_model_loaded_in_between() -> None:
    scene = Scene()
    scene.samples(10, a=False)
    scene.guide(40)
    assert scene.believe(scene.step) == "early"
    scene.feed.load("m", Guides({"g": PATH}, Rules()))
    scene.make_step("a", scene.step)
    assert "m" not in scene.feed.controller._recognizers.beliefs


def test_the_active_recognizer_is_not_unloaded_nor_its_early_belief_lost() -> None:
    scene = Scene()
    scene.samples(10, a=False)
    scene.guide(40)
    assert scene.believe(scene.step) == "early"
    scene.feed.unload("m")
    scene.make_step("a", scene.step)
    assert scene.feed.controller._recognizers.beliefs["m"].step == scene.step


@given(st.integers(0, 2**53))
def test_one_forged_belief_keeps_no_later_one_out(step: int) -> None:
    scene = Scene()
    scene.samples(10, a=False)
    scene.guide(5)
    scene.believe(step, states=("elsewhere",))
    scene.make_step("a", scene.step)
    scene.step += 1
    scene.guide(3)
    assert scene.believe(scene.step - 1) == "old"
    assert scene.feed.controller._recognizers.beliefs["m"].state == "s"


@given(st.integers(0, 2**53))
def test_one_forged_step_keeps_no_later_one_out_nor_its_belief(index: int) -> None:
    scene = Scene()
    scene.samples(10, a=False)
    scene.guide(5)
    scene.make_step("a", index)
    verdicts = [scene.make_step("a", 5 + k) for k in range(20)]
    assert verdicts.count("old") <= (5 <= index < 25)
    assert scene.believe(24) == "taken"


def test_a_belief_far_ahead_of_all_steps_is_no_belief() -> None:
    scene = Scene()
    scene.samples(10, a=False)
    scene.guide(3)
    assert scene.believe(3 + EARLY_WITHIN) == "old"
    # A recognizer may be ahead by what is under way.
    assert scene.believe(3 + 30) == "early"


# --- robots ---------------------------------------------------------------------------------------


def robot_at(x: float) -> RobotState:
    return RobotState(
        robot="puma560", joint_positions=np.zeros(6), joint_velocities=np.zeros(6),
        tool_position=np.array([x, 0, 0]), tool_orientation=np.array([0, 0, 0, 1.0]),
        tool_twist=np.zeros(6), reference_twist=np.zeros(6), nearest_obstacle="",
        nearest_distance_m=None, contacts=(), stop="none", limited=(),
    )  # fmt: skip


def test_the_pose_is_that_of_one_robot() -> None:
    scene = Scene()
    present = {"A", "B"}
    assert scene.feed.on_robot(1.0, source("A", "robot"), robot_at(0.1), present) == "taken"
    assert scene.feed.on_robot(1.0, source("B", "robot"), robot_at(0.9), present) == "second"
    position = scene.feed.controller._robot.pose(1.0).position
    assert position is not None
    assert position[0] == 0.1


def test_the_first_robot_begins_nothing_anew() -> None:
    scene = Scene()
    begun: list[None] = []
    scene.feed.controller.begin_robot = lambda: begun.append(None)  # type: ignore[method-assign]
    scene.feed.on_robot(1.0, source("A", "robot"), robot_at(0.1), {"A"})
    assert not begun
    scene.feed.on_robot(1.1, source("B", "robot"), robot_at(0.1), {"B"})
    assert len(begun) == 1


def test_another_robot_that_takes_over_has_no_past() -> None:
    scene = Scene()
    scene.samples(10, a=False)
    scene.feed.on_robot(scene.now_s, source("A", "robot"), robot_at(0.1), {"A"})
    scene.guide(10)
    scene.feed.on_robot(scene.now_s, source("B", "robot"), robot_at(0.9), {"B"})
    assert scene.feed.controller._robot.at_step(5) is None
    made = scene.sample("a", True)
    assert made is not None
    assert made.guide_origin is None
