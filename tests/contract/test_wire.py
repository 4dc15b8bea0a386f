"""Bytes to messages and back, and everything that is refused on the way."""

from __future__ import annotations

from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hmcs.bus.bounds import BOUNDS, LARGEST_PUBLISHED_BYTES
from hmcs.bus.examples import ENVELOPE, EXAMPLES
from hmcs.bus.messages import (
    MESSAGES,
    Envelope,
    Evidence,
    Message,
    Motion,
    RobotState,
    Step,
)
from hmcs.bus.wire import RefusedMessageError, decode, encode, schema_of

MOTION = next(example for example in EXAMPLES if isinstance(example, Motion))

relaxed = settings(
    max_examples=25,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


@pytest.fixture
def fields() -> dict[str, Any]:
    """The map of a Motion on the wire, to be spoiled."""
    unpacked: dict[str, Any] = msgpack.unpackb(encode(MOTION, ENVELOPE))
    return unpacked


def same(one: object, other: object) -> bool:
    if isinstance(one, np.ndarray):
        return (
            isinstance(other, np.ndarray)
            and one.dtype == other.dtype
            and np.array_equal(one, other)
        )
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if hasattr(one, "model_fields_set"):
        return type(one) is type(other) and all(
            same(value, getattr(other, name)) for name, value in one.__dict__.items()
        )
    return one == other


@pytest.mark.parametrize("message_type", MESSAGES, ids=schema_of)
def test_any_message_comes_back_as_it_was_sent(message_type, any_message, any_envelope) -> None:
    @relaxed
    @given(any_message(message_type), any_envelope)
    def holds(body: Message, envelope: Envelope) -> None:
        back_envelope, back = decode(encode(body, envelope), message_type)
        assert back_envelope == envelope
        assert same(back, body)

    holds()


@pytest.mark.parametrize("message_type", MESSAGES, ids=schema_of)
def test_no_field_of_a_body_takes_the_place_of_one_of_the_envelope(message_type) -> None:
    assert not {"schema", *Envelope.model_fields} & set(message_type.model_fields)


@relaxed
@given(st.binary(max_size=200))
def test_arbitrary_bytes_are_refused_and_raise_nothing_else(data: bytes) -> None:
    with pytest.raises(RefusedMessageError):
        decode(data, Motion)


@relaxed
@given(st.data())
def test_a_message_spoiled_anywhere_is_refused_or_read_finite(data) -> None:
    good = encode(MOTION, ENVELOPE)
    where = data.draw(st.integers(0, len(good) - 1))
    bad = good[:where] + bytes([data.draw(st.integers(0, 255))]) + good[where + 1 :]
    try:
        _, motion = decode(bad, Motion)
    except RefusedMessageError:
        return
    assert np.isfinite(motion.position).all()
    assert motion.position.shape == (3,)


@pytest.mark.parametrize("length", [0, 1, 50, -1])
def test_truncated_bytes_are_refused(length) -> None:
    with pytest.raises(RefusedMessageError, match="not a msgpack message"):
        decode(encode(MOTION, ENVELOPE)[:length], Motion)


def test_bytes_that_go_on_after_the_message_are_refused() -> None:
    with pytest.raises(RefusedMessageError, match="not a msgpack message"):
        decode(encode(MOTION, ENVELOPE) + b"\x00", Motion)


def test_what_is_no_map_is_refused() -> None:
    with pytest.raises(RefusedMessageError, match="expected a map"):
        decode(msgpack.packb([1, 2]), Motion)


def test_another_schema_is_refused_and_both_are_named() -> None:
    with pytest.raises(RefusedMessageError, match=r"'motion/1', expected 'step/1'"):
        decode(encode(MOTION, ENVELOPE), Step)


@pytest.mark.parametrize("schema", ["motion/2", "motion", "", None, 7, ["motion/1"]])
def test_another_version_or_none_is_refused(fields, schema) -> None:
    fields["schema"] = schema
    with pytest.raises(RefusedMessageError, match="expected 'motion/1'"):
        decode(msgpack.packb(fields), Motion)


@pytest.mark.parametrize("message_type", MESSAGES, ids=schema_of)
def test_a_missing_field_is_refused_and_named(message_type) -> None:
    example = next(example for example in EXAMPLES if type(example) is message_type)
    required = [name for name, f in message_type.model_fields.items() if f.is_required()]
    for name in [*required, "source", "seq"]:
        spoiled = msgpack.unpackb(encode(example, ENVELOPE))
        del spoiled[name]
        with pytest.raises(RefusedMessageError, match=name):
            decode(msgpack.packb(spoiled), message_type)


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -float("inf")])
@pytest.mark.parametrize("name", ["position", "velocity", "orientation", "wrench"])
def test_a_number_that_is_not_finite_is_refused_in_every_array(fields, name, bad) -> None:
    numbers = np.frombuffer(fields[name]["data"]).copy()
    numbers[-1] = bad
    fields[name]["data"] = numbers.tobytes()
    with pytest.raises(RefusedMessageError, match=f"{name}.*not finite"):
        decode(msgpack.packb(fields), Motion)


def test_a_scalar_that_is_not_finite_is_refused() -> None:
    robot = next(example for example in EXAMPLES if isinstance(example, RobotState))
    spoiled = msgpack.unpackb(encode(robot, ENVELOPE))
    spoiled["nearest_distance_m"] = float("nan")
    with pytest.raises(RefusedMessageError, match="nearest_distance_m"):
        decode(msgpack.packb(spoiled), RobotState)


@pytest.mark.parametrize(
    "change",
    [
        {"shape": [2]},
        {"shape": [3, 1]},
        {"shape": []},
        {"shape": [-3]},
        {"shape": [True, 3]},
        {"shape": "3"},
        {"shape": [2**40]},
        {"shape": [2**63]},
        {"dtype": "<f4"},
        {"dtype": ">f8"},
        {"dtype": "|O"},
        {"dtype": None},
        {"data": b""},
        {"data": b"1234567"},
        {"data": "text"},
        {"data": [0.1, 0.2, 0.3]},
    ],
    ids=str,
)
def test_an_array_of_another_shape_dtype_or_length_is_refused(fields, change) -> None:
    fields["position"].update(change)
    with pytest.raises(RefusedMessageError, match="position"):
        decode(msgpack.packb(fields), Motion)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("dead_man", 1),
        ("dead_man", "yes"),
        ("seq", -1),
        ("seq", 1.0),
        ("seq", "1"),
        ("source", None),
        ("source", {"service": "", "instance": "a", "boot": "b"}),
        ("origin", {"boot": "b"}),
        ("position", None),
        ("position", 3),
        ("position", "0.1"),
        ("position", [0.1, 0.2, 0.3]),
        ("position", [[], None, {}]),
        ("position", [2**63, 0, {}]),
    ],
)
def test_a_mistyped_field_is_refused_and_named(fields, name, value) -> None:
    fields[name] = value
    with pytest.raises(RefusedMessageError, match=name):
        decode(msgpack.packb(fields), Motion)


def test_fields_of_a_newer_peer_are_ignored(fields) -> None:
    fields["brightness"] = {"lux": 300}
    fields["source"]["site"] = "Haifa"
    envelope, motion = decode(msgpack.packb(fields), Motion)
    assert envelope == ENVELOPE
    assert same(motion, MOTION)


def test_what_cannot_travel_is_a_type_error_of_the_sender() -> None:
    smuggled = MOTION.model_copy(update={"pedal": object()})
    with pytest.raises(TypeError, match="cannot travel"):
        encode(smuggled, ENVELOPE)


# --- bounds ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("message_type", MESSAGES, ids=schema_of)
def test_a_message_larger_than_its_bound_is_refused_undecoded(message_type) -> None:
    bound = BOUNDS[message_type]
    with pytest.raises(RefusedMessageError, match=f"expected at most {bound.size_bytes}"):
        decode(bytes(bound.size_bytes + 1), message_type)


@pytest.mark.parametrize("message_type", MESSAGES, ids=schema_of)
def test_the_example_of_a_message_is_well_within_its_bound(message_type) -> None:
    example = next(example for example in EXAMPLES if type(example) is message_type)
    assert len(encode(example, ENVELOPE)) < BOUNDS[message_type].size_bytes / 2


@pytest.mark.parametrize("message_type", MESSAGES, ids=schema_of)
def test_every_bound_has_its_reason(message_type) -> None:
    assert len(BOUNDS[message_type].reason.split()) >= 2
    assert BOUNDS[message_type].reason.endswith(".")


def crowded(schema: str) -> dict[str, Any]:
    """Values that are small on the wire and large in memory or in time."""
    return {
        "many fields": {"schema": schema, **{str(k): k for k in range(2000)}},
        "many elements": {"schema": schema, "x": [None] * 900_000},
        "many lists": {"schema": schema, "x": [[]] * 900_000},
        "many maps": {"schema": schema, "x": [{}] * 900_000},
        "lists of lists": {"schema": schema, "x": [[None] * 3000] * 300},
        "a huge name": {"schema": schema, "source": "x" * 900_000},
        "maps of maps": {"schema": schema, "x": [{"a": {"b": {}}}] * 100_000},
    }


@pytest.mark.parametrize("kind", crowded(""))
def test_the_elements_of_the_largest_published_message_are_counted_while_decoding(kind) -> None:
    schema = schema_of(Evidence)
    data = msgpack.packb(crowded(schema)[kind])
    assert len(data) < LARGEST_PUBLISHED_BYTES
    with pytest.raises(RefusedMessageError, match=r"exceeds max|more than|source"):
        decode(data, Evidence)


@pytest.mark.parametrize("depth", [100, 2000, 1_000_000])
def test_nesting_without_end_is_refused(depth) -> None:
    with pytest.raises(RefusedMessageError):
        decode(b"\x81\xa1x" + b"\x91" * depth, Evidence)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("seq", 2**53 + 1),
        ("seq", 2**64 - 1),
        ("origin", {"boot": "b", "seq": 2**60, "captured_ns": 0}),
    ],
)
def test_a_number_no_source_counts_to_is_refused(fields, name, value) -> None:
    fields[name] = value
    with pytest.raises(RefusedMessageError, match="beyond"):
        decode(msgpack.packb(fields), Motion)


@pytest.mark.parametrize("huge", [1e10, 1e154, 1.7e308, -1e300])
@pytest.mark.parametrize("name", ["position", "velocity", "wrench"])
def test_a_number_whose_square_would_be_lost_is_refused(fields, name, huge) -> None:
    numbers = np.frombuffer(fields[name]["data"]).copy()
    numbers[0] = huge
    fields[name]["data"] = numbers.tobytes()
    with pytest.raises(RefusedMessageError, match="beyond"):
        decode(msgpack.packb(fields), Motion)
