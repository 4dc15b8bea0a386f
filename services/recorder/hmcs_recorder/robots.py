"""How robots look, asked of them: without the names of its joints nobody can show a robot."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator

from hmcs.bus.messages import Ask, RobotDescription
from hmcs.bus.session import Bus
from hmcs.bus.verbs import LOOKS
from hmcs.recordings.file_rotation import Preface, Recording
from hmcs_recorder.prefacing import ask_all

JOINTS = "joints/"
"""Metadata of this beginning and a robot's name say what its description calls its joints."""
MOST_ASKED = 4
"""So often a robot is asked that gives no answer: one that just starts may need some time."""
RETRY_S = 5.0
"""After so long it is asked again."""


class Robots:
    """What the robots of a cell say of how they look."""

    def __init__(self, bus: Bus, log: logging.Logger) -> None:
        self._bus, self._log = bus, log
        self._robot_descriptions: dict[str, RobotDescription] = {}
        self._asked: dict[str, int] = {}
        """How often each was asked in vain."""
        self._again_s = 0.0

    def ask(self) -> None:
        """Ask all that are there."""
        for answer in ask_all(self._bus, LOOKS, Ask()):
            self._robot_descriptions[answer.body.robot] = answer.body

    def kept(self) -> Iterator[Preface]:
        """Yield what is kept of each: its description, and its joints' names in their order.

        Of one that gives no answer, that it does not.
        """
        yield from map(_kept, self._robot_descriptions.values())
        for robot, times in self._asked.items():
            if times == MOST_ASKED and robot not in self._robot_descriptions:
                yield _unknown(robot)

    def name_joints(self, recording: Recording, now_ns: int) -> None:
        """Keep how the robots in a recording look, and show them by the names of their joints.

        Those of which that is not known are asked again; that one gives no answer is said in the
        recording and in the log. Raises OSError as writing does.
        """
        undescribed = recording.undescribed
        for robot in undescribed & self._robot_descriptions.keys():
            recording.name_joints(robot, self._robot_descriptions[robot].joints)
        waiting = {
            robot
            for robot in undescribed - self._robot_descriptions.keys()
            if self._asked.get(robot, 0) < MOST_ASKED
        }
        if not waiting or time.monotonic() < self._again_s:
            return
        self._again_s = time.monotonic() + RETRY_S
        self.ask()
        for robot in waiting:
            robot_description = self._robot_descriptions.get(robot)
            if robot_description is not None:
                recording.add(_kept(robot_description), now_ns)
                recording.name_joints(robot, robot_description.joints)
                continue
            self._asked[robot] = self._asked.get(robot, 0) + 1
            if self._asked[robot] == MOST_ASKED:
                recording.add(_unknown(robot), now_ns)
                self._log.warning(
                    "a robot does not say how it looks: viewers cannot show it",
                    extra={"robot": robot},
                )


def _kept(robot_description: RobotDescription) -> Preface:
    urdf = f"{robot_description.robot}.urdf"
    facts = {"joints": " ".join(robot_description.joints), "description": urdf}
    return Preface(
        {f"{JOINTS}{robot_description.robot}": facts}, {urdf: robot_description.urdf.encode()}
    )


def _unknown(robot: str) -> Preface:
    facts = {"unknown": "it gives no answer to `looks`: it cannot be shown by its description"}
    return Preface({f"{JOINTS}{robot}": facts}, {})
