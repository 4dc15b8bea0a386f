"""What pages say is read strictly, whatever a browser sends; frames and all."""

from __future__ import annotations

from typing import Any

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.frames import Frame, Opcode
from websockets.protocol import State
from websockets.server import ServerProtocol

from hmcs_console.serving.frames import (
    MOST_BYTES_A_S,
    MOST_FRAMES_A_S,
    MOST_NONSENSE,
    Incoming,
)
from hmcs_console.serving.said_by_pages import (
    LONGEST_BYTES,
    HostileError,
    NonsenseError,
    said,
)

NAN, INFINITY = float("nan"), float("inf")
CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": [1, 0.0, 0.0, 0.0],
    "position": [0.0, 1.5, 2],
    "fov": 1.3,
    "near": 0.01,
    "far": 1000,
    "image_height": 600,
    "image_width": 800,
    "look_at": [0.0, 0.0, 0.0],
    "up_direction": [0.0, 0.0, 1.0],
}
MOVED = {
    "type": "TransformControlsUpdateMessage",
    "name": "/handle",
    "owner": "0",
    "wxyz": [1.0, 0.0, 0.0, 0.0],
    "position": [0.5, 0.0, 0.4],
}
CHANGED = {"type": "GuiUpdateMessage", "uuid": "abc", "updates": {"value": "text"}}
FRIENDLY: tuple[dict[str, Any], ...] = (
    CAMERA,
    MOVED,
    {"type": "TransformControlsDragStartMessage", "name": "/handle", "owner": "0"},
    {"type": "TransformControlsDragEndMessage", "name": "/handle", "owner": "0"},
    CHANGED,
    CHANGED | {"updates": {"value": True}},
    CHANGED | {"updates": {"value": 0.5}},
    CHANGED | {"updates": {"value": [0.5, 1]}},
    {"type": "GuiButtonHoldMessage", "uuid": "abc", "frequency": 10},
    {"type": "CommandTriggerMessage", "uuid": "abc"},
    {
        "type": "LocalStorageGetItemResponseMessage",
        "value": None,
        "error": None,
        "request_uuid": "abc",
    },
)
HOSTILE: tuple[Any, ...] = (
    None,
    7,
    [],
    {},
    {"type": 7},
    {"type": ["GuiUpdateMessage"]},
    {"type": "RunJavascriptMessage", "source": "alert(1)"},
    {"type": "ShareUrlRequest"},
    {"type": "FileTransferStartUpload", "transfer_uuid": "a", "size_bytes": 2**40},
    {"type": "GuiCloseModalMessage", "uuid": "a"},
    {"type": "TransformControlsDragStartMessage"},
    {"type": "TransformControlsDragStartMessage", "name": 5, "owner": "0"},
    {"type": "TransformControlsDragStartMessage", "name": "x" * 65, "owner": "0"},
    CHANGED | {"uuid": 5},
    CHANGED | {"updates": None},
    CHANGED | {"updates": {}},
    CHANGED | {"updates": {"removed": True}},
    CHANGED | {"updates": {"value": 1.0, "update_cb": []}},
    CHANGED | {"updates": {"value": None}},
    CHANGED | {"updates": {"value": {"a": 1}}},
    CHANGED | {"updates": {"value": b"bytes"}},
    CHANGED | {"updates": {"value": [[1.0]]}},
    CHANGED | {"updates": {"value": ["a"]}},
    CHANGED | {"updates": {"value": []}},
    CHANGED | {"updates": {"value": [1.0] * 9}},
    CHANGED | {"updates": {"value": NAN}},
    CHANGED | {"updates": {"value": 1e300}},
    CHANGED | {"updates": {"value": "x" * 8193}},
    CHANGED | {"more": 1},
    CAMERA | {"more": 1},
    {"type": "GuiButtonHoldMessage", "uuid": "a", "frequency": "often"},
    {"type": "LocalStorageGetItemResponseMessage", "value": 5, "error": None, "request_uuid": "a"},
)
NONSENSE: tuple[dict[str, Any], ...] = (
    MOVED | {"position": [0.0, 0.0]},
    MOVED | {"position": []},
    MOVED | {"position": [NAN, 0.0, 0.0]},
    MOVED | {"position": [1e300, 0.0, 0.0]},
    MOVED | {"position": "here"},
    MOVED | {"wxyz": None},
    CAMERA | {"fov": INFINITY},
    CAMERA | {"look_at": [NAN] * 3},
    CAMERA | {"image_width": -1},
)


@pytest.mark.parametrize("reported", FRIENDLY, ids=lambda reported: reported["type"])
def test_what_a_page_says_is_handed_on(reported: dict[str, Any]) -> None:
    assert msgpack.unpackb(said(msgpack.packb(reported))) == reported


@pytest.mark.parametrize("reported", HOSTILE, ids=str)
def test_what_no_page_says_is_hostile(reported: Any) -> None:
    with pytest.raises(HostileError):
        said(msgpack.packb(reported))


@pytest.mark.parametrize("reported", NONSENSE, ids=str)
def test_a_pose_that_is_none_is_nonsense(reported: dict[str, Any]) -> None:
    with pytest.raises(NonsenseError):
        said(msgpack.packb(reported))


@pytest.mark.parametrize(
    "data", [b"", b"\xc1", b"\x91" * 60_000, msgpack.packb(CAMERA) + b"\x00", b"\xd4\x05\x00"]
)
def test_what_is_no_message_is_hostile(data: bytes) -> None:
    with pytest.raises(HostileError):
        said(data)


VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats()
    | st.text()
    | st.binary(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=8,
)


@given(st.sampled_from(FRIENDLY), st.dictionaries(st.text(max_size=8), VALUES, max_size=2), VALUES)
def test_anything_is_handed_on_or_refused(
    reported: dict[str, Any], more: dict[str, Any], value: Any
) -> None:
    for data in (reported | more, reported | dict.fromkeys(list(reported)[1:2], value)):
        try:
            handed_on = said(msgpack.packb(data))
        except (HostileError, NonsenseError):
            continue
        assert msgpack.unpackb(handed_on)["type"] == reported["type"]


def framed(*messages: Any, opcode: Opcode = Opcode.BINARY) -> bytes:
    return b"".join(
        Frame(opcode, msgpack.packb(message)).serialize(mask=True) for message in messages
    )


def read(data: bytes) -> list[Any]:
    """What the page's own server reads of frames."""
    server = ServerProtocol(state=State.OPEN)
    server.receive_data(data)
    assert server.parser_exc is None
    return [msgpack.unpackb(bytes(event.data)) for event in server.events_received()]  # type: ignore[union-attr]


class Door:
    """What comes in, at a time that stands."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.left_out: list[str] = []
        self.incoming = Incoming(lambda: self.now_s, self.left_out.append)

    def take(self, data: bytes) -> bytes:
        return self.incoming.take(data)


@given(st.integers(1, 40))
def test_frames_come_through_however_they_are_cut(size: int) -> None:
    data, door = framed(*FRIENDLY), Door()
    parts = [data[begin : begin + size] for begin in range(0, len(data), size)]
    assert read(b"".join(map(door.take, parts))) == list(FRIENDLY)


def test_a_message_in_parts_is_one() -> None:
    packed = msgpack.packb(CAMERA)
    parts = (
        Frame(Opcode.BINARY, packed[:5], fin=False),
        Frame(Opcode.PING, b"x"),
        Frame(Opcode.CONT, packed[5:], fin=True),
    )
    handed_on = Door().take(b"".join(part.serialize(mask=True) for part in parts))
    server = ServerProtocol(state=State.OPEN)
    server.receive_data(handed_on)
    events = server.events_received()
    assert [event.opcode for event in events] == [Opcode.PING, Opcode.BINARY]  # type: ignore[union-attr]


def test_nonsense_is_left_out_and_the_rest_comes_through() -> None:
    door = Door()
    assert read(door.take(framed(MOVED, NONSENSE[0], CHANGED))) == [MOVED, CHANGED]
    assert len(door.left_out) == 1


def test_nothing_but_nonsense_is_hostile() -> None:
    door = Door()
    for _ in range(MOST_NONSENSE):
        door.take(framed(NONSENSE[0]))
    with pytest.raises(HostileError, match="nonsense"):
        door.take(framed(NONSENSE[0]))


@pytest.mark.parametrize(
    "data",
    [
        framed("x", opcode=Opcode.TEXT),
        Frame(Opcode.BINARY, msgpack.packb(CAMERA)).serialize(mask=False),
        b"\xf2\x80\x00\x00\x00\x00",
        b"\x83\x80\x00\x00\x00\x00",
        b"\x80\x80\x00\x00\x00\x00",
        b"\x82\xff" + (2**40).to_bytes(8, "big") + b"\x00" * 4,
        Frame(Opcode.BINARY, b"x" * (LONGEST_BYTES + 1)).serialize(mask=True),
        Frame(Opcode.BINARY, b"x" * LONGEST_BYTES, fin=False).serialize(mask=True)
        + Frame(Opcode.CONT, b"x", fin=False).serialize(mask=True),
        b"GET / HTTP/1.1\r\n\r\n",
    ],
    ids=(
        "text",
        "unmasked",
        "reserved bits",
        "reserved kind",
        "part of nothing",
        "said to be huge",
        "too long",
        "too long in parts",
        "no frame",
    ),
)
def test_frames_that_no_browser_sends_are_hostile(data: bytes) -> None:
    with pytest.raises(HostileError):
        Door().take(data)


@given(st.binary(max_size=300))
def test_any_bytes_are_frames_or_hostile(data: bytes) -> None:
    door = Door()
    try:
        door.take(data)
    except HostileError:
        return
    read_on = ServerProtocol(state=State.OPEN)
    read_on.receive_data(door.take(b""))
    assert read_on.parser_exc is None


def test_more_than_a_browser_sends_in_a_second_is_hostile() -> None:
    ping, door = Frame(Opcode.PING, b"").serialize(mask=True), Door()
    for _ in range(3):
        door.take(ping * MOST_FRAMES_A_S)
        door.now_s += 1.0
    with pytest.raises(HostileError, match="frames a second"):
        door.take(ping * (MOST_FRAMES_A_S + 1))


def test_more_bytes_than_a_browser_sends_in_a_second_are_hostile() -> None:
    pong, door = Frame(Opcode.PONG, b"x" * 125).serialize(mask=True), Door()
    for _ in range(3):
        door.take(pong * (MOST_FRAMES_A_S // 2))
        door.now_s += 1.0
    with pytest.raises(HostileError, match="bytes a second"):
        door.take(pong * (MOST_BYTES_A_S // len(pong) + 1))
