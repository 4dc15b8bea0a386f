"""The handle of a page as a device."""

from __future__ import annotations

import numpy as np

from hmcs.bus.messages import Handle
from hmcs_input_device.held import FASTEST_M_S, SILENT_S, HeldHandle

PERIOD_S = 0.01


def handle(x_m: float, operator: str = "page-1", **changes: bool) -> Handle:
    said = {"dead_man": True, **changes}
    return Handle(operator=operator, position=np.array([x_m, 0.0, 0.0]), **said)


class Desk:
    """A device asked a hundred times a second, and pages that speak to it."""

    def __init__(self) -> None:
        self.device, self.now_s = HeldHandle(), 10.0

    def run(self, seconds: float, said: Handle | None = None, every_s: float = 0.033):
        samples, next_s = [], self.now_s
        for _ in range(round(seconds / PERIOD_S)):
            if said is not None and self.now_s >= next_s:
                assert self.device.handled(self.now_s, said)
                next_s += every_s
            self.now_s += PERIOD_S
            self.device.seconds(self.now_s)
            samples.append(self.device.sample(0.0))
        return samples


def test_the_hand_follows_the_handle_and_its_velocity_is_that_of_its_way() -> None:
    desk = Desk()
    desk.run(0.2, handle(0.0))
    samples = desk.run(1.0, handle(0.1))
    assert samples[-1].dead_man
    np.testing.assert_allclose(samples[-1].position, [0.1, 0, 0], atol=1e-4)
    way = sum(sample.velocity for sample in samples) * PERIOD_S
    np.testing.assert_allclose(way, samples[-1].position - [0.0, 0, 0], atol=1e-6)
    assert max(np.linalg.norm(s.velocity) for s in samples) <= FASTEST_M_S + 1e-9


def test_a_page_that_falls_silent_lets_go_within_its_time_and_the_hand_stays() -> None:
    desk = Desk()
    desk.run(0.5, handle(0.05))
    after = desk.run(0.5)
    held_s = PERIOD_S * sum(sample.dead_man for sample in after)
    assert held_s <= SILENT_S + PERIOD_S
    assert not after[-1].dead_man
    np.testing.assert_array_equal(after[-1].velocity, np.zeros(3))


def test_pressing_elsewhere_does_not_jump() -> None:
    desk = Desk()
    before = desk.run(0.5, handle(0.05))[-1].position
    desk.run(0.5, handle(0.05, dead_man=False))
    pressed = desk.run(0.1, handle(0.4))
    np.testing.assert_allclose(pressed[-1].position, before, atol=1e-9)


def test_a_second_page_cannot_operate_until_the_first_has_let_go() -> None:
    desk = Desk()
    desk.run(0.2, handle(0.0))
    assert not desk.device.handled(desk.now_s, handle(0.3, "page-2"))
    desk.run(2 * SILENT_S)
    assert desk.device.handled(desk.now_s, handle(0.3, "page-2"))


def test_a_handle_that_jumps_a_meter_is_followed_no_faster_than_a_hand() -> None:
    desk = Desk()
    desk.run(0.2, handle(0.0))
    samples = desk.run(0.2, handle(1.0))
    speeds = [np.linalg.norm(sample.velocity) for sample in samples]
    assert max(speeds) <= FASTEST_M_S + 1e-9


def test_while_clutched_the_handle_is_repositioned_and_the_hand_is_not() -> None:
    desk = Desk()
    here = desk.run(0.5, handle(0.05))[-1].position
    clutched = desk.run(0.3, handle(0.3, clutch=True))
    assert clutched[-1].clutch
    np.testing.assert_allclose(clutched[-1].position, here, atol=1e-9)
    np.testing.assert_allclose(desk.run(0.2, handle(0.3))[-1].position, here, atol=1e-9)
