"""A handle in a plane, and scaled: what it sends follows from where it was grabbed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from hmcs_console.operating.handles import (
    SETTLE_S,
    Event,
    Gone,
    Grabbed,
    Moved,
    Operating,
    Ruled,
    after,
)
from hmcs_console.operating.rules import (
    FARTHEST_M,
    FREE,
    KEPT_TO,
    LARGEST,
    SMALLEST,
    Grip,
    Rule,
    led_to,
    position_of,
    rule_of,
)

HERE = np.array([0.1, 0.2, 0.3])
coordinates = st.floats(-1.0, 1.0).map(lambda value: round(value, 6))
points = st.tuples(coordinates, coordinates, coordinates).map(np.array)
rules = st.builds(rule_of, st.sampled_from(list(KEPT_TO)), st.floats(SMALLEST, LARGEST))


def reported(operating: Operating) -> NDArray[np.float64]:
    handle = operating.handle(10.0 + 2 * SETTLE_S)
    assert handle is not None
    return handle.position


def doing(*events: Event) -> Operating:
    operating = Operating("desk")
    for event in events:
        operating = after(operating, event).operating
    return operating


@given(rule=rules, handle=points)
def test_a_handle_leads_from_where_it_was_taken_scaled_and_within_its_plane(
    rule: Rule, handle: NDArray[np.float64]
) -> None:
    led = led_to(Grip(HERE, rule), handle)
    for axis, free in enumerate(rule.axes):
        moved = rule.scale * (handle - HERE)[axis] if free else 0.0
        assert led[axis] - HERE[axis] == pytest.approx(moved, abs=1e-12)


@given(before=rules, meanwhile=st.lists(rules, max_size=3), at=points)
def test_a_change_of_rule_makes_no_held_handle_jump(
    before: Rule, meanwhile: list[Rule], at: NDArray[np.float64]
) -> None:
    operating = doing(Ruled(3, before), Grabbed(3, 10.0, HERE), Moved(3, 10.0, at))
    place = reported(operating)
    for rule in meanwhile:
        operating = after(operating, Ruled(3, rule)).operating
        assert_allclose(reported(operating), place)
        operating = after(operating, Moved(3, 10.0, at)).operating
        assert_allclose(reported(operating), place)


@given(moves=st.lists(st.one_of(points, rules), min_size=1), first=rules)
def test_however_rules_change_what_is_reported_moves_no_farther_than_the_handle_scaled(
    moves: list[NDArray[np.float64] | Rule], first: Rule
) -> None:
    operating = doing(Ruled(3, first), Grabbed(3, 10.0, HERE))
    handle, place = HERE, reported(operating)
    for move in moves:
        if isinstance(move, Rule):
            operating = after(operating, Ruled(3, move)).operating
        else:
            operating = after(operating, Moved(3, 10.0, move)).operating
            reach = first.scale * float(np.linalg.norm(move - handle))
            assert float(np.linalg.norm(reported(operating) - place)) <= reach + 1e-9
            handle = move
        place = reported(operating)


def test_a_changed_rule_holds_from_the_next_time_the_handle_is_taken() -> None:
    flat = rule_of("plane x y", 0.5)
    held = doing(Grabbed(3, 10.0, HERE), Ruled(3, flat), Moved(3, 10.0, HERE + 0.1))
    assert_allclose(reported(held), HERE + 0.1)
    again = after(held, Grabbed(3, 10.0, HERE)).operating
    moved = after(again, Moved(3, 10.0, HERE + 0.1)).operating
    assert_allclose(reported(moved) - HERE, [0.05, 0.05, 0.0], atol=1e-12)


def test_a_page_has_its_own_rule_and_takes_it_along() -> None:
    flat = rule_of("plane y z", 2.0)
    operating = doing(Ruled(4, flat), Grabbed(3, 10.0, HERE), Moved(3, 10.0, HERE + 0.1))
    assert_allclose(reported(operating), HERE + 0.1)
    assert operating.rules == {4: flat}
    assert doing(Ruled(4, flat), Gone(4)).rules == {}
    assert doing(Ruled(4, flat), Ruled(4, FREE)).rules == {}


def test_what_no_page_offers_is_no_rule() -> None:
    assert rule_of("plane of its own", float("nan")) == FREE
    assert rule_of("space", 1e9).scale == LARGEST
    assert rule_of("space", -1.0).scale == SMALLEST


@pytest.mark.parametrize(
    "reported",
    [
        (0.0, 0.0),
        (0.0, 0.0, float("nan")),
        (0.0, 0.0, float("inf")),
        (0.0, 0.0, 2 * FARTHEST_M),
        ("here", "or", "there"),
        None,
        {},
    ],
)
def test_what_is_no_place_of_a_handle_is_left_out(reported: object) -> None:
    assert position_of(reported) is None


def test_a_place_of_a_handle_is_read() -> None:
    place = position_of((0, 1, 2.5))
    assert place is not None
    assert_allclose(place, [0.0, 1.0, 2.5])
