"""The handle: who drags it moves the robot, nobody else does, and whoever leaves lets it stand."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest

from browser.viewing import Cell, Viewer, speed_of

pytestmark = pytest.mark.browser
OpenViewer = Callable[..., Viewer]

LIFTED_M = 0.10
MOVING_M_S, STANDING_M_S = 0.05, 0.002
STANDS_WITHIN_S = 0.250
DOWN_M, UP_M = 0.15, 0.32
"""From down there up there the hand is on its way for longer than it takes to close a page."""

Record = Callable[[str, object], None]


def until_stands(cell: Cell) -> None:
    """Wait until the tool stands."""
    cell.stack.until(lambda: cell.heard.speed < STANDING_M_S)


def test_who_drags_the_handle_moves_the_robot(operated: Cell, open_viewer: OpenViewer) -> None:
    viewer, heard = open_viewer(operated), operated.heard
    began = heard.tool.copy()
    viewer.drag(lambda: heard.held and heard.tool[2] - began[2] > LIFTED_M / 2, LIFTED_M, moves=8)
    viewer.until(lambda: viewer.sees(f"{heard.operator} operates."))
    viewer.let_go()
    operated.stack.until(lambda: not heard.held)
    until_stands(operated)
    moved = heard.tool - began
    assert moved[2] > LIFTED_M / 2
    assert np.linalg.norm(moved[:2]) < 0.01
    viewer.until(lambda: viewer.sees("Nobody operates"))


def test_a_second_page_cannot_operate_while_the_first_holds_the_handle(
    operated: Cell, open_viewer: OpenViewer
) -> None:
    first, second, heard = open_viewer(operated), open_viewer(operated), operated.heard
    began = heard.tool.copy()
    first.drag(
        lambda: heard.held and heard.tool[2] - began[2] > LIFTED_M / 4, LIFTED_M / 2, moves=4
    )
    operator = heard.operator
    until_stands(operated)
    stood = heard.tool.copy()
    second.until(lambda: second.sees(f"{operator} operates."))

    def refused() -> bool:
        place = second.reach_for_handle()
        second.lift_to(place, LIFTED_M / 2)
        second.lift_to(place, LIFTED_M)
        second.let_go()
        return second.sees("wait until that page lets go")

    second.until(refused)
    assert {handle.operator for _, handle in heard.handles} == {operator}
    assert heard.held
    assert np.linalg.norm(heard.tool - stood) < 1e-3
    first.let_go()
    operated.stack.until(lambda: not heard.held)
    second.drag(lambda: heard.held and heard.tool[2] - stood[2] > LIFTED_M / 4, LIFTED_M, moves=8)
    assert heard.operator != operator


def test_a_page_closed_in_mid_motion_lets_the_robot_stand_in_time(
    operated: Cell, open_viewer: OpenViewer, record_property: Record
) -> None:
    viewer, heard = open_viewer(operated), operated.heard
    began = heard.tool.copy()
    foot = viewer.drag(lambda: heard.held and began[2] - heard.tool[2] > DOWN_M / 2, -DOWN_M, 4)
    viewer.lift_to(foot, UP_M)
    operated.stack.until(lambda: heard.speed > MOVING_M_S)
    asked_ns = time.monotonic_ns()
    viewer.page.close()
    closed_ns = time.monotonic_ns()
    operated.stack.until(lambda: heard.robot[-1][0] > closed_ns + 1e9)
    released_ns = next(at for at, told in heard.handles if at > asked_ns and not told.dead_man)
    before = [told for at, told in heard.robot if at < released_ns][-1]
    moving_ns = [at for at, told in heard.robot if speed_of(told) >= STANDING_M_S][-1]
    stood_ns = next(at for at, _ in heard.robot if at > moving_ns)
    times = {"closed": closed_ns, "released": released_ns, "stood": stood_ns}
    for what, at_ns in times.items():
        record_property(what, f"{(at_ns - asked_ns) * 1e-6:.0f} ms")
        print(f"{what} {(at_ns - asked_ns) * 1e-6:.0f} ms after it was asked for")
    assert speed_of(before) > MOVING_M_S, "the robot stood before: nothing is shown"
    assert released_ns < stood_ns
    # How long a browser takes to close a page is its own affair; it may tell late that it has.
    assert (stood_ns - min(closed_ns, released_ns)) * 1e-9 <= STANDS_WITHIN_S
    assert heard.robot[-1][1].stop != "none"
