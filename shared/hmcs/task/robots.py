"""The robots that a task may name: those that come along, and those other distributions bring.

A distribution brings robots by the entry-point group `hmcs.robots`: a mapping whose keys are names.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.metadata import entry_points
from typing import Any

from hmcs.task.values import unknown_name_message

GROUP = "hmcs.robots"
SHIPPED = ("iiwa", "panda", "puma560")


def known_robots() -> tuple[str, ...]:
    """Return the names of all robots."""
    brought = (name for robots in brought_robots() for name in robots)
    return tuple(dict.fromkeys((*SHIPPED, *map(str, brought))))


def check_robot(name: str) -> str:
    """Return a robot's name; raises ValueError, which names the nearest, where there is none."""
    if name not in SHIPPED and name not in known_robots():
        unknown = unknown_name_message("robot", name, known_robots())
        raise ValueError(f"{unknown}; for an arm of your own give urdf: FILE in place of model")
    return name


@cache
def brought_robots() -> tuple[Mapping[str, Any], ...]:
    """What the installed distributions bring; one that cannot be loaded brings nothing."""
    found = []
    for entry in entry_points(group=GROUP):
        try:
            robots = entry.load()
        except Exception:  # whatever is wrong with it, other robots can be named
            continue
        if isinstance(robots, Mapping):
            found.append(robots)
    return tuple(found)
