from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hmcs_console.drawing.layout import Layout, anchored, laid_out
from hmcs_console.order import Order, next_part, order_of
from support.lessons import lesson_task

X, Y, Z = np.eye(3)
START = np.array([0.5, 0.0, 0.4])
WAYS = {"one": X, "two": Y, "three": Z, "four": -X}
RING = Order(
    "one",
    {"one": {"two": 1.0}, "two": {"three": 1.0}, "three": {"four": 1.0}, "four": {"one": 1.0}},
)


def ends(layout: Layout, state: str) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return layout.places[state] + WAYS[state]


def test_each_guide_of_a_ring_begins_where_the_one_before_it_ends() -> None:
    layout = laid_out(RING, WAYS, START)
    assert set(layout.places) == set(WAYS)
    assert_allclose(layout.places["one"], START)
    for before, after in (("one", "two"), ("two", "three"), ("three", "four")):
        assert_allclose(layout.places[after], ends(layout, before))


def test_a_state_lies_behind_the_one_it_most_likely_follows() -> None:
    order = Order(
        "one",
        {"one": {"two": 0.6, "three": 0.4}, "two": {"four": 0.3}, "three": {"four": 0.7}},
    )
    layout = laid_out(order, WAYS, START)
    assert_allclose(layout.places["two"], layout.places["three"])
    assert_allclose(layout.places["four"], ends(layout, "three"))


def test_a_state_without_a_guide_or_that_is_never_reached_has_no_place() -> None:
    order = Order("one", {"one": {"unlearned": 1.0}, "unlearned": {"two": 1.0}})
    assert set(laid_out(order, WAYS, START).places) == {"one"}
    assert laid_out(Order("unlearned", {}), WAYS, START).places == {}


def test_an_active_guide_moves_those_that_follow_it_and_no_others() -> None:
    before = laid_out(RING, WAYS, START)
    layout = anchored(before, RING, WAYS, "two", np.zeros(3))
    assert_allclose(layout.places["two"], 0.0)
    assert_allclose(layout.places["three"], Y)
    assert_allclose(layout.places["four"], Y + Z)
    assert_allclose(layout.places["one"], Y + Z - X)
    assert_allclose(before.places["two"], START + X)


def test_guides_that_were_active_stay_where_they_lay_then() -> None:
    layout = anchored(laid_out(RING, WAYS, START), RING, WAYS, "one", START)
    layout = anchored(layout, RING, WAYS, "two", np.zeros(3))
    assert_allclose(layout.places["one"], START)
    layout = anchored(layout, RING, WAYS, "one", 2 * START)
    assert_allclose(layout.places["one"], 2 * START)
    assert_allclose(layout.places["two"], 0.0)
    # Nobody knows of those behind a guide that is known more than that guide tells.
    assert_allclose(layout.places["three"], Y)


def test_a_state_that_follows_itself_is_placed_once() -> None:
    order = Order("one", {"one": {"one": 0.5, "two": 0.5}})
    layout = laid_out(order, WAYS, START)
    assert_allclose(layout.places["one"], START)
    assert_allclose(layout.places["two"], START + X)


def test_the_order_is_that_of_the_tasks_file() -> None:
    order = order_of(lesson_task())
    assert order.first == "reach"
    assert order.follow["turn-back"] == {"reach": 1.0}


@pytest.mark.parametrize("after", [{}, {"take": 1.0}])
def test_each_press_begins_the_likeliest_part_that_follows_and_one_more_ends_the_task(
    after: dict[str, float],
) -> None:
    order = Order("take", {"take": {"bring": 0.8, "set": 0.2}, "bring": {"set": 1.0}, "set": after})
    marked, now = [], ""
    for _ in range(5):
        now = next_part(order, now)
        marked.append(now)
    assert marked == ["take", "bring", "set", "", "take"]
