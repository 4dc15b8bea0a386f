"""Data sets of LeRobot, versions 2.1 and 3.0: one demonstration for every episode.

A folder with `meta/info.json` and tables in Parquet under `data/`. Positions are numbers of one
feature, e.g. `observation.state`, by their names in `meta/info.json`, or follow from its joint
positions by a URDF. Pictures are not looked at.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.bounded_files import read_bounded
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.forward_kinematics import Chain, poses, read_chain
from hmcs.recordings.demonstrations import MOST_DEMONSTRATIONS
from hmcs.recordings.foreign.choices import METERS, RADIANS, Choices
from hmcs.recordings.foreign.columns import FORCE, PLACE, TURN, columns_in
from hmcs.recordings.foreign.lerobot_tables import INFO, STATE, Feature, Frames, episodes_of
from hmcs.recordings.foreign.tracks import Track, demonstration_of
from hmcs.recordings.reading import RecordingError
from hmcs.recordings.stretches import NS_PER_S

MOST_INFO_BYTES = 16 * 1024 * 1024
MOST_NUMBERS = 512
"""Of a feature."""
FEATURES = ("observation.state", "action")
"""Of which the first that is there is taken by itself."""
_JOINT_ENDINGS = (".pos", "_pos", ".position", "_position")


def episodes_in(folder: Path, choices: Choices) -> tuple[list[Demonstration], tuple[str, ...]]:
    """Return a demonstration for every episode, and what was taken for it.

    Raises RecordingError for a folder that is no such data set, for a feature that is not there or
    whose numbers are not named, and for a frame that is none.
    """
    info = _info(folder)
    feature = _feature(folder, info, choices)
    where = f"{folder}: {feature.name}"
    placed, said = _placed(where, feature, choices)
    labeled = STATE in info["features"]
    shown, notes = list[Demonstration](), [said]
    for frames in episodes_of(folder, feature, labeled=labeled):
        if len(shown) == MOST_DEMONSTRATIONS:
            raise RecordingError(f"{folder}: more than {MOST_DEMONSTRATIONS} episodes")
        episode = f"{where}, episode {frames.episode}"
        own, noted = _demonstration(f"{folder.name}#{frames.episode}", episode, frames, placed)
        shown.append(own)
        notes += noted
    if not shown:
        raise RecordingError(f"{folder}: has no frame under data/: was it copied whole?")
    return shown, tuple(notes)


class _Placed(NamedTuple):
    """How numbers of a feature become poses and forces."""

    place: tuple[int, ...]
    size_m: float
    turn: tuple[int, ...]
    force: tuple[int, ...]
    chain: Chain | None
    joints: tuple[str, ...]
    scale: tuple[float, ...]
    """Of the joints' positions."""

    def motion(self, values: Array) -> Array:
        if self.chain is not None:
            indices = list(self.place)
            return np.hstack(poses(self.chain, self.joints, values[:, indices] * self.scale))
        places = values[:, list(self.place)] * self.size_m
        if places.shape[1] < 3:
            places = np.hstack([places, np.zeros((len(places), 1))])
        return np.hstack([places, values[:, list(self.turn)]])


def _placed(where: str, feature: Feature, choices: Choices) -> tuple[_Placed, str]:
    if choices.urdf is not None:
        return _by_joints(where, feature, choices, read_chain(choices.urdf, choices.link))
    columns = columns_in(feature.names, choices, where)
    if not {"x", "y"} <= columns.keys():
        raise RecordingError(
            f"{where}: which of its numbers are the position of the tool? Say by --columns "
            f"x=NAME,y=NAME,z=NAME, or name the robot by --urdf FILE; they are named "
            f"{', '.join(feature.names[:40])}"
        )
    place = tuple(columns[axis].at for axis in PLACE if axis in columns)
    turn, force = (
        tuple(columns[part].at for part in parts) if set(parts) <= columns.keys() else ()
        for parts in (TURN, FORCE)
    )
    unit = choices.length or next((columns[a].unit for a in PLACE if a in columns), "") or "m"
    if unit not in METERS:
        raise RecordingError(f"{where}: positions in {unit!r}: say their unit by --unit")
    taken = ", ".join(f"{role}={column.name}" for role, column in columns.items())
    said = f"{where}: {taken}; positions in {unit}"
    return _Placed(place, METERS[unit], turn, force, None, (), ()), said


def _by_joints(where: str, feature: Feature, choices: Choices, chain: Chain) -> tuple[_Placed, str]:
    names = [_joint_name(name) for name in feature.names]
    absent = [name for name in chain.names if name not in names]
    if absent:
        raise RecordingError(
            f"{where}: the chain to link {chain.link!r} of {chain.file} needs the joints "
            f"{', '.join(absent[:20])}; its numbers are named {', '.join(feature.names[:40])}"
        )
    place = tuple(names.index(name) for name in chain.names)
    angle, length = choices.angle or "rad", choices.length or "m"
    scale = tuple(
        RADIANS[angle] if name in chain.turning else METERS[length] for name in chain.names
    )
    said = f"{where}: joint positions in {angle}, of link {chain.link!r} of {chain.file}"
    return _Placed(place, 1.0, (), (), chain, chain.names, scale), said


def _joint_name(name: str) -> str:
    return next((name.removesuffix(end) for end in _JOINT_ENDINGS if name.endswith(end)), name)


def _demonstration(
    name: str, where: str, frames: Frames, placed: _Placed
) -> tuple[Demonstration, list[str]]:
    values = np.array(frames.values)
    time_ns = np.round((np.array(frames.time_s) - frames.time_s[0]) * NS_PER_S).astype(np.int64)
    back = np.flatnonzero(np.diff(time_ns) <= 0)
    if len(back):
        raise RecordingError(
            f"{where}: frame {back[0] + 1} is not later than the one before: times must rise"
        )
    wrong = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if len(wrong):
        raise RecordingError(
            f"{where}: frame {wrong[0]} has a number that is not finite: take the episode out"
        )
    force = Track(time_ns, values[:, list(placed.force)]) if placed.force else None
    motion = Track(time_ns, placed.motion(values))
    shown, notes = demonstration_of(name, where, motion, force)
    return shown._replace(states=tuple(frames.states)), notes


def _info(folder: Path) -> Mapping[str, Any]:
    file = folder / INFO
    try:
        info = json.loads(read_bounded(file, MOST_INFO_BYTES))
        version, features = str(info["codebase_version"]), info["features"]
        if not version.startswith(("v2.", "v3.")):
            raise RecordingError(
                f"{file}: is of version {version[:20]!r}, expected v2.1 or v3.0: convert it with "
                "LeRobot"
            )
        if not all(isinstance(each, dict) for each in features.values()):
            raise TypeError("features")
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise RecordingError(
            f"{file}: does not describe a data set of LeRobot ({type(error).__name__}: "
            f"{str(error)[:80]})"
        ) from error
    return info  # type: ignore[no-any-return]


def _feature(folder: Path, info: Mapping[str, Any], choices: Choices) -> Feature:
    features: Mapping[str, Any] = info["features"]
    vectors = [name for name in features if _width(features[name])]
    if len(choices.topics) > 1:
        raise RecordingError(f"{folder}: --topic names one feature of it: {', '.join(vectors)}")
    wanted = choices.topics[0] if choices.topics else next(
        (name for name in FEATURES if name in vectors), ""
    )  # fmt: skip
    if wanted not in vectors:
        raise RecordingError(
            f"{folder}: has no feature {wanted or ' or '.join(FEATURES)!r} of numbers; name one by "
            f"--topic: {', '.join(vectors[:40]) or 'there is none'}"
        )
    names = _names(features[wanted].get("names"))
    width = _width(features[wanted])
    if len(names) != width:
        names = tuple(str(number) for number in range(width))
    return Feature(wanted, names)


def _width(feature: Mapping[str, Any]) -> int:
    """How many numbers a feature has; 0 for pictures and texts."""
    shape = feature.get("shape")
    numbers = str(feature.get("dtype", "")).startswith("float")
    if not (isinstance(shape, list) and len(shape) == 1 and isinstance(shape[0], int)):
        return 0
    return shape[0] if numbers and 1 < shape[0] <= MOST_NUMBERS else 0


def _names(given: Any) -> tuple[str, ...]:
    """Names of numbers: a list, or lists by what they are of."""
    if isinstance(given, dict):
        return tuple(name for each in given.values() for name in _names(each))
    return tuple(str(each) for each in given) if isinstance(given, list) else ()
