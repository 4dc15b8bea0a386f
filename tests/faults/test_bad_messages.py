"""Whatever comes on a key a service listens to: refused, counted, and the service goes on."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
import pytest
import zenoh

from hmcs.bus.config import BusSettings, client_config
from hmcs.bus.examples import ENVELOPE, EXAMPLES
from hmcs.bus.keys import Keys
from hmcs.bus.messages import (
    Ask,
    Belief,
    Command,
    Evidence,
    Health,
    Message,
    Motion,
    RobotState,
    Step,
)
from hmcs.bus.wire import encode
from hmcs.motion.steps import Step as MotionStep
from hmcs_local.processes import StackProcess
from support.hand import Scene
from support.stack import CELL, Stack

ARRAY_FIELD = {
    Motion: "velocity",
    Step: "displacement",
    Evidence: "log_ratio",
    Belief: "probabilities",
    Command: "twist",
    RobotState: "tool_position",
}
KEYS: dict[type[Message], Callable[[Keys], str]] = {
    Motion: lambda keys: keys.motion,
    Step: lambda keys: keys.step,
    Evidence: lambda keys: keys.evidence("human-shapes", "anybody"),
    Belief: lambda keys: keys.belief("human-shapes"),
    Command: lambda keys: keys.command,
    RobotState: lambda keys: keys.robot_state,
}
LISTENERS: dict[type[Message], tuple[str, ...]] = {
    Motion: ("fixture_controller",),
    Step: ("gesteme_classifier", "task_hmm", "fixture_controller"),
    Evidence: ("task_hmm",),
    Belief: ("fixture_controller",),
    Command: ("robot",),
    RobotState: ("fixture_controller",),
}


def changed(message_type: type[Message], change: Callable[[dict[str, Any]], None]) -> bytes:
    """Return the bytes of a good message with something changed in them."""
    example = next(e for e in EXAMPLES if type(e) is message_type)
    fields = msgpack.unpackb(encode(example, ENVELOPE))
    change(fields)
    packed: bytes = msgpack.packb(fields)
    return packed


def with_array(
    message_type: type[Message], change: Callable[[np.ndarray[Any, Any]], np.ndarray[Any, Any]]
) -> bytes:
    """Return the bytes of a message with another array in it."""

    def put(fields: dict[str, Any]) -> None:
        wire = fields[ARRAY_FIELD[message_type]]
        array = change(np.frombuffer(wire["data"], wire["dtype"]).copy())
        wire |= {"shape": array.shape, "data": array.tobytes()}

    return changed(message_type, put)


def bad_messages(message_type: type[Message]) -> dict[str, bytes]:
    """Return what is no message of that type, by what is wrong with it."""
    schema = message_type.SCHEMA
    field = ARRAY_FIELD[message_type]
    good = changed(message_type, lambda _: None)
    return {
        "nothing": b"",
        "not msgpack": b"\xc1\xff not msgpack",
        "cut off": good[: len(good) // 2],
        "more behind it": good + b"\x00",
        "not a map": msgpack.packb([1, 2, 3]),
        "a map of no message": msgpack.packb({"a": 1}),
        "keys that are no names": msgpack.packb({1: 2}),
        "nested without end": b"\x91" * 3000,
        "unknown schema": changed(message_type, lambda f: f.update(schema="gossip/1")),
        "unknown version": changed(message_type, lambda f: f.update(schema=f"{schema}/99")),
        "no source": changed(message_type, lambda f: f.pop("source")),
        "negative number": changed(message_type, lambda f: f.update(seq=-1)),
        "a field missing": changed(message_type, lambda f: f.pop(field)),
        "text for an array": changed(message_type, lambda f: f.update({field: "0, 0, 0"})),
        "NaN": with_array(message_type, lambda a: np.full_like(a, np.nan)),
        "infinity": with_array(message_type, lambda a: np.full_like(a, np.inf)),
        "wrong shape": with_array(message_type, lambda a: np.zeros((2, 5), a.dtype)),
        "bytes that do not fit": changed(
            message_type, lambda f: f[field].update(data=f[field]["data"][:-1])
        ),
        "an immense shape": changed(message_type, lambda f: f[field].update(shape=[2**62, 2**62])),
        "another dtype": changed(message_type, lambda f: f[field].update(dtype="O")),
    }


class Everybody:
    """One of each service on one router, and a session that says anything at all."""

    def __init__(self, stack: Stack, model_file: Path) -> None:
        self.stack = stack
        self.scene = Scene(stack)
        models = json.dumps([str(model_file)])
        self.services: dict[str, StackProcess] = {
            "gesteme_classifier": stack.start("gesteme_classifier", "c", "--model", model_file),
            "task_hmm": stack.start("task_hmm", "t", "--model", model_file, "--deadline-ms", 250),
            "fixture_controller": stack.start("fixture_controller", "f", "--models", models),
            "robot": stack.start("robot", "r"),
        }
        stack.until_ready(*self.services.values())
        self.keys = self.scene.bus.keys
        settings = BusSettings(router=stack.endpoint, cell=CELL)
        self.stranger = zenoh.open(client_config(settings))

    def health(self, service: str) -> Health:
        return self.stack.health(self.services[service])


@pytest.fixture(scope="module")
def everybody(tmp_path_factory: pytest.TempPathFactory, model_file: Path) -> Iterator[Everybody]:
    with Stack(tmp_path_factory.mktemp("logs")) as stack:
        there = Everybody(stack, model_file)
        with there.stranger:
            yield there


@pytest.mark.parametrize("message_type", LISTENERS, ids=lambda m: m.SCHEMA)
def test_what_is_no_message_is_refused_and_counted(
    everybody: Everybody, message_type: type[Message]
) -> None:
    schema, listeners = message_type.SCHEMA, LISTENERS[message_type]
    key = KEYS[message_type](everybody.keys)
    counted = {name: everybody.health(name).refused.get(schema, 0) for name in listeners}
    for count, (what, payload) in enumerate(bad_messages(message_type).items(), start=1):
        everybody.stranger.put(key, payload)
        for name in listeners:
            expected = counted[name] + count

            def refused(name: str = name, expected: int = expected) -> bool:
                return everybody.health(name).refused.get(schema, 0) >= expected

            try:
                everybody.stack.until(refused, within_s=3.0)
            except AssertionError:
                pytest.fail(f"{name} did not refuse a {schema} with {what}")
            assert everybody.health(name).refused[schema] == expected, what
    for name in listeners:
        assert everybody.health(name).healthy, everybody.health(name).detail
        assert everybody.services[name].running


def test_a_question_that_is_none_is_refused(everybody: Everybody) -> None:
    for name, process in everybody.services.items():
        counted = everybody.health(name).refused.get("ask", 0)
        key = everybody.keys.rpc(name, process.instance, "health")
        for payload in (b"", b"\xc1", msgpack.packb({"schema": "ask/9"})):
            replies = list(everybody.stranger.get(key, payload=payload, timeout=3.0))
            answers = [r.ok.payload.to_bytes() for r in replies if r.ok is not None]
            assert len(answers) == len(replies) == 1
            assert b"refusal/1" in answers[0]
        assert everybody.health(name).refused["ask"] == counted + 3


def test_after_all_that_recognition_goes_on(everybody: Everybody, steps: list[MotionStep]) -> None:
    everybody.scene.in_step(steps[:20])
    beliefs = [received.body for received in everybody.scene.watcher.beliefs]
    assert [belief.step for belief in beliefs] == list(range(20))
    assert not any(belief.missing_gestemes for belief in beliefs)
    everybody.scene.hand.sample((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), dead_man=False)
    everybody.stack.until(lambda: any(not r.body.engaged for r in everybody.scene.watcher.commands))
    assert everybody.scene.bus.ask(everybody.keys.rpc("robot", "r", "health"), Ask(), Health)
