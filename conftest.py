"""For every test: a busy machine makes no example too slow, and whole stacks go before the rest."""

from __future__ import annotations

import os
from functools import cache
from typing import Any

import pytest
from hypothesis import settings
from xdist.scheduler import LoadFileScheduling

settings.register_profile("any-machine", deadline=None)
settings.load_profile("any-machine")

OF_WHOLE_STACKS = tuple(
    f"tests/{kind}/" for kind in ("bench", "end_to_end", "faults", "fuzz", "hosts")
)
YIELDING_NICENESS = 10


class OneStackAtATime(LoadFileScheduling):
    """Spreads files of tests over the cores; those that run a whole stack follow one another."""

    def _split_scope(self, nodeid: str) -> str:
        if nodeid.startswith(OF_WHOLE_STACKS):
            return "whole stacks"
        return super()._split_scope(nodeid)


@cache
def yield_to_whole_stacks() -> None:
    """Let the processes of a whole stack go before this one."""
    os.nice(YIELDING_NICENESS)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Run a test that needs no whole stack behind those that do, where they run side by side."""
    if hasattr(item.config, "workerinput") and not item.nodeid.startswith(OF_WHOLE_STACKS):
        yield_to_whole_stacks()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Return how many tests run side by side: whole stacks often wait, and leave a core free."""
    return (os.cpu_count() or 1) + 1


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> OneStackAtATime:
    """Replace how pytest-xdist spreads the tests; it asks for this by name."""
    return OneStackAtATime(config, log)
