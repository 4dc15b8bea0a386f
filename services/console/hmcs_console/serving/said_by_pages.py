"""What a page of a browser may say: messages of the library it is served by, read strictly.

A viewer that was let in, or a program on this machine, may say anything. The library
believes all of it: a message that is none ends a task with a traceback, one with other fields than
a page has changes how it works, one that uploads fills the memory. So only what this page has use
for is handed on, made anew from what was read.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

import msgpack
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

LONGEST_BYTES = 65_536
"""Of a message."""
_FARTHEST = 1e9

Number = Annotated[float, Field(ge=-_FARTHEST, le=_FARTHEST)]
Triple = Annotated[list[Number], Field(min_length=3, max_length=3)]
Turn = Annotated[list[Number], Field(min_length=4, max_length=4)]
Id = Annotated[str, Field(max_length=64)]
Text = Annotated[str, Field(max_length=8192)]
Pixels = Annotated[int, Field(ge=0, le=100_000)]
Value = bool | Number | Text | Annotated[list[Number], Field(min_length=1, max_length=8)]


class HostileError(ValueError):
    """A message that no page sends."""


class NonsenseError(ValueError):
    """A message that a page sends, with a pose that is none: it may be left out."""


class _Said(BaseModel):
    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)


class _Camera(_Said):
    type: Literal["ViewerCameraMessage"]
    wxyz: Turn
    position: Triple
    fov: Number
    near: Number
    far: Number
    image_height: Pixels
    image_width: Pixels
    look_at: Triple
    up_direction: Triple


class _HandleMoved(_Said):
    type: Literal["TransformControlsUpdateMessage"]
    name: Id
    owner: Id
    wxyz: Turn
    position: Triple


class _HandleHeld(_Said):
    type: Literal["TransformControlsDragStartMessage", "TransformControlsDragEndMessage"]
    name: Id
    owner: Id


class _Update(_Said):
    value: Value


class _Changed(_Said):
    type: Literal["GuiUpdateMessage"]
    uuid: Id
    updates: _Update


class _ButtonHeld(_Said):
    type: Literal["GuiButtonHoldMessage"]
    uuid: Id
    frequency: Number


class _Commanded(_Said):
    type: Literal["CommandTriggerMessage"]
    uuid: Id


class _Alive(_Said):
    type: Literal["LocalStorageGetItemResponseMessage"]
    value: Text | None
    error: Text | None
    request_uuid: Id


_SAID: TypeAdapter[_Said] = TypeAdapter(
    Annotated[
        _Camera | _HandleMoved | _HandleHeld | _Changed | _ButtonHeld | _Commanded | _Alive,
        Field(discriminator="type"),
    ]
)
_POSES = ("ViewerCameraMessage", "TransformControlsUpdateMessage")
_POSE_FIELDS = set(_Camera.model_fields) | set(_HandleMoved.model_fields)


def said(data: bytes) -> bytes:
    """Return a message of a page to be handed on.

    Raises NonsenseError for a pose that is none, and HostileError for everything else that a page
    of this console does not say.
    """
    try:
        content: Any = msgpack.unpackb(data, max_ext_len=0)
    except (ValueError, TypeError, msgpack.UnpackException, RecursionError) as error:
        raise HostileError(f"no message: {type(error).__name__}") from None
    try:
        read = _SAID.validate_python(content)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False, include_input=False)[0]
        what = f"{first['msg']} at {'.'.join(map(str, first['loc']))}"
        if (
            isinstance(content, dict)
            and content.get("type") in _POSES
            and content.keys() <= _POSE_FIELDS
        ):
            raise NonsenseError(what) from None
        raise HostileError(what) from None
    packed = msgpack.packb(read.model_dump())
    assert isinstance(packed, bytes)
    return packed
