"""Messages come back from a recording bit by bit."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.bus.examples import ENVELOPE, EXAMPLES
from hmcs.bus.messages import Message, Motion
from hmcs.bus.wire import encode, schema_of
from hmcs.recordings.plain import NoMessageError, fields_of, json_schema_of, message_of

PUBLISHED = [body for body in EXAMPLES if type(body).__name__ != "RobotLooks"]


@pytest.mark.parametrize("body", PUBLISHED, ids=lambda body: schema_of(type(body)))
def test_a_message_comes_back_from_json_as_it_was(body: Message) -> None:
    text = json.dumps(fields_of(encode(body, ENVELOPE)))
    envelope, read = message_of(type(body), text)
    assert envelope == ENVELOPE
    assert fields_of(encode(read, envelope)) == fields_of(encode(body, ENVELOPE))


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
def test_what_is_no_message_is_told(payload: bytes, says: str) -> None:
    with pytest.raises(NoMessageError, match=says):
        fields_of(payload)


def test_the_schema_of_a_recording_has_arrays_as_lists_of_numbers() -> None:
    schema = json_schema_of(Motion)
    assert schema["properties"]["position"]["type"] == "array"
    assert schema["properties"]["position"]["items"] == {"type": "number"}
    assert "base64" not in json.dumps(schema)
