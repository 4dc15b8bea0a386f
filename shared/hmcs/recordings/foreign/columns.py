"""Tables with columns of other names and units, as demonstrations: which column is what.

A header is enough by itself where its names are known ones and carry their units, e.g.
`timestamp_ms,tcp_x_mm,tcp_y_mm,tcp_z_mm`. Columns a person names come first.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from hmcs.errors import UserError
from hmcs.recordings.foreign.choices import METERS, RADIANS, ROLES, SECONDS, Choices

PLACE = ("x", "y", "z")
TURN = ("qx", "qy", "qz", "qw")
FORCE = ("fx", "fy", "fz", "tx", "ty", "tz")
_UNITS = {**METERS, **RADIANS, **SECONDS, "meters": 1.0, "sec": 1.0, "secs": 1.0, "seconds": 1.0,
          "n": 1.0, "nm": 1.0}  # fmt: skip
_SHORT = {"meters": "m", "sec": "s", "secs": "s", "seconds": "s"}
_WORDS = re.compile(r"[a-z]+|\d+")
_TIMES = frozenset({"t", "time", "timestamp", "stamp", "datetime", "clock"})
_STATES = frozenset({"state", "label", "phase"})
_OF_TOOL = frozenset(
    [
        "tcp",
        "ee",
        "eef",
        "tool",
        "hand",
        "pos",
        "position",
        "pose",
        "p",
        "field",
        "actual",
        "end",
        "effector",
        "translation",
        "point",
        "gripper",
        "robot",
        "measured",
        "current",
        "observation",
        "state",
        "world",
        "base",
    ]
)
_TURNS = frozenset(["orientation", "quat", "quaternion", "rot", "rotation", "q"])
_FORCES = frozenset(["force", "forces", "wrench", "f", "ft"])
_TORQUES = frozenset(["torque", "torques", "moment"])


class Column(NamedTuple):
    """A column that has a role."""

    at: int
    """Its place in a row."""
    name: str
    """As it is written."""
    unit: str
    """As the name says it; empty where it does not."""


def columns_in(names: Sequence[str], choices: Choices, where: str) -> dict[str, Column]:
    """Return the column of each role: as a person chose, else where one name alone may be it.

    Raises UserError where a chosen column is not there.
    """
    lower = [name.lower() for name in names]
    guesses = [_guessed(name) for name in names]
    found = dict[str, Column]()
    for role in ROLES:
        chosen = choices.columns.get(role)
        if chosen is not None:
            if chosen.lower() not in lower:
                raise UserError(
                    f"{where}: has no column {chosen!r} for {role}; it has {', '.join(names)}"
                )
            index = lower.index(chosen.lower())
            found[role] = Column(index, names[index], _unit_of(names[index]))
            continue
        own = [k for k, (guess, _) in enumerate(guesses) if guess == role]
        if len(own) == 1:
            found[role] = Column(own[0], names[own[0]], guesses[own[0]][1])
    return found


def several_units(columns: Mapping[str, Column]) -> str:
    """Return what to say where positions stand in more than one unit; else nothing."""
    units = {columns[role].unit for role in PLACE if role in columns} - {""}
    if len(units) < 2:
        return ""
    named = ", ".join(columns[role].name for role in PLACE if role in columns)
    return f"the columns {named} are in several units: give all positions in one"


def _words(name: str) -> list[str]:
    # Capitals begin words, as in tcpX.
    return _WORDS.findall(re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower())


def _unit_of(name: str) -> str:
    words = _words(name)
    return _SHORT.get(words[-1], words[-1]) if len(words) > 1 and words[-1] in _UNITS else ""


def _guessed(name: str) -> tuple[str, str]:
    """The role and the unit that a name says; empty where it says none."""
    words, unit = _words(name), _unit_of(name)
    if unit:
        words = words[:-1]
    if not words:
        return "", ""
    *before, last = words
    around = set(before)
    role = ""
    if last in _TIMES and not before:
        role = "time"
    elif last in _STATES and not before:
        role = "state"
    elif last in (*TURN, *FORCE) and around <= _OF_TOOL | _TURNS | _FORCES | _TORQUES:
        role = last
    elif last in (*PLACE, "w"):
        if around & _TURNS:
            role = f"q{last}"
        elif around & _TORQUES and last != "w":
            role = f"t{last}"
        elif around & _FORCES and last != "w":
            role = f"f{last}"
        elif around <= _OF_TOOL and last != "w":
            role = last
    return role, unit
