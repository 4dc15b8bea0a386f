"""What the fixture would have done: as it did with the same beliefs, otherwise with others."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hmcs.bus.messages import FixtureState, Motion, RobotState, Step
from hmcs.fixtures.compliance.factor import FREE_FACTOR
from hmcs.fixtures.controller.rules import Safeguards
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recordings.comparing import compared, fixtures_compared, rows_of
from hmcs.recordings.fixture_replay import FixtureReplay, replay_fixture, safeguards_from
from hmcs.recordings.reading import read
from hmcs.recordings.replaying import Replay, replayed
from support.cells import PERIOD_NS, SETTINGS, Logged, performance, write_cell
from support.lessons import lesson_task
from support.lessons import performed as lesson

Write = Callable[..., Path]
AGAIN_NS = 20_000_000_000


@pytest.fixture(scope="module")
def model() -> Model:
    return learn(lesson_task(), [lesson(seed) for seed in (1, 2, 3)])._replace(hash="lesson")


@pytest.fixture(scope="module")
def said(model: Model) -> list[Logged]:
    """What is said while the task is performed as it was never shown, once through."""
    return list(performance(model, lesson(9)))


@pytest.fixture
def again(tmp_path: Path, model: Model) -> Callable[..., tuple[Replay, FixtureReplay]]:
    """Record what was said, and replay it."""

    def replay(said: list[Logged], **kept: bool) -> tuple[Replay, FixtureReplay]:
        content = read(write_cell(tmp_path, said, **kept))
        made = replayed(content, model)
        return made, replay_fixture(content, made)

    return replay


Again = Callable[..., tuple[Replay, FixtureReplay]]


@pytest.mark.long
def test_with_the_same_beliefs_it_does_what_it_did(said: list[Logged], again: Again) -> None:
    replay, fixture = again(said)
    assert compared(replay).same_bits == len(replay.beliefs) > 60
    assert fixture.notes == ()
    assert fixture.followed == ("lesson",)
    assert len(fixture.ticks) == sum(each.is_of(Motion) for each in said)
    for tick in fixture.ticks:
        assert tick.then is not None
        assert (tick.now.state, tick.now.reason) == (tick.then.state, tick.then.reason)
        assert tick.now.factor == pytest.approx(tick.then.factor, abs=1e-6)
        assert tick.now.off_guide_m == pytest.approx(tick.then.off_guide_m, abs=1e-6)
        np.testing.assert_allclose(tick.now.velocity, tick.then.velocity, atol=1e-6)
    figures = fixtures_compared(fixture)
    assert figures.guides_both > 0.5
    assert figures.factor_close == figures.same_state == 1.0
    assert figures.recorded_takes_hold == figures.replayed_takes_hold > 0
    assert figures.takes_hold_later_ms == 0.0


def test_an_unsure_recognizer_would_have_let_go(
    tmp_path: Path, said: list[Logged], model: Model
) -> None:
    content = read(write_cell(tmp_path, said))
    sure = replayed(content, model)
    from_step = len(sure.beliefs) // 2
    flat = np.full(len(model.state_names), 1.0 / len(model.state_names))
    doubting = sure._replace(
        beliefs=tuple(
            each._replace(replayed=each.replayed.model_copy(update={"probabilities": flat}))
            if each.step >= from_step
            else each
            for each in sure.beliefs
        )
    )
    fixture = replay_fixture(content, doubting)
    doubts_ns = next(each.log_ns for each in doubting.beliefs if each.step == from_step)
    settled = [tick for tick in fixture.ticks if tick.log_ns > doubts_ns + 20 * PERIOD_NS]
    assert {tick.now.factor for tick in settled} == {FREE_FACTOR}
    assert {tick.now.reason for tick in settled} == {"unsure"}
    figures = fixtures_compared(fixture)
    assert figures.guides_replayed_only == 0.0
    assert 0.2 < figures.guides_recorded_only < 0.7
    assert figures.factor_apart > 0.05


def test_beliefs_that_came_later_make_it_stiffen_later(said: list[Logged], again: Again) -> None:
    late_ns = 50_000_000
    waited = [
        each._replace(log_ns=each.log_ns + late_ns) if "belief" in each.key else each
        for each in said
    ]
    _, fixture = again(sorted(waited, key=lambda each: each.log_ns))
    figures = fixtures_compared(fixture)
    assert figures.takes_hold_later_ms == pytest.approx(late_ns / 1e6, abs=PERIOD_NS / 1e6)


def test_without_a_recorded_fixture_it_is_reported_that_there_is_nothing_to_compare_with(
    said: list[Logged], again: Again
) -> None:
    replay, fixture = again([each for each in said if not each.is_of(FixtureState)])
    assert any("no fixture was recorded" in note for note in fixture.notes)
    assert max(tick.now.factor for tick in fixture.ticks) > 0.8
    figures = fixtures_compared(fixture)
    assert figures.compared == 0
    assert math.isnan(figures.factor_apart)
    assert {row["recorded_factor"] for row in rows_of(replay, fixture)} == {""}


def test_without_a_recorded_robot_nobody_knows_how_far_it_was_beside(
    said: list[Logged], again: Again
) -> None:
    _, fixture = again([each for each in said if not each.is_of(RobotState)])
    assert any("no robot was recorded" in note for note in fixture.notes)
    assert {tick.now.off_guide_m for tick in fixture.ticks} == {None}
    assert any(tick.now.guides for tick in fixture.ticks)


@pytest.mark.long
def test_a_new_start_of_the_input_device_is_a_new_hand(
    said: list[Logged], again: Again, model: Model
) -> None:
    begin_ns = said[0].log_ns + AGAIN_NS
    replay, fixture = again([*said, *performance(model, lesson(10), "second", begin_ns)])
    assert any("was started anew" in note for note in replay.notes)
    guiding = {tick.device for tick in fixture.ticks if tick.now.guides}
    assert guiding == {"clock", "second"}
    # Of its own part each is what it was alone.
    assert fixtures_compared(fixture).factor_close > 0.99


def test_a_second_device_beside_the_first_moves_nothing(
    said: list[Logged], again: Again, model: Model
) -> None:
    beside = [
        each._replace(log_ns=each.log_ns + PERIOD_NS // 2)
        for each in performance(model, lesson(10), "second")
        if each.is_of(Motion)
    ]
    _, fixture = again(sorted([*said, *beside], key=lambda each: each.log_ns))
    assert any(
        f"{len(beside)} samples" in note and "second input device" in note for note in fixture.notes
    )
    assert {tick.device for tick in fixture.ticks} == {"clock"}


def test_after_a_gap_the_fixture_stands_until_the_operator_takes_hold_anew(
    said: list[Logged], again: Again
) -> None:
    begin_ns = said[0].log_ns + 1_500_000_000
    gap = range(begin_ns, begin_ns + 1_000_000_000)
    replay, fixture = again([each for each in said if each.log_ns not in gap])
    assert any("100 samples of the operator's device are missing" in n for n in fixture.notes)
    assert any("steps are missing" in note for note in replay.notes)
    assert any(tick.now.engaged for tick in fixture.ticks if tick.log_ns < gap.start)
    assert not any(tick.now.engaged for tick in fixture.ticks if tick.log_ns >= gap.stop)


def test_a_recording_of_steps_alone_has_no_fixture_and_says_so(
    said: list[Logged], again: Again
) -> None:
    replay, fixture = again([each for each in said if each.is_of(Step)])
    assert not fixture.ticks
    assert any("no sample of the operator's device" in note for note in fixture.notes)
    assert fixtures_compared(fixture).ticks == 0
    assert {row["replayed_factor"] for row in rows_of(replay, fixture)} == {""}


def test_safeguards_are_those_the_recorded_fixture_controller_reported(
    said: list[Logged], again: Again
) -> None:
    reported = safeguards_from(SETTINGS.model_dump(mode="json"))
    assert reported == SETTINGS.safeguards != Safeguards()
    assert safeguards_from({"settle_ms": "soon", "input_stale_after_ms": 50}) == Safeguards(
        input_stale_after_s=0.05
    )
    _, fixture = again(said, settings_kept=False)
    assert any("defaults are used" in note for note in fixture.notes)


def test_each_step_tells_the_factor_at_the_sample_that_completed_it(
    said: list[Logged], again: Again
) -> None:
    replay, fixture = again(said)
    at_sample = {
        each.envelope.origin.seq: each.body
        for each in said
        if isinstance(each.body, FixtureState) and each.envelope.origin is not None
    }
    steps = [each for each in said if each.is_of(Step)]
    for row, step in zip(rows_of(replay, fixture), steps, strict=True):
        assert step.envelope.origin is not None
        reported = at_sample[step.envelope.origin.seq]
        assert row["recorded_factor"] == reported.factor
        assert row["replayed_compliance"] == pytest.approx(reported.compliance, abs=1e-6)


@pytest.mark.parametrize(("later_ticks", "later_ms"), [(40, 400.0), (140, math.nan)])
def test_what_a_fixture_does_a_second_later_it_does_for_other_reasons(
    said: list[Logged], again: Again, later_ticks: int, later_ms: float
) -> None:
    """A fixture that takes hold so much later is compared with no earlier one."""
    _, fixture = again(said)
    ticks = list(fixture.ticks)
    free = next(tick.now for tick in ticks if not tick.now.guides)._replace(engaged=True)
    stiff = next(tick.now for tick in ticks if tick.now.guides)._replace(engaged=True)
    begins = len(ticks) // 3
    made = fixture._replace(
        ticks=tuple(
            tick._replace(
                then=stiff if number >= begins else free,
                now=stiff if number >= begins + later_ticks else free,
            )
            for number, tick in enumerate(ticks)
        )
    )
    figures = fixtures_compared(made)
    assert (figures.recorded_takes_hold, figures.replayed_takes_hold) == (1, 1)
    assert figures.takes_hold_later_ms == pytest.approx(later_ms, nan_ok=True)
