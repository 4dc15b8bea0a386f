"""The operator who reacts: pure, the time is passed in."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import DeadZone, Step, steps_of
from hmcs_input_device.playback import Passes, Playback
from hmcs_input_device.reaction import HANG_S, RELEASED_S, Reaction, ReEngaging
from hmcs_input_device.sources import DeviceSample

RATE_HZ = 100
REACTION_S = 0.2
LEAD_IN_S = 0.5
TIME_S = np.arange(0, 2.0001, 0.01)
CURVE = Demonstration(
    "curve",
    TIME_S,
    0.1 * np.stack([np.sin(3 * TIME_S), np.cos(2 * TIME_S), TIME_S], axis=1),
    (None,) * len(TIME_S),
)
DEAD_ZONE_M = 0.01


class Robot:
    """Follows while the dead-man is held, but after a stop only once it was released."""

    def __init__(self, stops_at_s: set[float]) -> None:
        self.stops_at_s = stops_at_s
        self.follows = False
        self.armed = True

    def sees(self, now_s: float, *, dead_man: bool) -> None:
        if now_s in self.stops_at_s:
            self.follows = self.armed = False
        elif not dead_man:
            self.follows, self.armed = False, True
        else:
            self.follows = self.follows or self.armed


class Run(NamedTuple):
    time_s: np.ndarray
    samples: list[DeviceSample]
    steps: list[Step]
    re_engagements: int

    @property
    def held(self) -> np.ndarray:
        return np.array([sample.dead_man for sample in self.samples])


def play(
    stops_at_s: set[float],
    *,
    repeat: int = 1,
    reported: Callable[[float], bool] = lambda _: True,
    hung_s: tuple[float, float] = (-1.0, -1.0),
    fixture: bool = False,
) -> Run:
    """What the service makes of the playback while a robot, or its fixture, stops now and then."""
    reaction = Reaction(REACTION_S)
    source = ReEngaging(Playback(CURVE, Passes(lead_in_s=LEAD_IN_S, repeat=repeat)), reaction)
    robot, zone = Robot(stops_at_s), DeadZone(DEAD_ZONE_M)
    times, samples, steps = [], [], []
    tick = 0
    while (now_s := tick / RATE_HZ) < source.duration_s + 1.0:
        tick += 1
        if hung_s[0] < now_s < hung_s[1]:
            robot.sees(now_s, dead_man=True)
            continue
        sample = source.sample(now_s)
        times.append(now_s)
        samples.append(sample)
        if not sample.dead_man:
            zone.lift()
        elif (step := zone.push(sample.position)) is not None:
            steps.append(step)
        robot.sees(now_s, dead_man=sample.dead_man)
        if reported(now_s):
            reaction.robot_told(now_s, follows=fixture or robot.follows)
            reaction.fixture_told(engaged=robot.follows or not fixture)
        assert tick < 10_000, "the recording came to no end"
    return Run(np.array(times), samples, steps, reaction.count)


def assert_whole(run: Run, passes: int = 1) -> None:
    """Every sample of the recording was played, in its order, and every step of it made."""
    moving = np.array([s.position for s in run.samples if s.dead_man])
    jumps = np.linalg.norm(np.diff(moving, axis=0), axis=1)
    recorded = np.linalg.norm(np.diff(CURVE.positions, axis=0), axis=1)
    if passes == 1:
        assert jumps.max() <= recorded.max() + 1e-9
        assert jumps.sum() == pytest.approx(recorded.sum())
        expected = steps_of(CURVE.positions, DEAD_ZONE_M)
        assert len(run.steps) == len(expected)
        for step, same in zip(run.steps, expected, strict=True):
            np.testing.assert_allclose(step.position, same.position, atol=1e-9)
            np.testing.assert_allclose(step.displacement, same.displacement, atol=1e-9)
    assert [step.index for step in run.steps] == list(range(len(run.steps)))


def releases(run: Run) -> list[tuple[float, float]]:
    """When the dead-man was let go between motions, and for how long."""
    edges = np.diff(run.held.astype(int))
    let_go, pressed = np.flatnonzero(edges < 0) + 1, np.flatnonzero(edges > 0) + 1
    return [
        (float(run.time_s[a]), float(run.time_s[b] - run.time_s[a]))
        for a, b in zip(let_go, pressed[1:], strict=False)
    ]


def test_nothing_happens_while_the_robot_follows() -> None:
    run = play(set())
    assert run.re_engagements == 0
    plain = Playback(CURVE, Passes(lead_in_s=LEAD_IN_S))
    for now_s, sample in zip(run.time_s, run.samples, strict=True):
        expected = plain.sample(now_s)
        assert sample.dead_man == expected.dead_man
        np.testing.assert_array_equal(sample.position, expected.position)
        np.testing.assert_array_equal(sample.velocity, expected.velocity)


@pytest.mark.parametrize("fixture", [False, True])
def test_lets_go_after_the_reaction_time_waits_and_presses_again(fixture: bool) -> None:
    run = play({1.3}, fixture=fixture)
    assert run.re_engagements == 1
    ((let_go_s, for_s),) = releases(run)
    assert let_go_s == pytest.approx(1.3 + REACTION_S, abs=0.03)
    assert for_s == pytest.approx(RELEASED_S, abs=0.02)
    assert_whole(run)


@pytest.mark.long
@given(st.sets(st.integers(55, 245), max_size=4))
def test_no_motion_is_lost_and_nothing_jumps_whenever_the_robot_stops(ticks: set[int]) -> None:
    run = play({tick / RATE_HZ for tick in ticks})
    assert_whole(run)
    assert run.re_engagements <= len(ticks)


def test_while_released_the_hand_rests_where_it_last_was() -> None:
    run = play({1.3})
    held = np.flatnonzero(run.held)
    paused = [k for k in range(held[0], held[-1]) if not run.held[k]]
    for k in paused:
        np.testing.assert_array_equal(run.samples[k].position, run.samples[paused[0] - 1].position)
        np.testing.assert_array_equal(run.samples[k].velocity, 0)
    np.testing.assert_array_equal(
        run.samples[paused[-1] + 1].position, run.samples[paused[0] - 1].position
    )


def test_tries_again_until_the_robot_follows() -> None:
    # It stands whatever the hand does from 1.3 s to 3.0 s.
    run = play({tick / RATE_HZ for tick in range(130, 300)})
    assert run.re_engagements == 3
    assert len(releases(run)) == 3
    assert_whole(run)


@pytest.mark.parametrize(
    "stands",
    [range(160), range(1000), range(0, 40), range(252, 1000)],
    ids=["has not followed yet", "never follows", "rests before", "rests behind"],
)
def test_robot_that_has_not_followed_yet_or_may_rest_is_left_alone(stands: range) -> None:
    run = play({tick / RATE_HZ for tick in stands})
    assert run.re_engagements == 0
    assert run.time_s[-1] == pytest.approx(LEAD_IN_S + 2.0 + 1.0, abs=0.02)


def test_robot_must_have_followed_in_this_pass() -> None:
    # Followed in the first pass; stands from its end to the end of the second one.
    run = play({tick / RATE_HZ for tick in range(252, 600)}, repeat=2)
    assert run.re_engagements == 0


@pytest.mark.parametrize(("heard_until_s", "lets_go"), [(1.5, False), (9.0, True)])
def test_robot_that_is_not_heard_of_is_not_waited_for(heard_until_s: float, lets_go: bool) -> None:
    reaction = Reaction(reaction_s=1.0)
    reported = []
    for now_s in np.arange(0.0, 3.0, 0.01).tolist():
        if now_s < heard_until_s:
            reaction.robot_told(now_s, follows=now_s < 1.0)
        reported.append(reaction.lets_go(now_s, pressing=True))
    assert any(reported) is lets_go


def test_hang_of_its_own_is_waited_out_and_answered_like_any_stop() -> None:
    run = play({1.41}, hung_s=(1.3, 1.6))
    assert run.re_engagements == 1
    ((let_go_s, _),) = releases(run)
    assert let_go_s == pytest.approx(1.6 + REACTION_S, abs=0.04)
    assert_whole(run)


def test_short_delay_is_no_hang() -> None:
    delay_s = HANG_S / 2
    run = play(set(), hung_s=(1.3, 1.3 + delay_s))
    assert run.samples[-1].dead_man is False
    assert run.time_s[np.flatnonzero(run.held)[-1]] == pytest.approx(LEAD_IN_S + 2.0, abs=0.011)


def test_every_pass_is_played_whole() -> None:
    once = play(set(), repeat=3)
    run = play({1.3, 3.7}, repeat=3)
    assert run.re_engagements == 2
    assert len(run.steps) == pytest.approx(len(once.steps), abs=1)
    assert_whole(run, passes=3)
    assert run.held.sum() == pytest.approx(once.held.sum(), abs=4)


def test_asked_to_play_again_it_begins_anew() -> None:
    source = ReEngaging(
        Playback(CURVE, Passes(lead_in_s=LEAD_IN_S)), reaction := Reaction(REACTION_S)
    )
    robot = Robot({1.3})
    for tick in range(170):
        sample = source.sample(tick / RATE_HZ)
        robot.sees(tick / RATE_HZ, dead_man=sample.dead_man)
        reaction.robot_told(tick / RATE_HZ, follows=robot.follows)
    assert reaction.released
    plain = Playback(CURVE, Passes(lead_in_s=LEAD_IN_S))
    assert source.duration_s > plain.duration_s
    for tick in range(160):
        sample, expected = source.sample(tick / RATE_HZ), plain.sample(tick / RATE_HZ)
        assert sample.dead_man == expected.dead_man
        np.testing.assert_array_equal(sample.position, expected.position)
    assert source.duration_s == plain.duration_s
    assert source.sample(None).dead_man is False
