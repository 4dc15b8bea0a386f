"""What `hmcs deploy` is asked in a cell, what it tells, and what runs then."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from hmcs.bus.messages import Ask, Description
from hmcs.bus.session import Bus
from hmcs_local.control import Control
from hmcs_local.deploying import back, deploy, read_history
from hmcs_local.stack import LocalStack

Describe = Callable[..., dict[str, Any]]
Eventually = Callable[[Callable[[], Any]], Any]
Served = Callable[[LocalStack, Callable[[], Any]], Any]
CELL = "deployed"
UP_WITHIN_S = 240.0
"""A real recognizer is up by then, however busy the machine is."""
TASK = {
    "format": "hmcs-task/1",
    "name": "t",
    "dead_zone_m": 0.005,
    "gestemes": [{"name": "g"}],
    "states": [{"name": "s", "gestemes": ["g"], "next": {}}],
    "start": {"s": 1.0},
    "workspace": {"lower_m": [-1, -1, 0], "upper_m": [1, 1, 1]},
    "robot": {
        "model": "puma560",
        "tool_start_m": [0.6, 0, 0.5],
        "tool_orientation_xyzw": [0, 0, 0, 1],
    },
}


class Cell:
    """What `hmcs deploy` is asked here, what it tells, and what runs then."""

    def __init__(self, stack: LocalStack, bus: Bus, served: Served) -> None:
        self.stack, self.bus, self._served = stack, bus, served
        self.folder = stack.folder
        self.reported: list[str] = []

    def deploy(self, file: Path) -> None:
        self._raised(lambda: deploy(self.bus, Control(self.folder), self.folder, file, **self._how))

    def back(self) -> None:
        self._raised(
            lambda: back(self.bus, Control(self.folder), self.folder, self.reported.append)
        )

    @property
    def _how(self) -> dict[str, Any]:
        return {"watch_s": 0.0, "tell": self.reported.append}

    def _raised(self, act: Callable[[], Any]) -> None:
        def aside() -> BaseException | None:
            try:
                act()
            except BaseException as error:  # an interrupt does not leave a thread
                return error
            return None

        error = self._served(self.stack, aside)
        if error is not None:
            raise error

    @property
    def running(self) -> list[str]:
        return [process.instance for process in self.stack.instances("recognizer")]

    @property
    def deployed(self) -> list[str]:
        return [each.model for each in read_history(self.folder).deployed]


def described(bus: Bus, instance: str) -> bool:
    return bool(bus.ask(bus.keys.rpc("recognizer", instance, "describe"), Ask(), Description))
