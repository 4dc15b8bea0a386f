"""An axis that does not rest moves nothing, and is named."""

from __future__ import annotations

import numpy as np
import pytest

from hmcs_input_device.devices.device_source import REST_WITHIN_S
from support.devices import PERIOD_S, Desk


def assert_stays(desk: Desk, *axes: float, seconds: float = 0.9) -> None:
    """The hand does not move while the dead-man is held: shorter than a reported silence."""
    here = desk.source.sample(desk.now_s).position
    still = desk.tell(*axes, press="hold", times=round(seconds / PERIOD_S))
    assert not still.dead_man
    np.testing.assert_array_equal(still.position, here)


@pytest.mark.parametrize("rest", [0.99, -1.0, 1.0, 0.12, -0.2])
def test_an_axis_that_was_never_at_rest_moves_nothing_and_is_named(rest: float) -> None:
    """A gamepad before it is touched, a throttle or trigger that rests at an end, a worn stick."""
    desk = Desk(comes_at=(0.0, rest))
    assert f"has not been at rest since it came, see axis y ({rest:.2f})" in desk.source.trouble
    assert_stays(desk, 0.0, rest)
    assert_stays(desk, 0.5, rest)
    desk.tell()
    assert desk.source.trouble == ""
    desk.hold()
    assert desk.tell(0.5, press="hold").velocity[0] > 0


def test_a_trigger_that_rests_at_an_end_moves_nothing_also_after_it_was_pulled() -> None:
    desk = Desk()
    pulled = [*np.linspace(-1, 1, 21), *np.linspace(1, -1, 21)]
    for press in ("", "hold", ""):
        for value in pulled:
            desk.tell(float(value), press=press)
        desk.tell(-1.0, times=round(2 * REST_WITHIN_S / PERIOD_S))
        assert_stays(desk, -1.0)
        assert "was not at rest when hold was pressed, see axis x (-1.00)" in desk.source.trouble
        desk.tell(-1.0)


def test_a_stick_that_drifts_after_it_was_let_go_of_moves_nothing_and_says_what_to_do() -> None:
    desk = Desk()
    desk.hold()
    desk.tell(1.0, press="hold", times=10)
    for drift in np.linspace(0.0, 0.15, 200):
        desk.tell(float(drift))
    desk.tell(0.15, times=100)
    assert desk.source.trouble == ""
    assert_stays(desk, 0.15)
    assert "where it drifts, widen device.dead_band" in desk.source.trouble


@pytest.mark.parametrize("dead_band", [0.0, 0.1])
def test_pressing_the_dead_man_may_push_the_stick(dead_band: float) -> None:
    desk = Desk(dead_band=dead_band, comes_at=(0.04,))
    assert desk.source.trouble == ""
    assert desk.tell(0.3, press="hold").dead_man
    assert desk.tell(0.3, press="hold").velocity[0] > 0
    late = Desk()
    late.tell(0.5, times=round(0.8 * REST_WITHIN_S / PERIOD_S))
    assert late.tell(0.5, press="hold").dead_man


def test_an_axis_that_moves_nothing_may_be_anywhere() -> None:
    desk = Desk(comes_at=(0.0, 0.0, 0.0, 1.0, -1.0, 0.7))
    desk.tell(0.0, 0.0, 0.0, 1.0, -1.0, 0.7)
    desk.tell(0.0, 0.0, 0.0, 1.0, -1.0, 0.7, press="hold")
    assert desk.tell(0.5, 0.0, 0.0, 1.0, -1.0, 0.7, press="hold").velocity[0] > 0
    assert desk.source.trouble == ""
