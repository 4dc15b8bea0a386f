"""Messages of ROS by the library `rosbags`.

Types are those that ROS ships, never those that a file describes: a description in a file is a
program of its author's.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from hmcs.recordings.foreign.libraries import missing
from hmcs.recordings.foreign.said import Said, said_by
from hmcs.recordings.reading import RecordingError

LARGEST_MESSAGE_BYTES = 4 * 1024 * 1024
"""Of a message that is read; of those that are read here none has a thousandth of it."""


@cache
def _types(ros1: bool) -> Any:
    try:
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise missing("ros", "messages of ROS are read by rosbags, which is not here") from error
    return get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)


def modern_name(type_name: str) -> str:
    """Return the name of a type as ROS 2 has it, e.g. of `geometry_msgs/PoseStamped`."""
    package, _, name = type_name.rpartition("/")
    return f"{package.removesuffix('/msg')}/msg/{name}" if package else type_name


def decoded(where: str, type_name: str, data: bytes, *, ros1: bool) -> Said:
    """Return what a message says; RecordingError where it is none of its type."""
    if len(data) > LARGEST_MESSAGE_BYTES:
        raise RecordingError(f"{where}: a message of {len(data) / 1e6:.0f} MB, which no pose has")
    types = _types(ros1)
    read = types.deserialize_ros1 if ros1 else types.deserialize_cdr
    try:
        return said_by(type_name, read(data, type_name))
    except MemoryError:
        raise
    # What damaged bytes make the library raise is of many kinds, assertions among them.
    except Exception as error:
        raise RecordingError(
            f"{where}: a message that is no {type_name} ({type(error).__name__}: "
            f"{str(error)[:80]}): is the file damaged?"
        ) from error
