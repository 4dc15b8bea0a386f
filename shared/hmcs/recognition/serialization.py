"""What a recognizer knows as data: named arrays and plain JSON, and back.

Knowledge is a NamedTuple of arrays, numbers, strings, truth values, tuples and NamedTuples of
such. Any recognizer's can so be written to a model file without a line of its own for it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, TypeAdapter, ValidationError

from hmcs.errors import first_problem

AnyArray = NDArray[Any]
Knowledge = TypeVar("Knowledge")

_ARRAY = "$array"


class Content(NamedTuple):
    """Knowledge taken apart."""

    plain: Any
    """JSON; where an array stood there is `{"$array": its name}`."""
    arrays: Mapping[str, AnyArray]
    """By name: the fields that lead to it, joined by dots."""


class ContentError(ValueError):
    """Content that is no knowledge of the kind expected; says what is wrong with it."""


def to_arrays(knowledge: object) -> Content:
    """Return the content of a recognizer's knowledge.

    Raises TypeError for what is neither array, number, string, truth value, None, tuple nor
    NamedTuple of such.
    """
    arrays: dict[str, AnyArray] = {}
    return Content(_plain(knowledge, "", arrays), arrays)


def array_names(plain: Any) -> tuple[str, ...]:
    """Return the names of the arrays that plain content refers to, each once.

    Raises ContentError for a name that is none.
    """
    found: dict[str, None] = {}
    waiting = [plain]
    while waiting:
        value = waiting.pop()
        if isinstance(value, dict) and set(value) == {_ARRAY}:
            if not isinstance(value[_ARRAY], str):
                raise ContentError(f"array {value[_ARRAY]!r:.80}: expected its name")
            found[value[_ARRAY]] = None
        elif isinstance(value, dict):
            waiting += value.values()
        elif isinstance(value, list):
            waiting += value
    return tuple(found)


def from_arrays(kind: type[Knowledge], content: Content) -> Knowledge:
    """Return the knowledge of that kind.

    Raises ContentError when a field or an array is missing, or of another type, or holds a number
    that is not finite.
    """
    for name, array in content.arrays.items():
        if array.dtype.kind not in "fiub" or not np.isfinite(array).all():
            raise ContentError(f"array {name!r:.80} holds numbers that are not finite")
    adapter = TypeAdapter(
        kind, config=ConfigDict(arbitrary_types_allowed=True, allow_inf_nan=False)
    )
    try:
        return adapter.validate_python(_restored(content.plain, content.arrays))
    except ValidationError as error:
        where, why = first_problem(error)
        raise ContentError(f"{where}: {why}") from error


def _plain(value: object, name: str, arrays: dict[str, AnyArray]) -> Any:
    if isinstance(value, np.ndarray):
        arrays[name] = value
        return {_ARRAY: name}
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, tuple):
        inner = f"{name}." if name else ""
        fields = getattr(value, "_fields", None)
        if fields is None:
            return [_plain(item, f"{inner}{k}", arrays) for k, item in enumerate(value)]
        return {
            field: _plain(item, f"{inner}{field}", arrays)
            for field, item in zip(fields, value, strict=True)
        }
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise TypeError(f"{name} is a {type(value).__name__}: knowledge is made of arrays and tuples")


def _restored(plain: Any, arrays: Mapping[str, AnyArray]) -> Any:
    if isinstance(plain, list):
        return tuple(_restored(item, arrays) for item in plain)
    if isinstance(plain, dict):
        if set(plain) == {_ARRAY}:
            if plain[_ARRAY] not in arrays:
                raise ContentError(f"array {plain[_ARRAY]!r} is missing")
            return arrays[plain[_ARRAY]]
        return {field: _restored(item, arrays) for field, item in plain.items()}
    return plain
