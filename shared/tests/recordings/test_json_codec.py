"""Messages come back from a recording bit by bit."""

from __future__ import annotations

import json
from contextlib import suppress
from enum import Enum, auto
from pathlib import Path

import msgpack
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.bus.arrays import to_wire
from hmcs.bus.examples import ENVELOPE, EXAMPLES
from hmcs.bus.messages import Message, Motion, RobotDescription, RobotState
from hmcs.bus.wire import decode, encode, schema_of
from hmcs.recordings.json_codec import (
    NoMessageError,
    fields_of,
    json_schema_of,
    message_of,
    readable_as,
)

GOLDEN = Path(__file__).parents[3] / "tests/contract/golden"
PUBLISHED = [body for body in EXAMPLES if not isinstance(body, RobotDescription)]


@pytest.mark.parametrize("body", PUBLISHED, ids=lambda body: schema_of(type(body)))
def test_a_message_comes_back_from_json_as_it_was(body: Message) -> None:
    text = json.dumps(fields_of(encode(body, ENVELOPE)))
    envelope, read = message_of(type(body), text)
    assert envelope == ENVELOPE
    assert fields_of(encode(read, envelope)) == fields_of(encode(body, ENVELOPE))


@pytest.mark.parametrize("older", ["robot_state/2", "robot_state/3"])
def test_a_recorded_message_of_an_earlier_version_opens(older: str) -> None:
    golden = GOLDEN / f"{older.replace('/', '-')}.bin"
    today = golden.read_bytes().replace(older.encode(), schema_of(RobotState).encode())
    text = json.dumps(fields_of(today) | {"schema": older})
    message_type = readable_as(older)
    assert message_type is RobotState
    assert message_of(message_type, text)[0] == ENVELOPE


@given(st.lists(st.floats(-1e9, 1e9), min_size=3, max_size=3))
def test_every_number_comes_back_to_the_last_bit(values: list[float]) -> None:
    motion = Motion(position=np.array(values), velocity=np.zeros(3), dead_man=True)
    text = json.dumps(fields_of(encode(motion, ENVELOPE)))
    read = message_of(Motion, text)[1]
    assert read.position.tobytes() == np.array(values).tobytes()


@pytest.mark.parametrize(
    ("payload", "says"),
    [
        (b"\xc1", "not a msgpack"),
        (b"\x01", "not a msgpack map"),
        (b"\x80", "none of this contract"),
    ],
)
def test_what_is_no_message_is_reported(payload: bytes, says: str) -> None:
    with pytest.raises(NoMessageError, match=says):
        fields_of(payload)


def wire(**fields: object) -> bytes:
    zeros = to_wire(np.zeros(3))
    legal = {
        "schema": "motion/1",
        "source": {"service": "input_device", "instance": "other", "boot": "b"},
        "seq": 0,
        "position": zeros,
        "velocity": zeros,
        "dead_man": True,
    }
    packed: bytes = msgpack.packb({k: v for k, v in (legal | fields).items() if v is not LEFT_OUT})
    return packed


class LeftOut(Enum):
    """What stands for a field that is not there."""

    FIELD = auto()


LEFT_OUT = LeftOut.FIELD


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"origin": None, "orientation": None},
        {"newer": {"nested": [1, {"a": b"bytes"}], "number": float("nan")}},
        {"newer": to_wire(np.array([1.0, np.inf]))},
        {"newer": {"dtype": "O", "shape": [1], "data": bytes(8)}},
        {"newer": {"dtype": "<f8", "shape": [2**40], "data": bytes(8)}},
        {"newer": {"dtype": 7, "shape": None, "data": bytes(8)}},
        {"newer": {"dtype": "<U1", "shape": [2], "data": bytes(8)}},
        {"newer": msgpack.Timestamp(1, 2)},
        {"newer": msgpack.ExtType(5, b"x")},
        {b"bytes": 1},
        {"newer": {b"bytes": 1}},
        {"newer": 2**64 - 1},
        {"source": {"service": "s", "instance": "i", "boot": "b", "more": float("inf")}},
    ],
    ids=str,
)
def test_every_legal_message_is_recorded_without_what_json_cannot_have(
    more: dict[str, object],
) -> None:
    payload = with_more(more)
    envelope, motion = decode(payload, Motion)
    text = json.dumps(fields_of(payload), allow_nan=False)
    read_envelope, read = message_of(Motion, text)
    assert read_envelope == envelope
    np.testing.assert_array_equal(read.position, motion.position)
    assert read.orientation is None


def with_more(more: dict[str, object]) -> bytes:
    packed: bytes = msgpack.packb({**msgpack.unpackb(wire()), **more})
    return packed


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"schema": ["motion/1"]}, "none of this contract"),
        ({"schema": b"motion/1"}, "none of this contract"),
        ({"schema": {"motion": 1}}, "none of this contract"),
        ({"schema": None}, "none of this contract"),
        ({"schema": "motion/9"}, "none of this contract"),
        ({"schema": LEFT_OUT}, "none of this contract"),
        ({"source": LEFT_OUT}, "source"),
        ({"source": [1]}, "source"),
        ({"source": {"service": 1, "instance": "i", "boot": "b"}}, "source.service"),
        ({"seq": "one"}, "seq"),
        ({"seq": -1}, "seq"),
        ({"seq": 0.5}, "seq"),
        ({"origin": [1]}, "origin"),
        ({"origin": {"boot": "b", "seq": 0, "captured_ns": "now"}}, "origin.captured_ns"),
        ({"position": LEFT_OUT}, "position"),
        ({"position": [0.0, 0.0, 0.0]}, "position"),
        ({"position": to_wire(np.zeros(2))}, "position"),
        ({"position": to_wire(np.array([0, np.nan, 0]))}, "position"),
        ({"position": {"dtype": "<f8", "shape": [3], "data": b"short"}}, "position"),
        ({"dead_man": 1}, "dead_man"),
        ({"dead_man": None}, "dead_man"),
    ],
    ids=str,
)
def test_what_is_malformed_is_refused_and_says_where(fields: dict[str, object], says: str) -> None:
    with pytest.raises(NoMessageError, match=says):
        fields_of(wire(**fields))


@pytest.mark.parametrize("depth", [300, 5000])
def test_what_is_nested_without_end_is_refused_or_written(depth: int) -> None:
    payload = wire(newer=0).replace(
        msgpack.packb("newer") + msgpack.packb(0),
        msgpack.packb("newer") + b"\x91" * depth + b"\x01",
    )
    with suppress(NoMessageError):
        json.dumps(fields_of(payload))


@given(st.binary(max_size=200))
def test_no_bytes_end_in_anything_but_a_refusal(data: bytes) -> None:
    with suppress(NoMessageError):
        fields_of(data)


@given(
    st.recursive(
        st.none()
        | st.booleans()
        | st.integers(-(2**63), 2**64 - 1)
        | st.floats()
        | st.text()
        | st.binary(),
        lambda inner: st.lists(inner) | st.dictionaries(st.text() | st.binary(), inner),
        max_leaves=20,
    ),
    st.sampled_from(["schema", "source", "seq", "origin", "position", "dead_man", "newer"]),
)
def test_whatever_stands_in_a_field_is_written_as_json_or_refused(value: object, name: str) -> None:
    with suppress(NoMessageError):
        json.dumps(fields_of(wire(**{name: value})), allow_nan=False)


def test_the_schema_of_a_recording_has_arrays_as_lists_of_numbers() -> None:
    schema = json_schema_of(Motion)
    assert schema["properties"]["position"]["type"] == "array"
    assert schema["properties"]["position"]["items"] == {"type": "number"}
    assert "base64" not in json.dumps(schema)
