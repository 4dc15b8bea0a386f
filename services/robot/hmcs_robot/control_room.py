"""The control room seen from the wire room: started, asked for nothing, ended."""

from __future__ import annotations

import json
import logging
import select
import subprocess
import sys
import threading
from collections.abc import Callable

from hmcs.bus.service import CannotGoOnError
from hmcs.errors import UserError
from hmcs_robot.channel import Channel, Closed, Snapshot, unpack_snapshot
from hmcs_robot.settings import RobotSettings

READY_WITHIN_S = 120.0
"""An arm that is not there by then will not come: a simulation takes a second or two."""
_ENDS_WITHIN_S = 3.0
_LOOK_EVERY_S = 0.5


class ControlRoomError(CannotGoOnError):
    """The control room ended by itself, or did not come up."""


class ControlRoom:
    """A control process and the channel to it.

    Raises UserError for a robot that cannot be, as its process says, and ControlRoomError where
    that does not come up.
    """

    def __init__(self, settings: RobotSettings, log: logging.Logger) -> None:
        self._log = log
        self.channel, there = Channel.pair()
        with there:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "hmcs_robot.control_process", str(there.fileno())],
                pass_fds=(there.fileno(),),
                stdin=subprocess.DEVNULL,
            )
        self._reader: threading.Thread | None = None
        try:
            self.channel.send(settings.model_dump_json().encode())
            first = json.loads(self._wait_for_first())
        except BaseException:
            self.close()
            raise
        if "mistake" in first:
            self.close()
            raise UserError(first["mistake"])
        self.priority: str = first["ready"]["priority"]
        self.joint_names: tuple[str, ...] = tuple(first["ready"]["joint_names"])
        self.links_within: tuple[str, ...] = tuple(first["ready"]["links_within"])
        self.engine: str = first["ready"]["engine"]

    @property
    def running(self) -> bool:
        """Whether its process is there."""
        return self._process.poll() is None

    def read(self, on_snapshot: Callable[[Snapshot], None], on_end: Callable[[], None]) -> None:
        """Call `on_snapshot` with each snapshot, and `on_end` once there is none any more.

        Both are called on a thread of this object's own.
        """

        def work() -> None:
            try:
                while True:
                    select.select([self.channel.fileno()], [], [], _LOOK_EVERY_S)
                    while (data := self.channel.receive()) is not None:
                        on_snapshot(unpack_snapshot(data))
            except (Closed, OSError, ValueError):
                on_end()

        self._reader = threading.Thread(target=work, name="snapshots", daemon=True)
        self._reader.start()

    def close(self) -> None:
        """End it: the arm comes to a stand, and the process is waited for."""
        self.channel.close()
        try:
            self._process.wait(_ENDS_WITHIN_S)
        except subprocess.TimeoutExpired:
            self._log.warning("the control process does not end: killed")
            self._process.kill()
            self._process.wait()

    def _wait_for_first(self) -> bytes:
        if not select.select([self.channel.fileno()], [], [], READY_WITHIN_S)[0]:
            raise ControlRoomError(f"the control process was not ready within {READY_WITHIN_S:g} s")
        try:
            return self.channel.receive() or b"{}"
        except Closed:
            self._process.wait(_ENDS_WITHIN_S)
            raise ControlRoomError(
                f"the control process ended with code {self._process.returncode} before it was "
                "ready: what it wrote above says why"
            ) from None
