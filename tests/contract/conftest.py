"""Any valid message, made from the fields of its model."""

from __future__ import annotations

import types
import typing
from collections.abc import Callable
from typing import Any, Literal, get_args, get_origin

import annotated_types
import numpy as np
import pytest
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from pydantic import AfterValidator, BaseModel

from hmcs.bus.arrays import LARGEST, ArraySpec
from hmcs.bus.messages import Envelope, Message
from hmcs.bus.messages.fields import Within

Any_ = st.SearchStrategy[Any]


@pytest.fixture(scope="session")
def any_message() -> Callable[[type[Message]], Any_]:
    """Strategies for valid messages of a type."""
    return _model


@pytest.fixture(scope="session")
def any_envelope() -> Any_:
    return _model(Envelope)


def _model(model: type[BaseModel]) -> Any_:
    return st.builds(
        model,
        **{
            name: _value(field.annotation, list(field.metadata))
            for name, field in model.model_fields.items()
        },
    )


def _value(annotation: Any, metadata: list[Any]) -> Any_:
    origin, args = get_origin(annotation), get_args(annotation)
    if origin is typing.Annotated:
        inner = [rule for part in args[1:] for rule in getattr(part, "metadata", [part])]
        return _value(args[0], [*inner, *metadata])
    if origin is Literal:
        return st.sampled_from(args)
    if origin in (types.UnionType, typing.Union):
        return st.one_of(*(_value(arg, metadata) for arg in args))
    if origin is tuple:
        return st.lists(_value(args[0], []), max_size=4).map(tuple)
    if origin is dict:
        values = st.integers(0, 9) if args[1] is Any else _value(args[1], [])
        return st.dictionaries(st.text(max_size=8), values, max_size=3)
    spec = next((rule for rule in metadata if isinstance(rule, ArraySpec)), None)
    return _array(spec) if spec else _scalar(annotation, metadata)


def _array(spec: ArraySpec) -> Any_:
    shape = st.tuples(*(st.integers(0, 5) if n is None else st.just(n) for n in spec.shape))

    def arrays(dtype: str) -> Any_:
        elements = (
            {"min_value": -LARGEST, "max_value": LARGEST} if np.dtype(dtype).kind == "f" else {}
        )
        made = npst.arrays(dtype, shape, elements=elements)
        return made.map(_of_unit_length) if spec.unit else made

    return st.sampled_from(spec.dtypes).flatmap(arrays)


def _of_unit_length(array: Any) -> Any:
    vector = np.clip(array, -1, 1)
    vector[0] = 1.0
    return vector / np.linalg.norm(vector)


def _scalar(annotation: Any, metadata: list[Any]) -> Any_:
    if annotation is bytes:
        return st.binary(max_size=8)

    def bound(rule_type: type, name: str) -> Any:
        return next((getattr(r, name) for r in metadata if isinstance(r, rule_type)), None)

    low = bound(annotated_types.Ge, "ge")
    above = bound(annotated_types.Gt, "gt")
    high = bound(annotated_types.Le, "le")
    if annotation is bool:
        return st.booleans()
    within = bound(Within, "largest")
    if annotation is int:
        low = above + 1 if above is not None else low
        most = 2**63 - 1 if within is None else within
        return st.integers(-most if low is None else low, most if high is None else high)
    if annotation is float:
        most = None if within is None else within
        low = -most if low is None and most is not None else low
        return st.floats(low, most if high is None else high, allow_nan=False, allow_infinity=False)
    if annotation is str:
        if any(isinstance(rule, AfterValidator) for rule in metadata):
            return st.from_regex(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", fullmatch=True)
        shortest = bound(annotated_types.MinLen, "min_length") or 0
        return st.text(min_size=shortest, max_size=bound(annotated_types.MaxLen, "max_length") or 9)
    if annotation is type(None):
        return st.none()
    return _model(annotation)
