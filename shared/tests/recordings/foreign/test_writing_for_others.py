"""Recordings of our own as bags of ROS 2 and data sets of LeRobot, read by their own libraries."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as parquet
import pytest
from rosbags.highlevel import AnyReader

from hmcs.bus.messages import Belief, Motion, RobotState
from hmcs.motion.demonstrations import Demonstration
from hmcs.recordings.demonstrations import demonstrations_of
from hmcs.recordings.foreign.bag_writing import write_bag
from hmcs.recordings.foreign.choices import choices_of
from hmcs.recordings.foreign.lerobot_writing import write_data_set
from hmcs.recordings.foreign.registry import format_of, take
from hmcs.recordings.reading import RecordingError, read
from support.recordings import BEGUN_NS, KEYS, Maker, Said

STATE = RobotState(
    robot="puma560",
    joint_names=("a", "b"),
    joint_positions=np.array([0.1, 0.2]),
    joint_velocities=np.array([0.3, 0.4]),
    tool_position=np.array([0.5, 0.6, 0.7]),
    tool_orientation=np.array([0.0, 0.0, 0.6, 0.8]),
    tool_twist=np.arange(6.0),
    reference_twist=np.zeros(6),
    nearest_obstacle="",
    nearest_distance_m=None,
    contacts=(),
    stop="none",
    limited=(),
)
BELIEF = Belief(
    model_hash="m",
    clock="clock",
    step=3,
    states=("go", "turn"),
    probabilities=np.array([0.25, 0.75]),
    likely_gesteme="",
    segment_start=0,
)
FELT = Motion(
    position=np.ones(3),
    velocity=np.zeros(3),
    orientation=np.array([0.0, 0.0, 0.0, 1.0]),
    wrench=np.arange(6.0),
    dead_man=True,
)


@pytest.fixture
def said(performed: Callable[..., list[Said]]) -> list[Said]:
    return [
        *performed(),
        (KEYS.robot_state, STATE),
        (KEYS.belief("m", "i"), BELIEF),
        (KEYS.motion, FELT),
    ]


def test_a_bag_of_ros_2_has_every_message(maker: Maker, said: list[Said], tmp_path: Path) -> None:
    content = read(maker.write(said))
    folder = tmp_path / "bag"
    count = write_bag(content, folder)
    found = dict[str, list[Any]]()
    with AnyReader([folder]) as reader:
        assert reader.message_count == count
        for connection, at_ns, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            found.setdefault(connection.topic, []).append((at_ns, message))
    motions = [body for _, body in said if isinstance(body, Motion)]
    poses = [message.pose.position for _, message in found["/hmcs/input/motion/pose"]]
    assert [(p.x, p.y, p.z) for p in poses] == [tuple(m.position) for m in motions]
    logged = [each.log_ns for each in content.messages if each.key == KEYS.motion]
    assert [at_ns for at_ns, _ in found["/hmcs/input/motion/pose"]] == logged
    ((_, felt),) = found["/hmcs/input/motion/wrench"]
    assert (felt.wrench.force.y, felt.wrench.torque.z) == (1.0, 5.0)
    ((_, joints),) = found["/hmcs/robot/state/joint_states"]
    assert (joints.name, joints.position.tolist()) == (["a", "b"], [0.1, 0.2])
    ((_, tool),) = found["/hmcs/robot/state/pose"]
    assert (tool.header.frame_id, tool.pose.orientation.w) == ("base", 0.8)
    ((_, twist),) = found["/hmcs/robot/state/twist"]
    assert (twist.twist.linear.y, twist.twist.angular.z) == (1.0, 5.0)
    ((_, belief),) = found["/hmcs/model/m/belief/i"]
    assert json.loads(belief.data)["probabilities"] == [0.25, 0.75]


def test_what_was_exported_as_a_bag_is_a_demonstration_again(
    maker: Maker, said: list[Said], tmp_path: Path
) -> None:
    folder = tmp_path / "bag"
    write_bag(read(maker.write(said)), folder)
    form = format_of(folder)
    assert form is not None
    (shown,) = take(form, folder, choices_of(topics=["/hmcs/input/motion/pose"])).demonstrations
    motions = [body.position for _, body in said if isinstance(body, Motion)]
    np.testing.assert_array_equal(shown.positions, motions)


def test_a_data_set_of_lerobot_has_an_episode_for_each_demonstration(
    maker: Maker, performed: Callable[..., list[Said]], tmp_path: Path
) -> None:
    shown = demonstrations_of(read(maker.write(performed(("go", None, "turn")))))
    assert len(shown) == 2
    folder = tmp_path / "set"
    frames = write_data_set(shown, folder, "shapes", fps=50)
    info = json.loads((folder / "meta" / "info.json").read_text())
    assert (info["total_episodes"], info["total_frames"], info["fps"]) == (2, frames, 50)
    rows = [json.loads(line) for line in (folder / "meta" / "episodes.jsonl").open()]
    stats = [json.loads(line) for line in (folder / "meta" / "episodes_stats.jsonl").open()]
    begin = 0
    for number, demonstration in enumerate(shown):
        path = info["data_path"].format(episode_chunk=0, episode_index=number)
        table = parquet.read_table(folder / path)
        assert set(table.column_names) == set(info["features"])
        for name, feature in info["features"].items():
            kind = table.schema.field(name).type
            if feature["shape"] != [1]:
                assert kind.list_size == feature["shape"][0] == len(feature["names"])
                kind = kind.value_type
            assert str(kind).replace("float", "float32") == feature["dtype"]
        assert rows[number] == {"episode_index": number, "tasks": ["shapes"], "length": len(table)}
        assert table["index"].to_pylist() == list(range(begin, begin + len(table)))
        begin += len(table)
        state = np.array(table["observation.state"].to_pylist())
        action = np.array(table["action"].to_pylist())
        np.testing.assert_array_equal(action[:-1], state[1:])
        told = stats[number]["stats"]["observation.state"]
        np.testing.assert_allclose(told["max"], state.max(axis=0))
        assert told["count"] == [len(table)]
        # Where the hand was then, and no other moment.
        at_s = demonstration.time_s[0] + np.array(table["timestamp"].to_pylist())
        for axis in range(3):
            expected = np.interp(at_s, demonstration.time_s, demonstration.positions[:, axis])
            np.testing.assert_allclose(state[:, axis], expected, atol=1e-6)
    form = format_of(folder)
    assert form is not None
    again = take(form, folder, choices_of()).demonstrations
    assert [set(each.states) for each in again] == [{"go"}, {"turn"}]


def test_headers_say_when_a_sample_was_taken(maker: Maker, tmp_path: Path) -> None:
    recording = maker.begin()
    taken_ns = BEGUN_NS - 4_000_001
    recording.write(KEYS.motion, maker.fields(FELT, 0), BEGUN_NS, taken_ns)
    recording.finish()
    folder = tmp_path / "bag"
    write_bag(read(recording.path), folder)
    with AnyReader([folder]) as reader:
        for connection, at_ns, data in reader.messages():
            stamp = reader.deserialize(data, connection.msgtype).header.stamp  # type: ignore[attr-defined]
            assert (at_ns, stamp.sec * 10**9 + stamp.nanosec) == (BEGUN_NS, taken_ns)


def test_an_orientation_between_two_samples_is_between_them(tmp_path: Path) -> None:
    # About z at 2 rad/s; q and -q are the same rotation.
    signs = np.array([1.0, -1.0] * 5)[:, None]
    time_s = 0.1 * np.arange(10)
    turn = np.stack([0 * time_s, 0 * time_s, np.sin(time_s), np.cos(time_s)], axis=1)
    shown = Demonstration("d", time_s, np.zeros((10, 3)), (None,) * 10, signs * turn)
    write_data_set([shown], tmp_path / "set", "turn", fps=30)
    table = parquet.read_table(next((tmp_path / "set").glob("data/*/*.parquet")))
    turns = np.array(table["observation.state"].to_pylist())[:, 3:]
    at_s = np.arange(len(turns)) / 30
    assert len(turns) == 28
    np.testing.assert_allclose(np.abs(turns[:, 2]), np.abs(np.sin(at_s)), atol=1e-4)


def test_a_recording_of_our_own_is_no_other_programs_though_it_is_empty(maker: Maker) -> None:
    assert format_of(maker.write([])) is None


def test_nothing_is_left_of_an_export_that_failed(maker: Maker, tmp_path: Path) -> None:
    content = read(maker.write([]))
    folder = tmp_path / "out" / "bag"
    folder.parent.mkdir()
    with pytest.raises(RecordingError, match="no motion, no robot and no belief"):
        write_bag(content, folder)
    with pytest.raises(RecordingError, match="no demonstration"):
        write_data_set([], folder, "shapes")
    assert not list(folder.parent.iterdir())
    folder.mkdir()
    with pytest.raises(FileExistsError):
        write_bag(content, folder)
