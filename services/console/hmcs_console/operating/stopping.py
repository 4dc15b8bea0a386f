"""Stop for everybody: every robot is asked to stand, whatever device drives it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from hmcs.bus.keys import Member
from hmcs.bus.messages import Ask
from hmcs.bus.session import Bus
from hmcs_console.asking import WAITING, Asking

ANSWERS_WITHIN_S = 1.0


class Stopping:
    """Asks robots to stand, on threads of its own: a stop does not wait for other answers."""

    def __init__(self, bus: Bus) -> None:
        self._asking = Asking(bus, at_once=WAITING)
        self._came: dict[Member, str] = {}
        """What came of the last stop; empty while it is waited for."""

    def stop(self, robots: Iterable[Member], tell: Callable[[str], None]) -> None:
        """Have robots stand; tell in a line each what came of it, anew with every answer.

        One that is being asked already is not asked twice.
        """
        wanted = sorted(robots)
        on_the_way = {robot for robot in wanted if self._came.get(robot) == ""}
        self._came = dict.fromkeys(wanted, "")
        tell(said(self._came))

        def ask(robot: Member) -> None:
            def come(what: str) -> None:
                if robot in self._came:
                    self._came[robot] = what
                    tell(said(self._came))

            self._asking.request(
                robot,
                "stop",
                Ask(),
                come,
                lambda reason: come(f"**may still move**: {reason}"),
                ANSWERS_WITHIN_S,
            )

        for robot in wanted:
            if robot not in on_the_way:
                ask(robot)

    def take(self) -> None:
        """Hand on what has come."""
        self._asking.take()

    def close(self) -> None:
        """Wait for what is being asked; ask nothing more."""
        self._asking.close()


def said(came: Mapping[Member, str]) -> str:
    """Return what came of a stop, by robot, in words; empty where it is waited for."""
    lines = ["**Stop**: whoever held a handle of this console has let go"]
    if not came:
        lines.append("no robot is there to be asked to stand")
    lines += [
        f"{robot.service} {robot.instance} {what or 'is asked to stand …'}"
        for robot, what in came.items()
    ]
    return "  \n".join(lines)
