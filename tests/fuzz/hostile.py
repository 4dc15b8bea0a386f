"""What a hostile or broken sender may put on the wire, drawn at random from a seed.

Every message begins with a good one and spoils it: single bytes, fields of other types, numbers at
the edge of what there is, texts that mean something elsewhere, crowds of elements, nesting, sizes.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import msgpack
import numpy as np

from hmcs.bus.bounds import BOUNDS
from hmcs.bus.contract_page import published_keys
from hmcs.bus.examples import ENVELOPE, EXAMPLES
from hmcs.bus.keys import Keys
from hmcs.bus.messages import Message
from hmcs.bus.verbs import VERBS
from hmcs.bus.wire import encode

LARGEST_MESSAGE = 2 * 2**20
"""Nothing made here is larger, so that thousands of them fit through a router."""
TEXTS = (
    "", "x" * 65, "x" * 3000, "../../etc/passwd", "/etc/passwd", "--help", "-rf", "a\0b", "\x1b[2J",
    "<script>alert(1)</script>", "{{7*7}}", "%s%s%n", "\u202egnp.exe", "naïve", "\ud7ff", "NaN",
    "hmcs/@v1/*/**", "*", "$*", "?", "#", "@v1", " ", "\r\n", "lasa:GShape/1-99999", "serve",
)  # fmt: skip
NUMBERS = (
    0, 1, -1, 2**31 - 1, 2**31, -(2**31), 2**32, 2**53, 2**53 + 1, 2**62, 2**63 - 1, 2**63,
    2**64 - 1, -(2**63), 0.0, -0.0, 1e-308, 1e9, 1.0000001e9, 1e154, 1e308, -1e308,
    float("nan"), float("inf"), -float("inf"), 0.5, True, False,
)  # fmt: skip
SHAPES = ([3], [6], [0], [1], [2**31], [-1], [], [3, 1], [10**9, 10**9], ["3"], None, [3.0])

Fields = dict[str, Any]


class Hostile(NamedTuple):
    """One message on its way."""

    key: str
    payload: bytes
    attachment: bytes | None


def example_of(message_type: type[Message]) -> Fields:
    """Return a good message as the map it is on the wire."""
    example = next(example for example in EXAMPLES if type(example) is message_type)
    fields: Fields = msgpack.unpackb(encode(example, ENVELOPE))
    return fields


def published(cell: str, model: str, seed: int) -> Iterator[Hostile]:
    """Yield hostile messages on the keys of a cell without end, the same for the same seed."""
    draw = random.Random(seed)
    keys = {
        message: key.replace("MODEL", model).replace("INSTANCE", "anybody")
        for message, key in published_keys(Keys(cell)).items()
    }
    messages = list(keys)
    while True:
        message = draw.choice(messages)
        # Now and then on a key where something else is expected.
        key = keys[message] if draw.random() < 0.9 else draw.choice(list(keys.values()))
        sender = draw.choice(
            (None, b"", ENVELOPE.source.boot.encode(), draw.randbytes(8), b"x" * 5000)
        )
        yield Hostile(key, payload(message, draw), sender)


def questions(cell: str, instances: dict[str, str], seed: int) -> Iterator[Hostile]:
    """Yield hostile questions to the instances of services without end."""
    draw, keys = random.Random(seed), Keys(cell)
    asked = [
        (service, verb)
        for verb in VERBS
        for service in (verb.services or tuple(instances))
        if service in instances
    ]
    while True:
        service, verb = draw.choice(asked)
        key = keys.rpc(service, instances[service], verb.name)
        yield Hostile(key, payload(verb.question, draw), None)


def payload(message_type: type[Message], draw: random.Random) -> bytes:
    """Return a spoiled message of a type."""
    fields = example_of(message_type)
    for _ in range(draw.choice((0, 1, 1, 2, 4))):
        draw.choice(_SPOIL_FIELDS)(fields, draw)
    data = _packed(fields)
    for _ in range(draw.choice((0, 0, 0, 1, 3))):
        data = draw.choice(_SPOIL_BYTES)(data, draw)
    if draw.random() < 0.002:
        data = bytes(min(BOUNDS[message_type].size_bytes + 1, LARGEST_MESSAGE))
    return data[:LARGEST_MESSAGE]


def _packed(fields: Fields) -> bytes:
    try:
        data: bytes = msgpack.packb(fields)
    except (ValueError, OverflowError, TypeError, UnicodeEncodeError):
        data = b"\x80"
    return data


# --- fields ---------------------------------------------------------------------------------------


def _any_value(draw: random.Random) -> Any:
    return draw.choice(
        (
            lambda: draw.choice(TEXTS),
            lambda: draw.choice(NUMBERS),
            lambda: None,
            lambda: [],
            lambda: {},
            lambda: draw.randbytes(draw.choice((0, 1, 24, 1000))),
            lambda: [draw.choice(NUMBERS)] * draw.choice((1, 3, 5000)),
            lambda: [draw.choice(TEXTS)] * draw.choice((1, 3, 5000)),
            lambda: {draw.choice(TEXTS): draw.choice(NUMBERS)},
            lambda: _nested(draw.choice((3, 100, 600))),
            lambda: _array(draw),
        )
    )()


def _nested(depth: int) -> Any:
    value: Any = None
    for _ in range(depth):
        value = [value]
    return value


def _array(draw: random.Random) -> Fields:
    numbers = [float(draw.choice(NUMBERS)) for _ in range(draw.choice((0, 1, 3, 4, 6, 1000)))]
    return {
        "dtype": draw.choice(("<f8", "<f4", "<i4", ">f8", "O", "|S8", "", 7, "<f8" * 1000)),
        "shape": draw.choice((*SHAPES, [len(numbers)])),
        "data": np.array(numbers).tobytes(),
    }


def _replace(fields: Fields, draw: random.Random) -> None:
    fields[draw.choice(list(fields))] = _any_value(draw)


def _drop(fields: Fields, draw: random.Random) -> None:
    if len(fields) > 1:
        del fields[draw.choice(list(fields))]


def _add(fields: Fields, draw: random.Random) -> None:
    fields[draw.choice(TEXTS)] = _any_value(draw)


def _crowd(fields: Fields, draw: random.Random) -> None:
    count = draw.choice((10, 300, 3000))
    fields.update({str(number): number for number in range(count)})


def _other_numbers(fields: Fields, draw: random.Random) -> None:
    arrays = [
        name
        for name, value in fields.items()
        # Those that are still good, and no other spoiled ones.
        if isinstance(value, dict)
        and value.get("dtype") in ("<f8", "<f4", "<i4")
        and isinstance(value.get("data"), bytes)
        and len(value["data"]) % 8 == 0
    ]
    if arrays:
        array = fields[draw.choice(arrays)]
        numbers = np.frombuffer(array["data"], array["dtype"]).copy()
        if numbers.size:
            with np.errstate(all="ignore"):
                numbers[draw.randrange(numbers.size)] = np.float64(draw.choice(NUMBERS)).astype(
                    numbers.dtype
                )
            array["data"] = numbers.tobytes()


def _other_source(fields: Fields, draw: random.Random) -> None:
    fields["source"] = {
        "service": draw.choice((*TEXTS, "input_device", "fixture_controller", "robot")),
        "instance": draw.choice(TEXTS),
        "boot": draw.choice((ENVELOPE.source.boot, *TEXTS)),
    }


def _other_counts(fields: Fields, draw: random.Random) -> None:
    for name in ("seq", "step", "index", "segment_start", "valid_for_ns", "count", "before"):
        if name in fields or name == "seq":
            fields[name] = draw.choice(NUMBERS)


_SPOIL_FIELDS: tuple[Callable[[Fields, random.Random], None], ...] = (
    _replace,
    _drop,
    _add,
    _crowd,
    _other_numbers,
    _other_source,
    _other_counts,
)


# --- bytes ----------------------------------------------------------------------------------------


def _flip(data: bytes, draw: random.Random) -> bytes:
    where = draw.randrange(max(len(data), 1))
    return data[:where] + draw.randbytes(1) + data[where + 1 :]


def _cut(data: bytes, draw: random.Random) -> bytes:
    return data[: draw.randrange(len(data) + 1)]


def _go_on(data: bytes, draw: random.Random) -> bytes:
    return data + draw.randbytes(draw.choice((1, 100, 5000)))


def _lie_about_length(data: bytes, draw: random.Random) -> bytes:
    heads = (
        b"\xdf\xff\xff\xff\xff",
        b"\xdd\xff\xff\xff\xff",
        b"\xc6\xff\xff\xff\xff",
        b"\xdb\x7f\xff\xff\xff",
    )
    return draw.choice(heads) + data


_SPOIL_BYTES: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    _flip,
    _cut,
    _go_on,
    _lie_about_length,
    lambda data, draw: draw.randbytes(draw.choice((0, 1, 50, 3000))),
)
