from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose

from hmcs_console.operating.handles import (
    PEDAL_S,
    SETTLE_S,
    Alive,
    Clutched,
    Event,
    Gone,
    Grabbed,
    LetGo,
    Moved,
    Operating,
    Pedaled,
    Stopped,
    TookOver,
    after,
    waited,
)

HERE, THERE = np.array([0.1, 0.2, 0.3]), np.array([0.4, 0.2, 0.3])
LATER_S = 10.0 + 2 * SETTLE_S


def doing(*events: Event) -> Operating:
    operating = Operating("desk")
    for event in events:
        operating = after(operating, event).operating
    return operating


def test_a_grabbed_handle_is_reported_as_released_where_it_is_and_then_as_held() -> None:
    outcome = after(Operating("desk"), Grabbed(3, 10.0, HERE))
    (reported,) = outcome.handles
    assert (reported.operator, reported.dead_man) == ("desk-page-3", False)
    assert_allclose(reported.position, HERE)
    assert outcome.operating.handle(10.0) is None
    held = outcome.operating.handle(LATER_S)
    assert held is not None
    assert held.dead_man


def test_a_moved_handle_is_reported_where_it_is() -> None:
    held = doing(Grabbed(3, 10.0, HERE), Moved(3, 10.1, THERE)).handle(LATER_S)
    assert held is not None
    assert_allclose(held.position, THERE)


def test_what_other_pages_drag_moves_nothing_and_they_show_who_operates() -> None:
    operating = doing(Grabbed(3, 10.0, HERE))
    outcome = after(operating, Grabbed(4, 10.1, THERE))
    assert outcome.operating == operating
    assert not outcome.handles
    assert outcome.notices == (
        (4, "another page operates: this handle moves nothing until it lets go"),
    )
    assert after(operating, Moved(4, 10.1, THERE)).operating == operating
    assert after(operating, LetGo(4)).operating.operator == "desk-page-3"


def test_who_lets_go_or_goes_away_has_released_the_handle_at_once() -> None:
    for event in (LetGo(3), Gone(3)):
        outcome = after(doing(Grabbed(3, 10.0, HERE)), event)
        (reported,) = outcome.handles
        assert (reported.operator, reported.dead_man) == ("desk-page-3", False)
        assert outcome.operating.handle(LATER_S) is None
        assert after(outcome.operating, event).handles == ()


def test_a_silent_page_has_released_the_handle_and_has_to_grab_it_anew() -> None:
    operating = doing(Grabbed(3, 10.0, HERE), Alive(3, 10.2))
    assert waited(operating, 10.4, lease_s=0.25).handles == ()
    outcome = waited(operating, 10.5, lease_s=0.25)
    assert [reported.dead_man for reported in outcome.handles] == [False]
    assert outcome.notices[0][0] == 3
    assert after(outcome.operating, Moved(3, 10.6, THERE)).operating.operator == ""


def test_a_page_that_takes_over_releases_the_other_and_has_to_grab_the_handle_itself() -> None:
    outcome = after(doing(Grabbed(3, 10.0, HERE)), TookOver(4))
    assert [handle.dead_man for handle in outcome.handles] == [False]
    assert outcome.operating.handle(LATER_S) is None
    ((client, notice),) = outcome.notices
    assert (client, "took over" in notice) == (3, True)
    grabbed = after(outcome.operating, Grabbed(4, 11.0, HERE)).operating
    assert grabbed.operator == "desk-page-4"


def test_who_operates_takes_nothing_over_from_itself() -> None:
    operating = doing(Grabbed(3, 10.0, HERE))
    assert after(operating, TookOver(3)).operating == operating
    assert after(Operating("desk"), TookOver(3)).notices == ()


def test_stop_releases_whoever_operates_until_the_handle_is_grabbed_anew() -> None:
    outcome = after(doing(Grabbed(3, 10.0, HERE)), Stopped())
    assert [reported.dead_man for reported in outcome.handles] == [False]
    assert after(outcome.operating, Moved(3, 10.1, THERE)).operating.handle(LATER_S) is None
    assert after(Operating("desk"), Stopped()).handles == ()


def test_the_operators_own_clutch_counts_and_nobody_elses() -> None:
    for client, pressed in ((3, True), (4, False)):
        held = doing(Clutched(client, True), Grabbed(3, 10.0, HERE)).handle(LATER_S)
        assert held is not None
        assert held.clutch is pressed
    held = doing(Clutched(3, True), Clutched(3, False), Grabbed(3, 10.0, HERE)).handle(LATER_S)
    assert held is not None
    assert not held.clutch


def test_a_pedal_is_up_again_soon_after_it_was_last_reported() -> None:
    operating = doing(Grabbed(3, 10.0, HERE), Pedaled(3, 10.1), Pedaled(4, 20.0))
    for now_s, down in ((10.2, True), (10.1 + PEDAL_S, False)):
        held = operating.handle(now_s)
        assert held is not None
        assert held.pedal is down


def test_a_long_name_of_a_console_still_makes_an_operator() -> None:
    operating = Operating("c" * 64)
    assert len(after(operating, Grabbed(123456, 1.0, HERE)).handles[0].operator) <= 64
