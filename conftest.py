"""For every test: a machine that is busy with something else makes no example too slow."""

from __future__ import annotations

import os
from typing import Any

import pytest
from hypothesis import settings
from xdist.scheduler import LoadFileScheduling

settings.register_profile("any-machine", deadline=None)
settings.load_profile("any-machine")

OF_WHOLE_STACKS = tuple(f"tests/{kind}/" for kind in ("end_to_end", "faults", "fuzz", "hosts"))


class OneStackAtATime(LoadFileScheduling):
    """Spreads files of tests over the cores; those that run a whole stack follow one another."""

    def _split_scope(self, nodeid: str) -> str:
        if nodeid.startswith(OF_WHOLE_STACKS):
            return "whole stacks"
        return super()._split_scope(nodeid)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Return how many tests run side by side: whole stacks often wait, and leave a core free."""
    return (os.cpu_count() or 1) + 1


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> OneStackAtATime:
    """Replace how pytest-xdist spreads the tests; it asks for this by name."""
    return OneStackAtATime(config, log)
