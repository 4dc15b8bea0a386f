"""Stop for everybody: every robot is to stand, whatever device drives it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial

from hmcs.bus.keys import Member
from hmcs.bus.messages import Ask, StopRequest
from hmcs.bus.session import Bus
from hmcs.bus.verbs import STOP
from hmcs.shown import Markdown
from hmcs_console.asking import Asking

ANSWERS_WITHIN_S = 1.0
MOST_ASKED = 32
"""So many robots are asked what came of it, all at once; a cell has one or two."""
_NOT_ASKED = Markdown(
    "**may still move**: the stop was sent to it, its answer is not awaited: there are too many"
)


class Stopping:
    """Has robots stand, and asks each what came of it, on threads of its own."""

    def __init__(self, bus: Bus) -> None:
        self._requests = bus.publisher(StopRequest, bus.keys.stop_request)
        self._reason = f"Stop on the page of {bus.source.service} {bus.source.instance}"
        self._asking = Asking(bus, at_once=MOST_ASKED, waiting=MOST_ASKED)
        self._came: dict[Member, str] = {}
        """What came of the last stop; empty while it is waited for."""

    def stop_everybody(self, robots: Iterable[Member], tell: Callable[[str], None]) -> None:
        """Have every robot stand; tell in a line what came of it for each of these.

        One message goes to all robots, also to those that hang or are not seen here. Then each is
        asked, all at once, so that one that does not answer holds up no other; the line is written
        anew with every answer. One that is being asked already is not asked twice.
        """
        self._requests.put(StopRequest(reason=self._reason))
        wanted = sorted(robots)
        on_the_way = {robot for robot in wanted if self._came.get(robot) == ""}
        self._came = dict.fromkeys(wanted[:MOST_ASKED], "")
        self._came |= dict.fromkeys(wanted[MOST_ASKED:], _NOT_ASKED)
        for robot in wanted[:MOST_ASKED]:
            if robot not in on_the_way:
                self._ask(robot, partial(self._come, robot, tell))
        tell(said(self._came))

    def take(self) -> None:
        """Hand on what has come."""
        self._asking.take()

    def close(self) -> None:
        """Wait for what is being asked; ask nothing more."""
        self._asking.close()

    def _ask(self, robot: Member, come: Callable[[str], None]) -> None:
        def failed(reason: str) -> None:
            come(Markdown("**may still move**: {}").format(reason))

        self._asking.request(robot, STOP, Ask(), come, failed, ANSWERS_WITHIN_S)

    def _come(self, robot: Member, tell: Callable[[str], None], what: str) -> None:
        if robot in self._came:
            self._came[robot] = what
            tell(said(self._came))


def said(came: Mapping[Member, str]) -> Markdown:
    """Return what came of a stop, by robot, in words; empty where it is waited for."""
    lines = [Markdown("**Stop**: every handle of this console was let go")]
    if not came:
        lines.append(Markdown("no robot is there to be asked to stand"))
    lines += [
        Markdown("{} {} {}").format(*robot, what or "is asked to stand …")
        for robot, what in came.items()
    ]
    return Markdown("  \n").join(lines)
