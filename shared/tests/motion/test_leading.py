"""A robot led by its tool: force sensor, gravity, admittance."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from hmcs.motion.admittance import Admittance
from hmcs.motion.force_sensing import ForceSensor, Payload, operator_wrench, sensed
from hmcs.motion.hand_guiding import hand_guiding_of
from hmcs.task import load_task

PAYLOAD = Payload(1.5, (0.0, 0.01, 0.05))
UPRIGHT = np.array([0.0, 0.0, 0.0, 1.0])
ADMITTANCE = Admittance()

wrenches = arrays.arrays(np.float64, 6, elements=st.floats(-50, 50))
turns = arrays.arrays(np.float64, 4, elements=st.floats(-1, 1)).filter(
    lambda q: np.linalg.norm(q) > 0.1
)


@given(wrenches, turns)
def test_gravity_is_removed_however_the_tool_is_turned(wrench, turn):
    turn = turn / np.linalg.norm(turn)
    reading = sensed(wrench, PAYLOAD, turn)
    np.testing.assert_allclose(operator_wrench(reading, PAYLOAD, turn), wrench, atol=1e-9)


def test_what_hangs_upright_weighs_its_mass_and_turns_about_its_center():
    weight = PAYLOAD.weight(UPRIGHT)
    np.testing.assert_allclose(weight[:3], [0, 0, -1.5 * 9.81])
    # 1.5 kg, 0.01 m along y: r × F = (y F_z, 0, 0).
    np.testing.assert_allclose(weight[3:], [0.01 * -1.5 * 9.81, 0, 0], atol=1e-12)
    upside_down = PAYLOAD.weight([1.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(upside_down[:3], [0, 0, 1.5 * 9.81], atol=1e-9)


def test_a_force_below_the_threshold_moves_nothing():
    rest = ADMITTANCE.twist(np.array([1.0, 1.0, 1.0, 0.1, 0.1, 0.1]))
    assert not rest.any()


@given(wrenches)
def test_the_robot_goes_where_it_is_pushed_and_sets_out_without_a_kick(wrench):
    twist = ADMITTANCE.twist(wrench)
    assert twist[:3] @ wrench[:3] >= 0
    assert twist[3:] @ wrench[3:] >= 0
    beyond = max(np.linalg.norm(wrench[:3]) - ADMITTANCE.force_threshold_n, 0.0)
    assert np.linalg.norm(twist[:3]) == pytest.approx(ADMITTANCE.m_s_per_n * beyond, abs=1e-12)


@given(wrenches)
def test_an_operator_pushes_as_hard_as_the_arm_needs(twist):
    np.testing.assert_allclose(
        ADMITTANCE.twist(ADMITTANCE.wrench(twist)), twist, rtol=1e-9, atol=1e-9
    )


@pytest.mark.parametrize(
    ("field", "value"), [("force_threshold_n", -1.0), ("m_s_per_n", 0.0), ("m_s_per_n", np.nan)]
)
def test_an_admittance_that_cannot_be_is_refused(field, value):
    with pytest.raises(ValueError, match=field):
        Admittance(**{field: value})


def test_the_sensor_passes_a_steady_force_and_holds_fast_ones_back():
    sensor, period_s = ForceSensor(30.0), 0.001
    steady = np.array([1.0, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(sensor.read(steady, period_s), steady)
    for hz, gain in ((3.0, 1.0), (30.0, 2**-0.5), (300.0, 0.1)):
        times = np.arange(2000) * period_s
        reported = [
            ForceSensor.read(sensor, steady * np.sin(2 * np.pi * hz * t), period_s)[0]
            for t in times
        ]
        assert np.abs(reported[1000:]).max() == pytest.approx(gain, rel=0.25)
    with pytest.raises(ValueError, match="bandwidth_hz"):
        ForceSensor(0.0)


def test_only_a_cooperative_task_has_a_hand_on_its_robot():
    assert hand_guiding_of(load_task("lines-through-obstacles")) is None
    hand = hand_guiding_of(load_task("object-3d"))
    assert hand is not None
    wanted = np.array([0.1, -0.05, 0.0])
    led = [hand.push(wanted, UPRIGHT, 0.01) for _ in range(200)][-1]
    np.testing.assert_allclose(led.twist[:3], wanted, atol=1e-4)
    assert np.linalg.norm(led.wrench[:3]) == pytest.approx(
        2.0 + np.linalg.norm(wanted) / 0.01, rel=0.01
    )


@pytest.mark.parametrize(
    ("velocity", "elapsed_s"),
    [
        ([np.nan, 0.0, 0.0], 0.01),
        ([0.0, np.inf, 0.0], 0.01),
        ([1e308, -1e308, 1e308], 0.01),
        ([0.0, 0.0, 5.1], 0.01),
        ([0.1, 0.0, 0.0], np.nan),
        ([0.1, 0.0, 0.0], -1.0),
    ],
)
def test_a_push_that_is_none_moves_nothing_and_leaves_no_trace(velocity, elapsed_s):
    hand = hand_guiding_of(load_task("object-3d"))
    assert hand is not None
    wanted = np.array([0.1, -0.05, 0.0])
    for _ in range(200):
        hand.push(wanted, UPRIGHT, 0.01)
    led = hand.push(np.array(velocity), UPRIGHT, elapsed_s)
    assert not led.twist.any()
    assert not led.wrench.any()
    np.testing.assert_allclose(hand.push(wanted, UPRIGHT, 0.01).twist[:3], wanted, atol=1e-4)


@given(
    arrays.arrays(np.float64, 3, elements=st.floats(allow_nan=True, allow_infinity=True)),
    st.floats(allow_nan=True, allow_infinity=True),
)
def test_whatever_is_wanted_the_hand_pushes_finitely(velocity, elapsed_s):
    hand = hand_guiding_of(load_task("object-3d"))
    assert hand is not None
    for _ in range(2):
        led = hand.push(velocity, UPRIGHT, elapsed_s)
        assert np.isfinite(led.twist).all()
        assert np.isfinite(led.wrench).all()
