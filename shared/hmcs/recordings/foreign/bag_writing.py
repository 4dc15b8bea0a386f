"""A recording as a bag of ROS 2 (MCAP), for the tools of ROS and of Foxglove.

| message | topics |
|---|---|
| Motion | PoseStamped, TwistStamped, WrenchStamped of the hand, frame `operator` |
| RobotState | PoseStamped and TwistStamped of the tool, frame `base`; JointState |
| Belief, Label | String with the fields as JSON |
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

from hmcs.bus.messages import Belief, Label, Motion, RobotState
from hmcs.bus.messages import Message as BusMessage
from hmcs.recordings.foreign.libraries import missing
from hmcs.recordings.foxglove import BASE, OPERATOR
from hmcs.recordings.reading import Recorded, RecordingContent, RecordingError
from hmcs.whole_files import folder_written_whole

MOST_TOPICS = 256
VERSION: Literal[8] = 8
"""Of the bag's metadata, which ROS 2 Jazzy and later read."""
_NOT_IN_NAMES = re.compile(r"[^A-Za-z0-9_/]")
_STANDS = (0.0, 0.0, 0.0, 1.0)


class _Sent(NamedTuple):
    topic: str
    type_name: str
    message: Any


def write_bag(content: RecordingContent, folder: Path) -> int:
    """Write a recording as the folder of a bag; return how many messages it has.

    Raises FileExistsError where there is such a folder, OSError as writing does, RecordingError
    where it has nothing that ROS has a message for, and MissingLibraryError without `rosbags`.
    """
    try:
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise missing("ros", "bags are written by rosbags, which is not here") from error
    types = get_typestore(Stores.ROS2_HUMBLE)
    made = _Messages(types.types)
    count, connections = 0, dict[str, Any]()
    with folder_written_whole(folder) as beside:
        bag = beside / folder.name
        with Writer(bag, version=VERSION, storage_plugin=StoragePlugin.MCAP) as writer:
            kinds = (Motion, RobotState, Belief, Label)
            for recorded, _, message in content.of_any(*kinds):
                for topic, name, sent in made.of(recorded, message):
                    if topic not in connections:
                        if len(connections) == MOST_TOPICS:
                            raise RecordingError(f"{content.path}: more than {MOST_TOPICS} topics")
                        added = writer.add_connection(topic, name, typestore=types)
                        connections[topic] = added
                    data = types.serialize_cdr(sent, name)
                    writer.write(connections[topic], recorded.log_ns, data)
                    count += 1
        if not count:
            raise RecordingError(f"{content.path}: has no motion, no robot and no belief to export")
    return count


class _Messages:
    """Makes messages of ROS."""

    def __init__(self, types: Any) -> None:
        self._types = types

    def of(self, recorded: Recorded, message: BusMessage) -> Iterator[_Sent]:
        """Yield what ROS has for one of our messages."""
        topic = _topic(recorded.key)
        if isinstance(message, Motion):
            header = self._header(recorded, OPERATOR)
            turn = _STANDS if message.orientation is None else message.orientation.tolist()
            yield self._pose(topic, header, message.position.tolist(), turn)
            turning = message.angular_velocity
            spin = [0.0] * 3 if turning is None else turning.tolist()
            yield self._twist(topic, header, [*message.velocity.tolist(), *spin])
            if message.wrench is not None:
                yield self._wrench(topic, header, message.wrench.tolist())
        elif isinstance(message, RobotState):
            header = self._header(recorded, BASE)
            turn = message.tool_orientation.tolist()
            yield self._pose(topic, header, message.tool_position.tolist(), turn)
            yield self._twist(topic, header, message.tool_twist.tolist())
            yield self._joints(topic, header, message)
        else:
            fields = json.dumps(recorded.fields, separators=(",", ":"))
            yield self._sent(topic, "std_msgs/msg/String", data=fields)

    def _sent(self, topic: str, type_name: str, **fields: Any) -> _Sent:
        return _Sent(topic, type_name, self._types[type_name](**fields))

    def _header(self, recorded: Recorded, frame: str) -> Any:
        sec, nanosec = divmod(recorded.captured_ns, 10**9)
        stamp = self._types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
        return self._types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)

    def _vector(self, values: Sequence[float], name: str = "Vector3") -> Any:
        x, y, z = values
        return self._types[f"geometry_msgs/msg/{name}"](x=x, y=y, z=z)

    def _pose(
        self, topic: str, header: Any, place: Sequence[float], turn: Sequence[float]
    ) -> _Sent:
        x, y, z, w = turn
        pose = self._types["geometry_msgs/msg/Pose"](
            position=self._vector(place, "Point"),
            orientation=self._types["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w),
        )
        name = "geometry_msgs/msg/PoseStamped"
        return self._sent(f"{topic}/pose", name, header=header, pose=pose)

    def _twist(self, topic: str, header: Any, six: Sequence[float]) -> _Sent:
        twist = self._types["geometry_msgs/msg/Twist"](
            linear=self._vector(six[:3]), angular=self._vector(six[3:])
        )
        name = "geometry_msgs/msg/TwistStamped"
        return self._sent(f"{topic}/twist", name, header=header, twist=twist)

    def _wrench(self, topic: str, header: Any, six: Sequence[float]) -> _Sent:
        wrench = self._types["geometry_msgs/msg/Wrench"](
            force=self._vector(six[:3]), torque=self._vector(six[3:])
        )
        name = "geometry_msgs/msg/WrenchStamped"
        return self._sent(f"{topic}/wrench", name, header=header, wrench=wrench)

    def _joints(self, topic: str, header: Any, state: RobotState) -> _Sent:
        count = len(state.joint_positions)
        names = state.joint_names or tuple(f"joint_{k + 1}" for k in range(count))
        return self._sent(
            f"{topic}/joint_states",
            "sensor_msgs/msg/JointState",
            header=header,
            name=list(names),
            position=state.joint_positions,
            velocity=state.joint_velocities,
            effort=state.joint_velocities[:0],
        )


def _topic(key: str) -> str:
    """The name of a topic for a key, as ROS admits it."""
    # Ahead of the name of its channel each key has three parts that all keys of its cell have.
    words = _NOT_IN_NAMES.sub("_", "/".join(key.split("/")[3:]) or key).split("/")
    return "/hmcs/" + "/".join(f"_{w}" if w[0].isdigit() else w for w in words if w.strip("_"))
