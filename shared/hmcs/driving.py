"""Who drives whom: one rule for the input device that is heard and for the robot that follows.

The fixture controller applies it to every sample and publishes what it decided (`Pairing`).
Recognizers follow that; where no fixture controller is there they apply the same rule to steps, and
recordings are read by it. Times are passed in, s of one monotonic clock.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

TAKEOVER_S = 0.5
"""Another takes over once the present one has been silent, or its dead-man up, for so long."""
PAIRING_FRESH_S = 1.0
"""A pairing that was not said again for so long binds nobody any more."""
PAIRINGS_KEPT = 16
"""Fixture controllers whose pairing is remembered."""
STANDBY_DEVICES = 16
"""Of so many other devices it is remembered whether their dead-man is down."""


@dataclass(frozen=True)
class Device:
    """The input device that drives; begin with `Device()`."""

    boot: str = ""
    """Empty while none was heard."""
    instance: str = ""
    heard_s: float = -float("inf")
    """When it was heard last."""
    released_s: float | None = None
    """Since when its dead-man is up; None while it is down."""
    deliberate: bool = False
    """Whether its dead-man had been seen up before it took over by pressing."""
    standby: Mapping[str, bool] = field(default_factory=lambda: MappingProxyType({}))
    """Whether the dead-man of the other devices, by boot, was down when they were heard last."""

    def silent(self, now_s: float) -> bool:
        """Whether none was heard for long enough to be taken over from."""
        return now_s - self.heard_s > TAKEOVER_S


def heard_device(now: Device, now_s: float, boot: str, instance: str, *, pressed: bool) -> Device:
    """Return who drives after a sample of the device `boot`, its dead-man down where `pressed`.

    The sample counts where the device returned is the one it came from. A device keeps driving
    while it is heard with its dead-man down. Another takes over once it is silent; or once its
    dead-man has been up for `TAKEOVER_S` and that of the other goes down after it was seen up.
    """
    released_s = None if pressed else now_s
    if boot == now.boot:
        still_released = released_s if now.released_s is None else now.released_s
        return replace(now, heard_s=now_s, released_s=None if pressed else still_released)
    was_pressed = now.standby.get(boot)
    let_go = now.released_s is not None and now_s - now.released_s > TAKEOVER_S
    presses = pressed and was_pressed is False
    if not now.boot or now.silent(now_s) or (let_go and presses):
        standby = {other: down for other, down in now.standby.items() if other != boot}
        deliberate = was_pressed is False
        return Device(boot, instance, now_s, released_s, deliberate, MappingProxyType(standby))
    standby = dict(now.standby)
    standby.pop(boot, None)
    standby[boot] = pressed
    while len(standby) > STANDBY_DEVICES:
        del standby[next(iter(standby))]
    return replace(now, standby=MappingProxyType(standby))


class Pairings:
    """Which robot each fixture controller said last that it drives; a robot asks it."""

    def __init__(self) -> None:
        self._said: OrderedDict[str, tuple[str, float]] = OrderedDict()

    def heard(self, writer: str, robot: str, now_s: float) -> None:
        """Take in that the boot `writer` drives the boot `robot`."""
        self._said[writer] = (robot, now_s)
        self._said.move_to_end(writer)
        if len(self._said) > PAIRINGS_KEPT:
            self._said.popitem(last=False)

    def other_than(self, own: str, writer: str, now_s: float) -> str:
        """Return the boot of another robot than `own` that a writer drives; empty for none."""
        robot, said_s = self._said.get(writer, ("", 0.0))
        return "" if robot == own or now_s - said_s > PAIRING_FRESH_S else robot


@dataclass(frozen=True)
class FollowingRobot:
    """The robot that follows; begin with `FollowingRobot()`."""

    boot: str = ""
    """Empty while there is none."""
    instance: str = ""
    heard_s: float = -float("inf")
    """When it was heard last."""


def heard_robot(
    now: FollowingRobot, now_s: float, boot: str, instance: str, present: Collection[str]
) -> FollowingRobot:
    """Return which robot follows after a state of robot `boot`.

    The state counts where the robot returned is the one it came from. A robot follows as long as it
    is heard and present; `present` are the instances of the robots that show a presence token. One
    without a token is no robot of the cell, unless no robot shows any.
    """
    if present and instance not in present:
        return now
    gone = bool(present) and now.instance not in present
    if boot == now.boot or not now.boot or gone or now_s - now.heard_s > TAKEOVER_S:
        return FollowingRobot(boot, instance, now_s)
    return now
