"""In a closed cell nobody moves the robot whose certificate does not give it the right."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import zenoh
from numpy.typing import NDArray

from hmcs.bus.config import BusSettings, client_config
from hmcs.bus.messages import (
    Belief,
    Command,
    Handle,
    Message,
    Motion,
    Pairing,
    RobotState,
    Source,
    Step,
)
from hmcs.bus.rights import is_within, rights_of, roles
from hmcs.bus.wire import decode, encode
from hmcs.motion.demonstrations import read_csv
from hmcs_secure.closed_cell import ClosedCell
from support.closed_cells import new_closed_cell
from support.hand import PERIOD_S, Scene
from support.stack import CELL, Stack

ROUNDS = 60
"""So often each message is forged and replayed by each certificate, 10 ms apart."""
MOVED_M = 0.02
STILL = 30
"""So many states that are alike bit by bit: the robot stands."""
SETTLES_S = 0.3
TRIES_S = 6.0
UNPRESSED = 9
"""Samples of a forged hand before it takes hold."""
REST = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


class Cell:
    """A cell that has just been driven by its operator, who rests, and all that was said in it."""

    def __init__(self, stack: Stack, model_file: Path, performance_file: Path) -> None:
        self.stack, self._performance = stack, performance_file
        self.scene = Scene(stack)
        keys = self.scene.bus.keys
        self.keys: dict[type[Message], str] = {
            Motion: keys.motion,
            Step: keys.step,
            Handle: keys.handle,
            Command: keys.command,
            Belief: keys.belief("human-shapes", "t"),
            Pairing: keys.pairing,
            RobotState: keys.robot_state,
        }
        self._playing = self.scene.bus.every(1.0, lambda: None)
        self.said: dict[type[Message], list[bytes]] = {each: [] for each in self.keys}
        stack.until_ready(
            stack.start("robot", "r"),
            stack.start("gesteme_classifier", "c", "--model", model_file),
            stack.start("task_hmm", "t", "--model", model_file, "--deadline-ms", 250),
            stack.start("fixture_controller", "f", "--models", json.dumps([str(model_file)])),
        )

    def listen(self, session: zenoh.Session) -> None:
        """Keep whatever is said on the keys that can be forged."""
        for message, key in self.keys.items():
            session.declare_subscriber(
                key, lambda heard, kept=self.said[message]: kept.append(heard.payload.to_bytes())
            )

    @property
    def pose(self) -> RobotState:
        return self.scene.watcher.robot[-1].body

    def follows_its_operator(self) -> None:
        """Let the operator perform until the robot has followed, then rest until it stands."""
        self.stack.until(lambda: self.scene.watcher.robot)
        began = self.pose.tool_position
        path, again_s = read_csv(self._performance), 0.0
        while not (self._way_m(began) > MOVED_M and self.scene.watcher.beliefs):
            # A machine that stalls may have stopped the robot: the hand then takes hold again.
            if time.monotonic() > again_s:
                self._playing.cancel()
                self._playing = self.scene.drive(path)
                again_s = time.monotonic() + TRIES_S
            self.stack.pump()
        self._playing.cancel()
        self._playing = self.scene.bus.every(
            PERIOD_S, lambda: self.scene.hand.sample(*REST, dead_man=False)
        )
        self.stack.until(self._stands)

    def _way_m(self, began: NDArray[np.float64]) -> float:
        return float(np.linalg.norm(self.pose.tool_position - began))

    def _stands(self) -> bool:
        last = [received.body for received in self.scene.watcher.robot[-STILL:]]
        return len(last) == STILL and all(
            each.stop != "none" and np.array_equal(each.joint_positions, last[0].joint_positions)
            for each in last
        )

    def forgeries(self, number: int) -> Iterator[tuple[type[Message], bytes]]:
        """Every message that drives: replayed, and made up in the name of who says it."""
        for message, heard in self.said.items():
            if heard:
                yield message, heard[number % len(heard)]
                yield message, _made_up(message, heard[-1], number)
        device = self.scene.bus.source
        robot = self.scene.watcher.robot[-1].envelope.source
        stranger = Source(service="console", instance="page", boot="page")
        handle = Handle(
            operator="me", position=np.array([0.01 * number, 0, 0]), dead_man=number > UNPRESSED
        )
        envelope = self.scene.watcher.robot[-1].envelope
        yield (
            Handle,
            encode(handle, envelope.model_copy(update={"source": stranger, "seq": number})),
        )
        pairing = Pairing(
            device=device.boot,
            device_instance=device.instance,
            robot=robot.boot,
            robot_instance=robot.instance,
        )
        yield (
            Pairing,
            encode(pairing, envelope.model_copy(update={"source": stranger, "seq": number})),
        )


def _made_up(message: type[Message], heard: bytes, number: int) -> bytes:
    """Return what a true sender said last, as it would go on if the hand moved."""
    envelope, body = decode(heard, message)
    changes: dict[type[Message], dict[str, object]] = {
        Motion: {
            "position": np.array([0.002 * number, 0.0, 0.0]),
            "velocity": np.array([0.2, 0.0, 0.0]),
            "dead_man": number > UNPRESSED,
        },
        Command: {
            "twist": np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.0]),
            "engaged": number > UNPRESSED,
            "valid_for_ns": 10**9,
        },
        RobotState: {"tool_position": np.array([0.1, 0.1, 0.1])},
    }
    forged = body.model_copy(update=changes.get(message, {}))
    return encode(forged, envelope.model_copy(update={"seq": envelope.seq + 1 + number}))


def displaced_m(cell: Cell, *attackers: tuple[zenoh.Session, set[type[Message]]]) -> float:
    """Return how far the robot goes while sessions forge and replay these messages."""
    start, begin = cell.pose, len(cell.scene.watcher.robot)
    for number in range(ROUNDS):
        for session, messages in attackers:
            for message, data in cell.forgeries(number):
                if message in messages:
                    session.put(cell.keys[message], data)
        cell.stack.elapse(PERIOD_S)
    cell.stack.elapse(SETTLES_S)
    states = [received.body for received in cell.scene.watcher.robot[begin:]]
    assert len(states) > ROUNDS / 2
    return max(float(np.linalg.norm(each.tool_position - start.tool_position)) for each in states)


@pytest.fixture
def closed(tmp_path: Path) -> ClosedCell:
    return new_closed_cell(tmp_path / "secure", CELL)


def test_in_an_open_cell_a_forgery_moves_the_robot(
    tmp_path: Path, model_file: Path, performance_file: Path
) -> None:
    with Stack(tmp_path) as stack, contextlib.ExitStack() as opened:
        cell = Cell(stack, model_file, performance_file)
        stranger = opened.enter_context(zenoh.open(client_config(stack.settings("anybody"))))
        cell.listen(stranger)
        cell.follows_its_operator()
        assert displaced_m(cell, (stranger, {Motion, Command})) > 0.0


def test_no_wrong_certificate_moves_the_robot_of_a_closed_cell(
    tmp_path: Path, closed: ClosedCell, model_file: Path, performance_file: Path
) -> None:
    with Stack(tmp_path, closed) as stack, contextlib.ExitStack() as opened:
        cell = Cell(stack, model_file, performance_file)
        sessions = {
            role: opened.enter_context(zenoh.open(client_config(stack.settings(role))))
            for role in roles()
        }
        cell.listen(sessions["operator"])
        cell.follows_its_operator()
        assert all(cell.said[message] for message in (Motion, Step, Command, Belief, RobotState))
        moved_m = {}
        for role, session in sessions.items():
            says = rights_of(role, cell.scene.bus.keys).says
            wrong = {message for message, key in cell.keys.items() if not is_within(key, says)}
            moved_m[role] = displaced_m(cell, (session, wrong))
        assert moved_m == dict.fromkeys(roles(), 0.0)
        cell.follows_its_operator()


@pytest.mark.parametrize("comes_with", ["nothing", "no certificate", "another cell's", "its own"])
def test_who_has_no_certificate_of_the_cell_does_not_join_it(
    tmp_path: Path, closed: ClosedCell, comes_with: str
) -> None:
    with Stack(tmp_path, closed) as stack:
        stack.watch(stack.open_bus("operator", "looks"))
        settings = stack.settings("operator")
        other = new_closed_cell(tmp_path / "other", CELL).credentials("operator")
        mine = {"tls_certificate": other.tls_certificate, "tls_key": other.tls_key}
        comes = {
            "nothing": BusSettings(router=stack.endpoint.replace("tls/", "tcp/"), cell=CELL),
            "no certificate": settings,
            "another cell's": settings.model_copy(update=mine),
            "its own": settings.model_copy(update={"tls_ca": other.tls_ca} | mine),
        }
        configuration = client_config(comes[comes_with])
        if comes_with == "no certificate":
            for name in ("connect_certificate", "connect_private_key"):
                configuration.insert_json5(f"transport/link/tls/{name}", "null")
        with pytest.raises(zenoh.ZError):
            zenoh.open(configuration)
        with zenoh.open(client_config(settings)):
            pass
