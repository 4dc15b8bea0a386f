"""For every test: a busy machine makes no example too slow, and whole stacks go before the rest."""

from __future__ import annotations

import contextlib
import os
from functools import cache

import pytest
from hypothesis import settings

settings.register_profile("any-machine", deadline=None)
settings.load_profile("any-machine")

OF_WHOLE_STACKS = (
    *(f"tests/{kind}/" for kind in ("bench", "browser", "end_to_end", "faults", "fuzz", "hosts")),
    "deploy/local/tests/demo/",
)
NICENESS = -10


@cache
def go_before_others() -> None:
    """Let this process, and those it starts, go before the rest of the machine if it may."""
    with contextlib.suppress(PermissionError):
        os.setpriority(os.PRIO_PROCESS, 0, NICENESS)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Give the processes of a stack what they have on a machine of their own."""
    if item.nodeid.startswith(OF_WHOLE_STACKS):
        go_before_others()
