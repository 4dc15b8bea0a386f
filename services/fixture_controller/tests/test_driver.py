from __future__ import annotations

from hmcs_fixture_controller.driver import Driver


def test_a_second_device_is_refused_while_the_first_is_alive_and_heard_after() -> None:
    driver = Driver(silent_after_s=0.1)
    assert driver.heard(1.0, "a", 0) == "accepted"
    assert driver.heard(1.05, "b", 0) == "second_device"
    assert not driver.admits(1.09, "b")
    assert driver.heard(1.11, "b", 1) == "accepted"
    assert driver.heard(1.12, "a", 1) == "second_device"


def test_samples_that_go_back_or_repeat_are_old() -> None:
    driver = Driver(silent_after_s=0.1)
    assert driver.heard(1.0, "a", 5) == "accepted"
    assert driver.heard(1.01, "a", 5) == "old"
    assert driver.heard(1.02, "a", 4) == "old"
    assert driver.heard(1.03, "a", 9) == "accepted"


def test_an_old_sample_keeps_no_device_alive() -> None:
    driver = Driver(silent_after_s=0.1)
    driver.heard(1.0, "a", 5)
    driver.heard(1.09, "a", 5)
    assert driver.heard(1.15, "b", 0) == "accepted"
