"""Stop for everybody: every robot is asked to stand, whatever device drives it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial

from hmcs.bus.keys import ANY, Member
from hmcs.bus.messages import Ask, Done
from hmcs.bus.session import Answer, Bus
from hmcs.shown import Markdown
from hmcs_console.asking import Asking

ANSWERS_WITHIN_S = 1.0
MOST_APART = 32
"""So many robots are asked each for itself, all at once; the others by one question to all."""
_VERB = "stop"
_SILENT = Markdown("**may still move**: it gave no answer, or refused")


class Stopping:
    """Asks robots to stand, on threads of its own: a stop does not wait for other answers."""

    def __init__(self, bus: Bus) -> None:
        self._all = bus.keys.rpc("robot", ANY, _VERB)
        self._asking = Asking(bus, at_once=MOST_APART + 1, waiting=MOST_APART)
        self._came: dict[Member, str] = {}
        """What came of the last stop; empty while it is waited for."""
        self._asked_all = False

    def stop_everybody(
        self, robots: Iterable[Member], tell: Callable[[str], None], *, crowded: bool = False
    ) -> None:
        """Have robots stand; tell in a line each what came of it, anew with every answer.

        All are asked at once, so that one that does not answer holds up no other. One that is being
        asked already is not asked twice. Where there is none, or more than can be asked each for
        itself, or it is `crowded`, so that some may not be seen, whoever answers for a robot is
        asked as well.
        """
        wanted = sorted(robots)
        on_the_way = {robot for robot in wanted if self._came.get(robot) == ""}
        self._came = dict.fromkeys(wanted, "")
        apart, others = wanted[:MOST_APART], wanted[MOST_APART:]
        for robot in apart:
            if robot not in on_the_way:
                self._ask(robot, partial(self._come, robot, tell))
        if (crowded or others or not apart) and not self._asked_all:
            self._ask_all(others, tell)
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

        self._asking.request(robot, _VERB, Ask(), come, failed, ANSWERS_WITHIN_S)

    def _ask_all(self, others: Iterable[Member], tell: Callable[[str], None]) -> None:
        self._asked_all = True

        def come(answers: list[Answer[Done]]) -> None:
            self._asked_all = False
            told = {
                Member(answer.envelope.source.service, answer.envelope.source.instance): answer.body
                for answer in answers
            }
            for robot in others:
                self._came[robot] = told[robot].detail if robot in told else _SILENT
            tell(said(self._came))

        def failed(reason: str) -> None:
            self._asked_all = False
            for robot in others:
                self._came[robot] = Markdown("**may still move**: {}").format(reason)
            tell(said(self._came))

        self._asking.ask(self._all, Ask(), Done, come, failed, ANSWERS_WITHIN_S)

    def _come(self, robot: Member, tell: Callable[[str], None], what: str) -> None:
        if robot in self._came:
            self._came[robot] = what
            tell(said(self._came))


def said(came: Mapping[Member, str]) -> Markdown:
    """Return what came of a stop, by robot, in words; empty where it is waited for."""
    lines = [Markdown("**Stop**: whoever held a handle of this console has let go")]
    if not came:
        lines.append(Markdown("no robot is there to be asked to stand"))
    lines += [
        Markdown("{} {} {}").format(*robot, what or "is asked to stand …")
        for robot, what in came.items()
    ]
    return Markdown("  \n").join(lines)
