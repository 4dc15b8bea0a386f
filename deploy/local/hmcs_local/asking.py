"""Asking the services of the running cell to do something: all at once, and each one is heard."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple, TypeVar

from hmcs.bus.keys import ANY, Member
from hmcs.bus.messages import Ask, Done, Message, StopRequest
from hmcs.bus.presence import Present
from hmcs.bus.session import Answer, Bus, RequestRefusedError
from hmcs.bus.verbs import STOP, Verb
from hmcs.errors import UserError
from hmcs.shown import plain

Q = TypeVar("Q", bound=Message)

_ASKED_AT_ONCE = 256
"""Of more than so many processes some wait until others have answered."""
_ASK_AGAIN_S = 0.05
_STRANGERS_SHOWN = 3


class NobodyAnswersError(UserError):
    """A service that is asked for something is not there, or does not answer, or refuses."""


class PartlyAnsweredError(NobodyAnswersError):
    """Some have done what they were asked for, and others did not answer; nobody refused."""


class Reply(NamedTuple):
    """What one process made of what it was asked for."""

    member: Member
    done: bool
    detail: str
    """What it says it has done, or why it has not."""
    refused: bool = False

    def __str__(self) -> str:
        return f"{self.member.instance}: {plain(self.detail)}"


class Replies(NamedTuple):
    """What everybody made of it."""

    each: tuple[Reply, ...]
    """Sorted by name; all who are present, and any other that answered."""
    strangers: tuple[str, ...] = ()
    """Tokens of impossible names: no process bears one, and nobody is asked for it."""

    @property
    def all_done(self) -> bool:
        """Whether everybody has done it."""
        return all(reply.done for reply in self.each)


def ask_everybody(
    bus: Bus, verb: Verb[Q, Done], question: Q, service: str = "", timeout_s: float = 2.0
) -> Replies:
    """Ask every instance of a service that is present, all at once; return what each made of it.

    `service` is needed only for a verb that several kinds of process answer. Raises
    NobodyAnswersError where none is present.
    """
    service = service or verb.services[0]
    there = bus.present(bus.keys.presence(service))
    if not there.members:
        raise _nobody(bus, service, there.strangers)
    return Replies(_asked(bus, there.members, verb, question, timeout_s), there.strangers)


def asked_of(
    bus: Bus, verb: Verb[Q, Done], question: Q, service: str = "", timeout_s: float = 2.0
) -> str:
    """Ask every instance of a service; return what they have done.

    Raises NobodyAnswersError where none is present, one refuses or none answers, and
    PartlyAnsweredError where some have done it and others do not answer.
    """
    replies = ask_everybody(bus, verb, question, service, timeout_s).each
    answers = "; ".join(map(str, replies))
    if any(reply.refused for reply in replies) or not any(reply.done for reply in replies):
        raise NobodyAnswersError(answers)
    if not all(reply.done for reply in replies):
        raise PartlyAnsweredError(answers)
    return plain(replies[0].detail) if len(replies) == 1 else answers


def stop_everybody(bus: Bus, timeout_s: float = 2.0) -> Replies:
    """Let every robot of the cell stand, no matter who drives it; return what each says.

    A message that needs no answer goes to all of them, again and again while they are asked. All
    are asked at once, before anybody is looked for: no robot waits for another one, or for a token
    that is there. Those who are present are asked by name as well, again and again until they
    answer, refuse or `timeout_s` is over. Raises NobodyAnswersError where there is no robot.
    """
    requests = bus.publisher(StopRequest, bus.keys.stop_request)
    request = StopRequest(reason=f"hmcs stop, by {bus.source.service} {bus.source.instance}")
    with ThreadPoolExecutor(2) as aside:
        of_all = aside.submit(_answers, bus, Member("robot", ANY), STOP, Ask(), timeout_s)
        of_present = aside.submit(_stop_by_name, bus, timeout_s)
        while not (of_all.done() and of_present.done()):
            requests.put(request)
            time.sleep(_ASK_AGAIN_S)
    there, by_name = of_present.result()
    replies = {reply.member: reply for reply in by_name}
    for answer in of_all.result() if of_all.exception() is None else ():
        member = _sender(answer)
        is_robot = member.service == "robot"
        if is_robot and not (member in replies and replies[member].done):
            replies[member] = Reply(member, True, answer.body.detail)
    if not replies:
        raise _nobody(bus, "robot", there.strangers)
    return Replies(tuple(sorted(replies.values())), there.strangers)


def _stop_by_name(bus: Bus, timeout_s: float) -> tuple[Present, tuple[Reply, ...]]:
    there = bus.present(bus.keys.presence("robot"))
    return there, _asked(bus, there.members, STOP, Ask(), timeout_s, again=True)


def left_out(strangers: Sequence[str]) -> str:
    """Return a line about tokens of impossible names; empty where there are none."""
    if not strangers:
        return ""
    shown = ", ".join(
        repr(plain("/".join(token.split("/")[3:]), 60)) for token in strangers[:_STRANGERS_SHOWN]
    )
    more = ", …" if len(strangers) > _STRANGERS_SHOWN else ""
    return f"left out, since no process can bear such a name ({len(strangers)}): {shown}{more}"


def _asked(
    bus: Bus,
    members: Sequence[Member],
    verb: Verb[Q, Done],
    question: Q,
    timeout_s: float,
    *,
    again: bool = False,
) -> tuple[Reply, ...]:
    """Ask each of `members` under its own name, all at once."""

    def ask(member: Member) -> Reply:
        deadline_s = time.monotonic() + timeout_s
        try:
            while True:
                left_s = max(_ASK_AGAIN_S, deadline_s - time.monotonic())
                for answer in _answers(bus, member, verb, question, left_s):
                    if _sender(answer) == member:
                        return Reply(member, True, answer.body.detail)
                if not again or time.monotonic() + _ASK_AGAIN_S >= deadline_s:
                    return Reply(member, False, f"did not answer within {timeout_s:g} s")
                time.sleep(_ASK_AGAIN_S)
        except RequestRefusedError as error:
            return Reply(member, False, f"refused: {error}", refused=True)
        except Exception as error:  # whatever it is, the others are heard
            return Reply(member, False, f"could not be asked: {type(error).__name__}: {error}")

    if not members:
        return ()
    with ThreadPoolExecutor(min(len(members), _ASKED_AT_ONCE)) as asking:
        return tuple(asking.map(ask, members))


def _answers(
    bus: Bus, member: Member, verb: Verb[Q, Done], question: Q, timeout_s: float
) -> list[Answer[Done]]:
    return verb.ask(
        bus, question, service=member.service, instance=member.instance, timeout_s=timeout_s
    )


def _sender(answer: Answer[Done]) -> Member:
    """Return who says that it has answered."""
    return Member(answer.envelope.source.service, answer.envelope.source.instance)


def _nobody(bus: Bus, service: str, strangers: Iterable[str]) -> NobodyAnswersError:
    remark = left_out(tuple(strangers))
    return NobodyAnswersError(
        f"no {service.replace('_', ' ')} in cell {bus.settings.cell}: start one, e.g. by "
        f"python -m hmcs_{service}" + (f" ({remark})" if remark else "")
    )
