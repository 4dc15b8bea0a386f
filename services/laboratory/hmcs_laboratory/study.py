"""What a study is: a question, its settings, and what one trial measures."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, NamedTuple, TypeVar, get_origin

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from hmcs.errors import UserError
from hmcs.task.values import unknown_name_message

Scalar = str | int | float

TIMINGS = ("fit_s", "us_per_sample")
"""Measures that are times: all others are equal for equal seeds."""


class StudySettings(BaseModel):
    """The settings of a study: frozen, and unknown ones are refused.

    A setting of several values may be written as one text with commas between them.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", use_attribute_docstrings=True, allow_inf_nan=False
    )

    @model_validator(mode="before")
    @classmethod
    def _split(cls, given: Any) -> Any:
        if not isinstance(given, Mapping):
            return given
        return {
            name: value.split(",") if isinstance(value, str) and _is_several(cls, name) else value
            for name, value in given.items()
        }


class Measured(NamedTuple):
    """What one trial measured of one method at one setting."""

    method: str
    setting: Mapping[str, Scalar]
    """The settings that vary within the study, e.g. `{"noise": 0.15}`."""
    measures: Mapping[str, float]
    """E.g. `{"accuracy": 0.98}`; NaN where there was nothing to measure."""


Settings = TypeVar("Settings", bound=StudySettings)


@dataclass(frozen=True)
class Study(Generic[Settings]):
    """A question answered by repeated trials."""

    name: str
    line: str
    """What it asks, in one line."""
    source: str
    """Figure or section of the thesis, or paper."""
    settings: type[Settings]
    trial: Callable[[Settings, np.random.Generator], Sequence[Measured]]
    """Measures every method at every setting once, with random numbers from the generator only."""
    trials: int = 10
    """How many are made by default."""
    tiny: Mapping[str, str] = field(default_factory=dict)
    """Settings with which a trial takes a second or so."""
    left_out: Callable[[Settings], str] = lambda _: ""
    """Returns a line about methods that this machine lacks the libraries for; empty where none."""
    table: tuple[str, ...] = ()
    """The columns of its table, where there are more than fit; all where empty."""
    picture: str = ""
    """`module:function` that draws its rows; empty where a table says it all. Named, since drawing
    takes a second to import."""

    def settings_from(self, assignments: Sequence[str]) -> Settings:
        """Return the settings with those assigned as `NAME=VALUE`, the others as by default.

        Raises UserError for an unknown setting or a value that is none, naming the choices.
        """
        given: dict[str, str] = {}
        for assignment in assignments:
            name, equals, value = assignment.partition("=")
            if not equals:
                raise UserError(f"--set {assignment}: write NAME=VALUE, e.g. --set noise=0.3")
            if name not in self.settings.model_fields:
                raise UserError(
                    f"study {self.name!r}: "
                    + unknown_name_message("setting", name, self.settings.model_fields)
                )
            given[name] = value
        try:
            return self.settings.model_validate(given)
        except ValidationError as error:
            found = error.errors(include_url=False)[0]
            what = found["msg"].removeprefix("Value error, ")
            if found["loc"]:
                name = str(found["loc"][0])
                about = self.settings.model_fields[name].description
                what = f"{name}={given[name]}: {what}"
                what += f" ({' '.join(about.split())})" if about else ""
            raise UserError(f"study {self.name!r}: {what}") from error


def known_once(what: str, names: tuple[str, ...], known: Sequence[str]) -> tuple[str, ...]:
    """Return names that are all known and stand once; raises ValueError otherwise."""
    for name in names:
        if name not in known:
            raise ValueError(unknown_name_message(what, name, known))
    if len(set(names)) < len(names):
        raise ValueError(f"{', '.join(names)}: expected every {what} once")
    return names


def stream_of(method: str, seed: int) -> np.random.Generator:
    """Return the random stream of a method: the same whatever other methods are measured."""
    return np.random.default_rng([seed, zlib.crc32(method.encode())])


def seed_from(rng: np.random.Generator) -> int:
    """Return a seed for `stream_of` drawn from a trial's generator."""
    return int(rng.integers(2**32))


def _is_several(settings: type[BaseModel], name: str) -> bool:
    known = settings.model_fields.get(name)
    return known is not None and get_origin(known.annotation) is tuple
