"""Recordings of other programs, made by their own libraries."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as arrow
import pyarrow.parquet as parquet
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2
from mcap.writer import CompressionType, Writer
from rosbags import rosbag1, rosbag2
from rosbags.rosbag2.enums import StoragePlugin
from rosbags.typesys import Stores, get_typestore

from hmcs.arrays import Array

BEGUN_NS = 1_790_000_000_000_000_000
PERIOD_NS = 10_000_000
SAMPLES = 50
ROS2, ROS1 = get_typestore(Stores.ROS2_HUMBLE), get_typestore(Stores.ROS1_NOETIC)
Sent = tuple[str, int, Any]
"""Topic, log time, message."""

ARM = """<robot name="planar">
  <link name="base"/><link name="upper"/><link name="lower"/><link name="slide"/>
  <link name="tool0"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><origin xyz="0 0 0.3"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/>
  </joint>
  <joint name="elbow" type="continuous">
    <parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/><axis xyz="0 0 2"/>
  </joint>
  <joint name="rail" type="prismatic">
    <parent link="lower"/><child link="slide"/><origin xyz="0.3 0 0"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/>
  </joint>
  <joint name="mount" type="fixed">
    <parent link="slide"/><child link="tool0"/><origin rpy="0 1.5707963267948966 0"/>
  </joint>
</robot>
"""


def way(samples: int = SAMPLES) -> Array:
    """Return positions of a hand that goes a curve, m, shape (T, 3)."""
    s = np.linspace(0.0, 1.0, samples)
    return np.stack([0.3 * s, 0.1 * np.sin(3 * s), 0.05 * s * s], axis=1)


def times_ns(samples: int = SAMPLES) -> list[int]:
    return [BEGUN_NS + k * PERIOD_NS for k in range(samples)]


def header(types: Any, ns: int, frame: str = "base") -> Any:
    stamp = types.types["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)
    more = {"seq": 0} if types is ROS1 else {}
    return types.types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame, **more)


def vector(types: Any, values: Sequence[float], name: str = "Vector3") -> Any:
    x, y, z = map(float, values)
    return types.types[f"geometry_msgs/msg/{name}"](x=x, y=y, z=z)


def pose(types: Any, at: Sequence[float], turn: Sequence[float] = (0.0, 0.0, 0.0, 1.0)) -> Any:
    x, y, z, w = map(float, turn)
    return types.types["geometry_msgs/msg/Pose"](
        position=vector(types, at, "Point"),
        orientation=types.types["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w),
    )


def pose_stamped(types: Any, ns: int, at: Sequence[float], frame: str = "base") -> Any:
    made = types.types["geometry_msgs/msg/PoseStamped"]
    return made(header=header(types, ns, frame), pose=pose(types, at))


def twist_stamped(types: Any, ns: int, six: Sequence[float]) -> Any:
    linear, angular = vector(types, six[:3]), vector(types, six[3:])
    twist = types.types["geometry_msgs/msg/Twist"](linear=linear, angular=angular)
    return types.types["geometry_msgs/msg/TwistStamped"](header=header(types, ns), twist=twist)


def odometry(types: Any, ns: int, at: Sequence[float]) -> Any:
    no = np.zeros(36)
    twist = types.types["geometry_msgs/msg/Twist"](
        linear=vector(types, (0, 0, 0)), angular=vector(types, (0, 0, 0))
    )
    return types.types["nav_msgs/msg/Odometry"](
        header=header(types, ns),
        child_frame_id="tool",
        pose=types.types["geometry_msgs/msg/PoseWithCovariance"](
            pose=pose(types, at), covariance=no
        ),
        twist=types.types["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=no),
    )


def wrench_stamped(types: Any, ns: int, six: Sequence[float]) -> Any:
    wrench = types.types["geometry_msgs/msg/Wrench"](
        force=vector(types, six[:3]), torque=vector(types, six[3:])
    )
    return types.types["geometry_msgs/msg/WrenchStamped"](header=header(types, ns), wrench=wrench)


def joint_state(types: Any, ns: int, names: Sequence[str], positions: Sequence[float]) -> Any:
    return types.types["sensor_msgs/msg/JointState"](
        header=header(types, ns),
        name=list(names),
        position=np.array(positions, dtype=float),
        velocity=np.zeros(0),
        effort=np.zeros(0),
    )


def joy(types: Any, ns: int, buttons: Sequence[int]) -> Any:
    return types.types["sensor_msgs/msg/Joy"](
        header=header(types, ns),
        axes=np.zeros(0, np.float32),
        buttons=np.array(buttons, np.int32),
    )


def poses_sent(types: Any = ROS2, topic: str = "/tool_pose") -> list[Sent]:
    rows = zip(times_ns(), way(), strict=True)
    return [(topic, ns, pose_stamped(types, ns, at)) for ns, at in rows]


def write_bag1(path: Path, sent: Sequence[Sent], packing: str = "") -> Path:
    writer = rosbag1.Writer(path)
    if packing:
        writer.set_compression(rosbag1.Writer.CompressionFormat[packing])
    with writer:
        connections = dict[str, Any]()
        for topic, ns, message in sent:
            name = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, name, typestore=ROS1)
            writer.write(connections[topic], ns, ROS1.serialize_ros1(message, name))
    return path


def write_bag2(folder: Path, sent: Sequence[Sent], storage: str = "sqlite3") -> Path:
    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    with rosbag2.Writer(folder, version=9, storage_plugin=plugin) as writer:
        connections = dict[str, Any]()
        for topic, ns, message in sent:
            name = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, name, typestore=ROS2)
            writer.write(connections[topic], ns, ROS2.serialize_cdr(message, name))
    return folder


def write_json_mcap(
    path: Path, sent: Sequence[tuple[str, int, Mapping[str, Any]]], schema: str = "tool"
) -> Path:
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD)
        writer.start("", "another program")
        number = writer.register_schema(schema, "jsonschema", b'{"type": "object"}')
        channels = dict[str, int]()
        for topic, ns, fields in sent:
            if topic not in channels:
                channels[topic] = writer.register_channel(topic, "json", number)
            text = json.dumps(fields).encode()
            writer.add_message(channels[topic], ns, text, ns)
        writer.finish()
    return path


def write_protobuf_mcap(path: Path, positions: Array, described: bool = True) -> Path:
    """Write poses in a type as Foxglove's `PoseInFrame`, described within the file by Protobuf."""
    described_set = descriptor_pb2.FileDescriptorSet()
    timestamp_pb2.DESCRIPTOR.CopyToProto(described_set.file.add())
    file = described_set.file.add(name="pose.proto", package="lab", syntax="proto3")
    file.dependency.append("google/protobuf/timestamp.proto")
    number, text, inner = 1, 9, 11
    for name, parts in {
        "Vector": [(axis, number, "") for axis in "xyz"],
        "Pose": [("position", inner, ".lab.Vector")],
        "PoseInFrame": [
            ("timestamp", inner, ".google.protobuf.Timestamp"),
            ("frame_id", text, ""),
            ("pose", inner, ".lab.Pose"),
        ],
    }.items():
        message = file.message_type.add(name=name)
        for place, (field, kind, type_name) in enumerate(parts, start=1):
            message.field.add(
                name=field, number=place, label=1, type=kind, type_name=type_name or None
            )
    pool = descriptor_pool.DescriptorPool()
    for each in described_set.file:
        pool.Add(each)
    made = message_factory.GetMessageClass(pool.FindMessageTypeByName("lab.PoseInFrame"))
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD)
        writer.start("", "another program")
        data = described_set.SerializeToString() if described else b""
        schema = writer.register_schema("lab.PoseInFrame", "protobuf", data)
        channel = writer.register_channel("/tool", "protobuf", schema)
        for ns, (x, y, z) in zip(times_ns(len(positions)), positions.tolist(), strict=True):
            said = made(frame_id="base")
            said.timestamp.seconds, said.timestamp.nanos = divmod(ns, 10**9)
            said.pose.position.x, said.pose.position.y, said.pose.position.z = x, y, z
            # The messages came a while later than their own times say.
            writer.add_message(channel, ns + 5 * 10**9, said.SerializeToString(), ns)
        writer.finish()
    return path


def write_lerobot(
    folder: Path,
    episodes: Sequence[Array],
    names: Sequence[str],
    *,
    version: str = "v2.1",
    feature: str = "observation.state",
    fps: int = 50,
) -> Path:
    """Write each episode's vectors, shape (T, n), as LeRobot lays them out."""
    width = len(names)
    info = {
        "codebase_version": version,
        "fps": fps,
        "features": {
            feature: {"dtype": "float32", "shape": [width], "names": list(names)},
            "timestamp": {"dtype": "float32", "shape": [1], "names": None},
        },
    }
    (folder / "meta").mkdir(parents=True)
    (folder / "meta" / "info.json").write_text(json.dumps(info))
    chunk = folder / "data" / "chunk-000"
    chunk.mkdir(parents=True)
    tables = []
    for number, values in enumerate(episodes):
        count = len(values)
        vectors = arrow.FixedSizeListArray.from_arrays(
            arrow.array(np.asarray(values, np.float32).ravel()), width
        )
        times = arrow.array((np.arange(count) / fps).astype(np.float32))
        tables.append(
            arrow.table(
                {
                    feature: vectors,
                    "timestamp": times,
                    "episode_index": arrow.array([number] * count, arrow.int64()),
                }
            )
        )
    if version.startswith("v3"):
        parquet.write_table(arrow.concat_tables(tables), chunk / "file-000.parquet")
    else:
        for number, table in enumerate(tables):
            parquet.write_table(table, chunk / f"episode_{number:06d}.parquet")
    return folder
