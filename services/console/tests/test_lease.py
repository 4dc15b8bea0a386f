from __future__ import annotations

from hmcs_console.operating import lease as leases
from hmcs_console.operating.lease import FREE, Lease


def test_the_first_page_that_grabs_the_handle_operates() -> None:
    assert leases.grabbed(FREE, 1, now_s=5.0) == Lease(1, 5.0)


def test_another_page_cannot_take_the_handle_away() -> None:
    held = Lease(1, 5.0)
    assert leases.grabbed(held, 2, now_s=5.1) == held
    assert leases.given_up(held, 2) == held
    assert leases.alive(held, 2, now_s=9.0) == held


def test_a_lease_lapses_so_long_after_the_last_sign_of_life() -> None:
    held = leases.alive(Lease(1, 5.0), 1, now_s=6.0)
    assert leases.at(held, 6.25, lease_s=0.25) == held
    assert leases.at(held, 6.26, lease_s=0.25) == FREE


def test_an_old_sign_of_life_does_not_shorten_a_lease() -> None:
    assert leases.alive(Lease(1, 6.0), 1, now_s=5.5) == Lease(1, 6.0)


def test_who_lets_go_leaves_the_lease_to_others() -> None:
    assert leases.grabbed(leases.given_up(Lease(1, 5.0), 1), 2, now_s=5.1) == Lease(2, 5.1)
