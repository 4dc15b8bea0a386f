"""What to take of a recording of another program, and how to read it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from hmcs.errors import UserError

METERS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
"""Units of length, in m."""
RADIANS = {"rad": 1.0, "deg": 0.017453292519943295}
"""Units of angle, in rad."""
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""Units of time, in s."""
ISO = "iso"
"""Times are dates, as ISO 8601 has them."""
ROLES = (
    *("time", "x", "y", "z", "qx", "qy", "qz", "qw"),
    *("fx", "fy", "fz", "tx", "ty", "tz", "state"),
)
"""What a column may be, as it is named in `--columns`."""
_MARK = re.compile(r"(\d{1,4})=(\S.*)")


@dataclass(frozen=True)
class Choices:
    """What a person said of a recording; what is empty is found in the file."""

    topics: tuple[str, ...] = ()
    """Topics, or features of a LeRobot data set."""
    columns: Mapping[str, str] = field(default_factory=dict)
    """The name of a column, or of a number in a feature, by its role."""
    length: str = ""
    """Unit of positions."""
    angle: str = ""
    """Unit of joint positions."""
    time: str = ""
    """Unit of times, or ISO."""
    urdf: Path | None = None
    """Of the robot whose joint positions were recorded."""
    link: str = ""
    """Of it, that is the tool."""
    marks: Mapping[int, str] = field(default_factory=dict)
    """The state that begins where a button of a joystick is pressed, by the button's number."""


AS_IT_IS = Choices()
"""Nothing was said."""


def choices_of(
    *,
    topics: Sequence[str] = (),
    columns: str = "",
    units: Sequence[str] = (),
    time: str = "",
    urdf: Path | None = None,
    link: str = "",
    marks: str = "",
) -> Choices:
    """Return choices given as text, as on a command line; UserError for what is none."""
    lengths, angles = _units(units)
    if time and time not in (*SECONDS, ISO):
        raise UserError(f"--time {time}: expected one of {', '.join((*SECONDS, ISO))}")
    if link and urdf is None:
        raise UserError(f"--link {link}: is a link of a URDF: name that by --urdf")
    if urdf is not None and not urdf.is_file():
        raise UserError(f"--urdf {urdf}: no such file")
    return Choices(tuple(topics), _columns(columns), lengths, angles, time, urdf, link,
                   _marks(marks))  # fmt: skip


def _units(units: Sequence[str]) -> tuple[str, str]:
    lengths = [unit for unit in units if unit in METERS]
    angles = [unit for unit in units if unit in RADIANS]
    known = (*METERS, *RADIANS)
    for unit in units:
        if unit not in known:
            raise UserError(f"--unit {unit}: expected one of {', '.join(known)}")
    for several in (lengths, angles):
        if len(set(several)) > 1:
            raise UserError(
                f"--unit {' --unit '.join(several)}: one recording has one unit of it: name one, "
                "and read files of other units apart"
            )
    return next(iter(lengths), ""), next(iter(angles), "")


def _columns(text: str) -> dict[str, str]:
    found = dict[str, str]()
    for item in filter(None, (part.strip() for part in text.split(","))):
        role, equals, name = (part.strip() for part in item.partition("="))
        if not (equals and name) or role not in ROLES:
            raise UserError(
                f"--columns {item}: write ROLE=COLUMN,…, e.g. time=stamp,x=tcp_x,y=tcp_y; roles "
                f"are {' '.join(ROLES)}"
            )
        if role in found:
            raise UserError(f"--columns {text}: {role} is there twice: name one column for it")
        found[role] = name
    return found


def _marks(text: str) -> dict[int, str]:
    found = dict[int, str]()
    for item in filter(None, (part.strip() for part in text.split(","))):
        match = _MARK.fullmatch(item)
        if match is None or not match[2].isprintable():
            raise UserError(f"--marks {item}: write BUTTON=STATE,…, e.g. 0=approach,1=insert")
        found[int(match[1])] = match[2]
    return found
