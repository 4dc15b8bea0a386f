"""Where it travels: every key expression of the protocol is built here and nowhere else.

A key is `hmcs/@v1/{cell}/…`. A *cell* is one operator with one robot; two cells on one router do
not see each other. `@v1` is a verbatim chunk: no wildcard of another version matches it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

from hmcs.errors import UserError

PREFIX = "hmcs/@v1"
ANY = "*"
"""Matches one whole chunk; admitted by the methods of `Keys` wherever they take a name."""

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
_LONGEST_NAME = 64


class KeyNameError(UserError, ValueError):
    """A name that cannot be part of a key."""


def recognizer_in(key: str) -> Recognizer:
    """Return the model and the instance that a belief or evidence key of any cell names.

    Raises KeyNameError for any other key.
    """
    chunks = key.removeprefix(f"{PREFIX}/").split("/")[1:]
    if len(chunks) in (3, 4) and chunks[0] == "model" and chunks[2] in ("belief", "evidence"):
        return Recognizer(chunks[1], chunks[3] if len(chunks) == 4 else "")
    raise KeyNameError(f"{key!r} is no belief or evidence key")


def is_name(text: str) -> bool:
    """Return whether `text` can be one chunk of a key; see `check_name`."""
    return len(text) <= _LONGEST_NAME and _matches(text)


@lru_cache(maxsize=1024)
def _matches(text: str) -> bool:
    # Every message names its source: the same few names over and over.
    return _NAME.fullmatch(text) is not None


def check_name(what: str, name: str) -> str:
    """Return `name` if it can be one chunk of a key.

    Raises KeyNameError for anything but 1 to 64 letters, digits, `.`, `_`, `-`, beginning with a
    letter or digit; so for `*`, `$`, `/`, `?`, `#`, `@`, which mean something in a key.
    """
    if not is_name(name):
        raise KeyNameError(
            f"{what} {name!r} cannot be part of a key: use 1 to 64 letters, digits, '.', '_' or "
            "'-', beginning with a letter or digit"
        )
    return name


class Member(NamedTuple):
    """A service instance as a presence key names it."""

    service: str
    instance: str


class Recognizer(NamedTuple):
    """One process that speaks for a model, as a belief or evidence key names it."""

    model: str
    instance: str
    """Empty in recordings made before keys of beliefs named it."""


@dataclass(frozen=True)
class Keys:
    """The keys of one cell.

    Raises KeyNameError for a cell that cannot be part of a key; so do all methods for their names.
    """

    cell: str

    def __post_init__(self) -> None:
        check_name("cell", self.cell)

    @property
    def motion(self) -> str:
        """Motion, input device to fixture controller."""
        return self._key("input", "motion")

    @property
    def step(self) -> str:
        """Step, input device to classifiers."""
        return self._key("input", "step")

    @property
    def command(self) -> str:
        """Command, fixture controller to robot."""
        return self._key("fixture", "command")

    @property
    def fixture_state(self) -> str:
        """FixtureState, fixture controller to all."""
        return self._key("fixture", "state")

    @property
    def pairing(self) -> str:
        """Pairing, fixture controller to all."""
        return self._key("fixture", "pairing")

    @property
    def stop_request(self) -> str:
        """StopRequest: anybody who watches over the cell to every robot."""
        return self._key("robot", "stop")

    @property
    def robot_state(self) -> str:
        """RobotState, robot to all."""
        return self._key("robot", "state")

    @property
    def handle(self) -> str:
        """Handle, the operator's page to the input device."""
        return self._key("input", "handle")

    @property
    def label(self) -> str:
        """Label: any process that hears the operator to the recorder."""
        return self._key("input", "label")

    @property
    def training(self) -> str:
        """TrainingProgress, trainer to all."""
        return self._key("trainer", "progress")

    @property
    def everything(self) -> str:
        """Whatever is published in the cell."""
        return self._key("**")

    def evidence(self, model: str, instance: str = ANY) -> str:
        """Evidence, a classifier to the task HMM of the same model."""
        return self._key("model", _chunk("model", model), "evidence", _chunk("instance", instance))

    def belief(self, model: str = ANY, instance: str = ANY) -> str:
        """Belief, a task HMM to the fixture controller."""
        return self._key("model", _chunk("model", model), "belief", _chunk("instance", instance))

    def member(self, model: str, service: str = ANY, instance: str = ANY) -> str:
        """Liveliness token of a process that works for a model, replayed and ready."""
        return self._key(
            "model",
            _chunk("model", model),
            "member",
            _chunk("service", service),
            _chunk("instance", instance),
        )

    def presence(self, service: str = ANY, instance: str = ANY) -> str:
        """Liveliness token of a process."""
        return self._key("presence", _chunk("service", service), _chunk("instance", instance))

    def rpc(self, service: str, instance: str, verb: str) -> str:
        """A question a process answers."""
        return self._key(
            "rpc", _chunk("service", service), _chunk("instance", instance), _chunk("verb", verb)
        )

    def member_of(self, key: str) -> Member:
        """Return the service and instance a presence or member key names.

        Raises KeyNameError for any other key.
        """
        chunks = key.removeprefix(f"{PREFIX}/{self.cell}/").split("/")
        if (len(chunks), chunks[0]) == (3, "presence") or (
            len(chunks) == 5 and (chunks[0], chunks[2]) == ("model", "member")
        ):
            return Member(chunks[-2], chunks[-1])
        raise KeyNameError(f"{key!r} is no presence or member key of cell {self.cell!r}")

    def model_of(self, key: str) -> str:
        """Return the model a member key names. Raises KeyNameError for any other key."""
        chunks = key.removeprefix(f"{PREFIX}/{self.cell}/").split("/")
        if len(chunks) == 5 and (chunks[0], chunks[2]) == ("model", "member"):
            return chunks[1]
        raise KeyNameError(f"{key!r} is no member key of cell {self.cell!r}")

    def _key(self, *chunks: str) -> str:
        return "/".join((PREFIX, self.cell, *chunks))


def _chunk(what: str, name: str) -> str:
    return name if name == ANY else check_name(what, name)
