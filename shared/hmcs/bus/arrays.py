"""Arrays as message fields: numpy inside, little-endian float bytes with their shape on the wire.

On the wire an array is the map `{"dtype": "<f8", "shape": [3], "data": <24 bytes>}`. Whatever is
read is checked for type, shape and finiteness before anything else sees it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import core_schema

Dimension = int | None

FROM_WIRE = "from wire"
"""Validation context of what was received; see `ArraySpec.read`."""

UNIT_WITHIN = 1e-3
"""How much the length of a unit vector may differ from one."""

LARGEST = 1e9
"""No position, speed, force or time of a cell is beyond it in SI units; products and sums of what
is within stay finite."""


@dataclass(frozen=True)
class ArraySpec:
    """The dtypes and the shape a field admits; `None` in a shape is any length."""

    shape: tuple[Dimension, ...]
    dtypes: tuple[str, ...] = ("<f8",)
    unit: bool = False
    """Whether the numbers are those of a vector of length one, but for rounding."""

    def read(self, value: object, *, from_wire: bool = False) -> NDArray[Any]:
        """Return `value`, a wire map or an array-like, as a read-only array.

        From the wire only the map is admitted. Raises ValueError when it is none, when the dtype,
        the shape or the byte count is not what the field admits, a number is not finite or beyond
        LARGEST, or the length is not one where the field says so.
        """
        try:
            if isinstance(value, dict):
                array = self._from_wire(value)
            elif from_wire:
                raise ValueError("not an array: arrays travel as maps of dtype, shape and data")
            else:
                array = self._from_python(value)  # type: ignore[arg-type]
        except (TypeError, OverflowError) as error:
            # Only a ValueError becomes a refusal: bytes from anywhere must not get further.
            raise ValueError(f"not an array of numbers: {error}") from error
        if len(array.shape) != len(self.shape) or any(
            want is not None and want != got
            for want, got in zip(self.shape, array.shape, strict=True)
        ):
            raise ValueError(f"array has shape {array.shape}, expected {self.shape_text}")
        # A comparison with NaN is false, so that this refuses it as well.
        if array.dtype.kind == "f" and array.size and not np.abs(array).max() <= LARGEST:
            raise ValueError(f"array holds a number that is not finite or beyond {LARGEST:g}")
        if self.unit and abs(math.hypot(*array.tolist()) - 1.0) > UNIT_WITHIN:
            raise ValueError(f"array is {array.tolist()}, expected a length of 1")
        return array

    @property
    def shape_text(self) -> str:
        """The shape as text, `n` for any length."""
        return "(" + ", ".join("n" if n is None else str(n) for n in self.shape) + ")"

    def _from_wire(self, value: dict[Any, Any]) -> NDArray[Any]:
        dtype, shape, data = value.get("dtype"), value.get("shape"), value.get("data")
        if dtype not in self.dtypes:
            raise ValueError(f"array has dtype {dtype!r}, expected one of {', '.join(self.dtypes)}")
        if not isinstance(data, bytes):
            raise ValueError("array has no bytes under 'data'")
        if not isinstance(shape, (tuple, list)) or not all(
            type(n) is int and n >= 0 for n in shape
        ):
            raise ValueError(f"array has shape {shape!r}, expected lengths")
        return np.frombuffer(data, dtype=dtype).reshape(shape)

    def _from_python(self, value: ArrayLike) -> NDArray[Any]:
        array = np.asarray(value)
        if array.dtype.str not in self.dtypes:
            array = array.astype(self.dtypes[0], casting="same_kind" if array.size else "unsafe")
        if array.flags.writeable:
            array = array.copy()
            array.flags.writeable = False
        return array

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        return core_schema.with_info_plain_validator_function(
            lambda value, info: self.read(value, from_wire=info.context is FROM_WIRE),
            serialization=core_schema.plain_serializer_function_ser_schema(to_wire),
        )

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return {
            "type": "object",
            "description": f"array of shape {self.shape_text}, little-endian, C order"
            + (", a vector of length 1" if self.unit else ""),
            "properties": {
                "dtype": {"enum": list(self.dtypes)},
                "shape": {
                    "type": "array",
                    "prefixItems": [
                        {"type": "integer"} if n is None else {"const": n} for n in self.shape
                    ],
                    "items": False,
                },
                "data": {"type": "string", "format": "binary"},
            },
            "required": ["dtype", "shape", "data"],
        }


def to_wire(array: NDArray[Any]) -> dict[str, Any]:
    """Return the wire map of `array`."""
    return {"dtype": array.dtype.str, "shape": array.shape, "data": array.tobytes()}


Vector3 = Annotated[NDArray[np.float64], ArraySpec((3,))]
"""Three numbers along x, y, z."""
Quaternion = Annotated[NDArray[np.float64], ArraySpec((4,), unit=True)]
"""A rotation as x, y, z, w, of length one."""
Vector6 = Annotated[NDArray[np.float64], ArraySpec((6,))]
"""A twist or a wrench: linear x, y, z, then angular x, y, z."""
Floats = Annotated[NDArray[np.float64], ArraySpec((None,))]
"""Any number of float64."""
Points = Annotated[NDArray[np.float64], ArraySpec((None, 3))]
"""Any number of points, each along x, y, z."""
EvidenceFloats = Annotated[NDArray[Any], ArraySpec((None,), ("<f4", "<f8"))]
"""Any number of float32, or of float64 where the sender was set to it."""
Indices = Annotated[NDArray[np.int32], ArraySpec((None,), ("<i4",))]
"""Any number of int32."""
