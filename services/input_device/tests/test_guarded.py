"""What every source goes through, with a source of another distribution that does what it likes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.bus.messages import Motion
from hmcs_input_device.guarded import FROZEN_S, JUMP_M, Guarded
from hmcs_input_device.press_gate import HANG_S, SILENT_S
from hmcs_input_device.sources import FARTHEST_M, FASTEST_M_S, LIVE, DeviceSample

PERIOD_S = 0.01
ZERO = np.zeros(3)


class Arm:
    """A device whose samples a test sets."""

    rate_hz, duration_s, reach_m = 100.0, LIVE, None

    def __init__(self, plays: bool = False) -> None:
        self.plays = plays
        self.trouble = ""
        self.says: Callable[[], Any] = lambda: DeviceSample(ZERO, ZERO, dead_man=False)

    def sample(self, elapsed_s: float | None) -> DeviceSample | None:
        reported: DeviceSample | None = self.says()
        return reported

    def close(self) -> None:
        pass


class Desk:
    """A guarded device asked a hundred times a second."""

    def __init__(self, plays: bool = False) -> None:
        self.arm, self.now_s = Arm(plays), 5.0
        self.guarded = Guarded(self.arm, "arm")

    def tell(self, x_m: float = 0.0, times: int = 1, **fields: Any) -> DeviceSample:
        reported = DeviceSample(np.array([x_m, 0.0, 0.0]), ZERO, dead_man=True)._replace(**fields)
        self.arm.says = lambda: reported
        return self.ask(times)

    def ask(self, times: int = 1) -> DeviceSample:
        for _ in range(times):
            self.now_s += PERIOD_S
            sample = self.guarded.sample(self.now_s, self.now_s)
        assert sample is not None
        return sample

    def hold(self, x_m: float = 0.0) -> None:
        """Let go and press."""
        assert not self.tell(x_m, dead_man=False).dead_man
        assert self.tell(x_m).dead_man
        assert self.guarded.trouble == ""

    def assert_needs_a_new_press(self, x_m: float = 0.0) -> None:
        assert not self.tell(x_m, times=100).dead_man
        assert "let go of it and press it anew" in self.guarded.trouble
        self.hold(x_m)


def test_what_a_device_tells_is_handed_on_as_it_is() -> None:
    desk = Desk()
    desk.hold()
    reported = desk.tell(
        0.01,
        velocity=np.array([0.1, 0, 0]),
        orientation=np.array([0, 0, 0, 1.0]),
        angular_velocity=np.ones(3),
        wrench=np.ones(6),
        clutch=True,
        pedal=True,
        age_s=0.1,
    )
    for name, value in desk.arm.says()._asdict().items():
        np.testing.assert_array_equal(getattr(reported, name), value)


def test_a_device_may_reuse_its_arrays() -> None:
    desk = Desk()
    desk.hold()
    at, velocity = np.zeros(3), np.array([0.1, 0.0, 0.0])
    desk.arm.says = lambda: DeviceSample(at, velocity, dead_man=True)
    for _ in range(round(2 * FROZEN_S / PERIOD_S)):
        at += velocity * PERIOD_S
        assert desk.ask().dead_man
    here = at.copy()
    desk.arm.says = nothing
    at += 1.0
    np.testing.assert_array_equal(desk.ask().position, here)


def test_a_dead_man_that_is_held_from_the_first_sample_on_moves_nothing() -> None:
    desk = Desk()
    still = desk.tell(velocity=np.ones(3), angular_velocity=np.ones(3), times=3)
    assert not still.dead_man
    assert not np.any(still.velocity)
    assert not np.any(still.angular_velocity)
    desk.assert_needs_a_new_press()


def nothing() -> None:
    return None


def fails() -> None:
    raise OSError("no such device")


BAD: dict[str, tuple[Callable[[], Any], str]] = {
    "nothing": (nothing, "gives no samples"),
    "exception": (fails, "failed with OSError (no such device)"),
    "no sample": (lambda: 3, "failed with AttributeError"),
    **{
        name: (
            lambda fields=fields: DeviceSample(ZERO, ZERO, dead_man=True)._replace(**fields),
            said,
        )
        for name, fields, said in (
            ("nan position", {"position": np.full(3, np.nan)}, "malformed samples: position"),
            ("huge position", {"position": np.full(3, 1e308)}, "malformed samples: position"),
            ("far position", {"position": np.full(3, 1.01 * FARTHEST_M)}, "farther than 10000 m"),
            ("flat position", {"position": np.zeros(2)}, "malformed samples: position"),
            ("no position", {"position": None}, "malformed samples: position"),
            ("infinite velocity", {"velocity": np.full(3, np.inf)}, "malformed samples: velocity"),
            ("fast", {"velocity": np.full(3, FASTEST_M_S)}, "moves with more than 5 m/s"),
            ("no rotation", {"orientation": np.zeros(4)}, "malformed samples: orientation"),
            ("spinning", {"angular_velocity": np.full(3, 100.0)}, "turns with more than 50 rad/s"),
            ("strong", {"wrench": np.full(6, 1e5)}, "pushes with more than 10000 N"),
            ("nan wrench", {"wrench": np.full(6, np.nan)}, "malformed samples: wrench"),
            ("a number for a switch", {"dead_man": 1}, "malformed samples: dead_man"),
            ("old", {"age_s": SILENT_S + 0.01}, "is silent"),
            ("from the future", {"age_s": -1.0}, "is silent"),
            ("of no age", {"age_s": float("nan")}, "is silent"),
            ("age that is none", {"age_s": "young"}, "failed with TypeError"),
        )
    },
}


@pytest.mark.parametrize("bad", sorted(BAD))
def test_what_is_no_sample_of_a_hand_lets_the_hand_rest_and_needs_a_new_press(bad: str) -> None:
    says, said = BAD[bad]
    desk = Desk()
    desk.hold()
    here = desk.tell(0.02, velocity=np.array([0.1, 0, 0]), pedal=True)
    desk.arm.says = says
    for still in (desk.ask(), desk.ask(100)):
        np.testing.assert_array_equal(still.position, here.position)
        assert not np.any(still.velocity)
        assert (still.dead_man, still.clutch, still.pedal) == (False, False, False)
        assert said in desk.guarded.trouble
        assert desk.guarded.trouble.startswith("arm: ")
    silent = bad in ("nothing", "old", "from the future", "of no age")
    assert bool(desk.guarded.refusal) is not silent
    desk.assert_needs_a_new_press()


def test_before_a_device_said_anything_there_is_no_hand() -> None:
    desk = Desk()
    desk.arm.says = nothing
    assert desk.guarded.sample(1.0, 0.0) is None
    assert "gives no samples" in desk.guarded.trouble


def test_a_device_that_says_it_is_in_trouble_moves_nothing_until_it_is_pressed_anew() -> None:
    desk = Desk()
    desk.hold()
    desk.arm.trouble = "arm is not calibrated: do it"
    assert not desk.tell().dead_man
    assert desk.guarded.trouble == "arm is not calibrated: do it"
    desk.arm.trouble = ""
    desk.assert_needs_a_new_press()


def test_a_hand_that_jumps_rests_and_needs_a_new_press() -> None:
    desk = Desk()
    desk.hold()
    assert desk.tell(JUMP_M + 0.9 * FASTEST_M_S * PERIOD_S).dead_man
    at = JUMP_M + 0.9 * FASTEST_M_S * PERIOD_S
    far = desk.tell(at + JUMP_M + 1.1 * FASTEST_M_S * PERIOD_S)
    assert not far.dead_man
    np.testing.assert_allclose(far.position[0], at)
    assert "arm: jumped by 0.105 m" in desk.guarded.trouble
    desk.assert_needs_a_new_press(0.5)


@pytest.mark.parametrize("fields", [{"clutch": True}, {"dead_man": False}])
def test_a_hand_that_is_let_go_of_or_clutched_may_be_anywhere(fields: dict[str, bool]) -> None:
    desk = Desk()
    desk.hold()
    for x_m in (3.0, -3.0):
        desk.tell(x_m, **fields)
        assert desk.guarded.trouble == ""
    assert desk.tell(-3.0).dead_man


@pytest.mark.parametrize(
    ("fields", "frozen"),
    [
        ({"velocity": np.array([0.1, 0, 0])}, True),
        ({"wrench": np.array([0, 0, 5.0, 0, 0, 0])}, True),
        ({"wrench": np.array([0, 0, 0.1, 0, 0, 0])}, False),
        ({"velocity": np.array([1e-5, 0, 0])}, False),
        ({}, False),
    ],
)
def test_a_motion_or_force_that_stays_the_very_same_is_that_of_no_hand(
    fields: dict[str, Any], frozen: bool
) -> None:
    desk = Desk()
    desk.hold()
    assert desk.tell(**fields, times=round(0.9 * FROZEN_S / PERIOD_S)).dead_man
    assert desk.tell(**fields, times=round(0.3 * FROZEN_S / PERIOD_S)).dead_man is not frozen
    if frozen:
        assert "repeats the very same motion" in desk.guarded.trouble
        assert not desk.tell(**fields, times=100).dead_man
        desk.assert_needs_a_new_press()


def test_after_a_hang_of_the_process_the_dead_man_has_to_be_pressed_anew() -> None:
    desk = Desk()
    desk.hold()
    desk.now_s += HANG_S
    assert not desk.tell().dead_man
    desk.tell(times=100)
    desk.assert_needs_a_new_press()


def test_nothing_moves_before_it_is_to_play_and_what_was_held_before_counts_not() -> None:
    desk = Desk()
    desk.hold()
    waiting = desk.guarded.sample(desk.now_s + PERIOD_S, None)
    assert waiting is not None
    assert not waiting.dead_man
    assert desk.guarded.trouble == ""
    desk.assert_needs_a_new_press()


def test_of_a_source_that_plays_only_what_is_no_sample_is_refused() -> None:
    desk = Desk(plays=True)
    desk.hold()
    desk.now_s += 10.0
    fast = {"velocity": np.full(3, 2 * FASTEST_M_S)}
    assert desk.tell(5.0, **fast, times=200).dead_man
    assert not desk.tell(float("nan")).dead_man
    assert "malformed samples" in desk.guarded.refusal
    assert not desk.tell(5.0).dead_man
    desk.hold(5.0)


_NUMBER = st.floats(allow_nan=True, allow_infinity=True) | st.floats(-1, 1) | st.just(1e308)
_VECTOR = st.lists(_NUMBER, min_size=2, max_size=4).map(np.array)
_SAMPLE = st.builds(
    DeviceSample,
    _VECTOR,
    _VECTOR | st.just(ZERO),
    st.booleans(),
    clutch=st.booleans(),
    wrench=st.none() | st.lists(_NUMBER, min_size=6, max_size=6).map(np.array),
    age_s=st.none() | _NUMBER,
)


@given(st.booleans(), st.lists(st.tuples(st.none() | _SAMPLE, st.floats(0, 0.2)), max_size=30))
def test_whatever_a_device_says_there_is_a_sample_that_can_be_sent(
    plays: bool, ticks: list[tuple[DeviceSample | None, float]]
) -> None:
    desk = Desk(plays)
    desk.hold()
    for reported, period_s in ticks:
        desk.arm.says = lambda reported=reported: reported
        desk.now_s += period_s
        sample = desk.guarded.sample(desk.now_s, desk.now_s)
        assert sample is not None
        Motion(**sample._asdict())
        assert np.abs(sample.position).max() <= FARTHEST_M
        if not plays:
            assert np.linalg.norm(sample.velocity) <= FASTEST_M_S
        assert sample.dead_man or not np.any(sample.velocity)
        assert (reported is None or reported.dead_man) or not sample.dead_man
