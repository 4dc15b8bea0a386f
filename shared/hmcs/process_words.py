"""How processes are called and what is said of how they are: by `hmcs status` and on the page."""

from __future__ import annotations

from hmcs.bus.keys import Member
from hmcs.bus.messages import Health

OK, ILL = "ok", "ill"
NOBODY = "nobody is there: bring the stack up with `hmcs up`"
NO_ANSWER = "present, but does not answer"
LOST, REFUSED, LATE = "lost", "refused", "late"
"""Messages: that were sent and did not come, that were not taken in, that came too late."""


def process_name(member: Member) -> str:
    """Return what a process is called: by its instance, where that says which service it is."""
    service, instance = member
    return instance if instance.startswith(service.replace("_", "-")) else f"{service}/{instance}"


def well(health: Health | None) -> str:
    """Return whether a process is well, in a word; one that does not answer is not."""
    return OK if health is not None and health.healthy else ILL


def detail(health: Health | None) -> str:
    """Return what a process does, or what is wrong with it."""
    return NO_ANSWER if health is None else health.detail


def unrun(model: str) -> str:
    """Return what is said of a fixture that follows a model for which no process works."""
    return f"follows {model}, but nobody runs it"
