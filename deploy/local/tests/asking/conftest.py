"""A cell with robots that are asked, and somebody who asks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

import pytest

from hmcs.bus.messages import Ask
from hmcs.bus.router import open_router
from hmcs.bus.session import Bus
from hmcs_local.connecting import open_operator
from hmcs_local.stack import with_free_port
from support.asked import CELL, Asked, process

Eventually = Callable[[Callable[[], Any]], Any]


@pytest.fixture
def router() -> Iterator[str]:
    endpoint = with_free_port("tcp/127.0.0.1:0")
    with open_router(endpoint):
        yield endpoint


@pytest.fixture
def robot(router: str) -> Iterator[Callable[..., Asked]]:
    """Bring up robots until the test ends."""
    with ExitStack() as up:
        yield lambda instance, **how: up.enter_context(
            process(router, "robot", {"stop": Ask}, instance=instance, **how)
        )


@pytest.fixture
def observer(router: str) -> Iterator[Bus]:
    with open_operator(router, CELL) as bus:
        # It shows the tokens of others as well.
        bus.rights = None
        yield bus


@pytest.fixture
def seen(observer: Bus, eventually: Eventually) -> Callable[[int], None]:
    """Wait until so many tokens of presence are there."""

    def shown() -> int:
        there = observer.present(observer.keys.presence())
        return len(there.tokens) + len(there.strangers)

    return lambda count: eventually(lambda: shown() == count)
