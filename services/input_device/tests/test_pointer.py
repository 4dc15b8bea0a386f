"""The way of a pointer is the way of the hand."""

from __future__ import annotations

import numpy as np
import pytest

from support.devices import POINTER, Desk


def test_a_pointers_way_is_the_hands_in_the_plane_of_the_map() -> None:
    desk = Desk(POINTER, m_per_pixel=0.001, scale_m_s=0.5)
    desk.hold()
    for pixel in range(1, 41):
        desk.tell(press="hold", pointer=(pixel, pixel / 2))
    sample = desk.tell(press="hold", pointer=(40, 20), times=200)
    np.testing.assert_allclose(sample.position, [0, -0.04, 0.02], atol=1e-6)
    np.testing.assert_allclose(sample.velocity, np.zeros(3), atol=1e-6)


def test_a_pointer_is_brought_back_with_clutch_or_dead_man_up_and_the_hand_stays() -> None:
    desk = Desk(POINTER)
    desk.hold()
    here = desk.tell(press="hold", pointer=(10, 0), times=300).position
    for press in ("hold slip", ""):
        desk.tell(press=press, pointer=(100, 0))
        desk.tell(press=press, pointer=(150, 0))
        sample = desk.tell(press="hold", pointer=(180, 0), times=50)
        np.testing.assert_allclose(sample.position, here, atol=1e-9)


def test_letting_go_loses_what_the_hand_had_still_to_go() -> None:
    desk = Desk(POINTER)
    desk.hold()
    moving = desk.tell(press="hold", pointer=(50, 0))
    assert moving.velocity[1] < 0
    still = desk.tell(pointer=(50, 0), times=20)
    np.testing.assert_array_equal(still.position, moving.position)
    again = desk.tell(press="hold", pointer=(50, 0), times=20)
    np.testing.assert_array_equal(again.position, moving.position)


def test_a_pointer_that_jumps_moves_nothing() -> None:
    desk = Desk(POINTER)
    desk.hold()
    here = desk.tell(press="hold", pointer=(10, 0), times=300).position
    sample = desk.tell(press="hold", pointer=(5000.0, 0.0), times=50)
    np.testing.assert_allclose(sample.position, here, atol=1e-9)
    assert sample.dead_man


@pytest.mark.parametrize("elsewhere", [(float("nan"), 0.0), (1e308, 0.0), (0.0, -1e308), None])
def test_a_pointer_that_is_nowhere_stops_the_hand_until_it_is_pressed_anew(
    elsewhere: tuple[float, float] | None,
) -> None:
    desk = Desk(POINTER)
    desk.hold()
    here = desk.tell(press="hold", pointer=(10, 0), times=300).position
    assert not desk.tell(press="hold", pointer=elsewhere, times=50).dead_man
    assert "for the place of its pointer" in desk.source.trouble
    sample = desk.tell(press="hold", pointer=(10, 0), times=50)
    assert not sample.dead_man
    np.testing.assert_allclose(sample.position, here, atol=1e-9)
    desk.hold()
    assert desk.tell(press="hold").dead_man
