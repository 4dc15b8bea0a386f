"""Asking a service of the running cell to do something."""

from __future__ import annotations

from hmcs.bus.messages import Done, Message
from hmcs.bus.session import Bus, RequestRefusedError
from hmcs.errors import UserError


class NobodyAnswersError(UserError):
    """A service that is asked for something is not there, or does not answer, or refuses."""


def asked_of(bus: Bus, service: str, verb: str, question: Message, timeout_s: float = 2.0) -> str:
    """Ask every instance of a service; return what they answer.

    Raises NobodyAnswersError where none is there, one does not answer, or one refuses.
    """
    keys = bus.keys
    present = [keys.member_of(key) for key in bus.alive(keys.presence(service))]
    if not present:
        raise NobodyAnswersError(
            f"no {service.replace('_', ' ')} in cell {bus.settings.cell}: start one, e.g. by "
            f"python -m hmcs_{service}"
        )
    details: list[str] = []
    for member in present:
        key = keys.rpc(member.service, member.instance, verb)
        try:
            answers = bus.ask(key, question, Done, timeout_s)
        except RequestRefusedError as error:
            raise NobodyAnswersError(f"{member.instance}: {error}") from None
        if not answers:
            raise NobodyAnswersError(f"{member.instance} does not answer: see `hmcs status`")
        details += [answer.body.detail for answer in answers]
    return "; ".join(details)
