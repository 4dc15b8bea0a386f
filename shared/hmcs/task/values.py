"""Values that the fields of a task file are made of, each checked for itself."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
_SUM_TOLERANCE = 1e-6
_UNIT_TOLERANCE = 1e-3


def _name(name: str) -> str:
    # The same names `hmcs.bus.keys` admits, which this module must not know.
    if not _NAME.fullmatch(name):
        raise ValueError(
            f"{name!r} cannot be part of a key, expected 1 to 64 letters, digits, '.', '_' or '-', "
            "beginning with a letter or digit"
        )
    return name


def _uniform(value: Any) -> Any:
    if not isinstance(value, (list, tuple)):
        return value
    if not all(isinstance(item, str) for item in value):
        raise ValueError("expected a list of names, or a mapping of names to probabilities")
    twice = sorted(name for name, times in Counter(value).items() if times > 1)
    if twice:
        raise ValueError(f"{', '.join(twice)} stands twice in the list, expected each name once")
    return {name: 1.0 / len(value) for name in value}


def _distribution(value: dict[str, float]) -> dict[str, float]:
    for name, probability in value.items():
        if not 0 < probability <= 1:
            raise ValueError(f"probability of {name} is {probability:g}, expected 0 < p <= 1")
    total = sum(value.values())
    if value and abs(total - 1) > _SUM_TOLERANCE:
        raise ValueError(
            f"probabilities sum to {total:g}, expected 1 (a plain list of names makes them equal)"
        )
    return value


def _unit(quaternion: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    length = sum(q * q for q in quaternion) ** 0.5
    if abs(length - 1) > _UNIT_TOLERANCE:
        raise ValueError(f"quaternion x y z w has length {length:g}, expected 1")
    return quaternion


def different(value: tuple[str, ...]) -> tuple[str, ...]:
    """Return axes of which each is named once, with either sign; raises ValueError otherwise."""
    axes = [axis.removeprefix("-") for axis in value]
    if len(set(axes)) < len(axes):
        raise ValueError(f"axes are {', '.join(value)}, expected each axis once")
    return value


def unknown_name_message(what: str, name: str, choices: Iterable[str]) -> str:
    """Return a sentence that says a name is unknown, which is nearest, and what there is."""
    choices = sorted(choices)
    near = get_close_matches(name, choices, n=1)
    guess = f", did you mean {near[0]}?" if near else ""
    return f"unknown {what} {name!r}{guess} (choose of: {', '.join(choices)})"


Name = Annotated[str, AfterValidator(_name)]
Distribution = Annotated[
    dict[Name, float], BeforeValidator(_uniform), AfterValidator(_distribution)
]
Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Point = tuple[Number, Number, Number]
Rotation = Annotated[tuple[Number, Number, Number, Number], AfterValidator(_unit)]
Axis = Literal["x", "y", "z"]
SignedAxis = Literal["x", "y", "z", "-x", "-y", "-z"]
TWIST_AXES = ("vx", "vy", "vz", "wx", "wy", "wz")
"""Of a twist, linear part first."""
AXES: Mapping[str, int] = {"x": 0, "y": 1, "z": 2}
"""Where each axis stands in a position."""


class Part(BaseModel):
    """A part of a task: frozen, and unknown fields are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)
