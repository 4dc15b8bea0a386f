"""Bags of ROS and MCAP files as demonstrations; each file is made by its own library."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs.motion.demonstrations import Demonstration
from hmcs.recordings.foreign import bag_chunks
from hmcs.recordings.foreign.choices import AS_IT_IS, Choices, choices_of
from hmcs.recordings.foreign.registry import Taken, format_of, take
from support import foreign_files as made
from support.foreign_files import ROS1, ROS2, Sent

Write = Callable[[Path, list[Sent]], Path]


def taken(path: Path, choices: Choices = AS_IT_IS) -> Taken:
    form = format_of(path)
    assert form is not None
    return take(form, path, choices)


def only(path: Path, choices: Choices = AS_IT_IS) -> Demonstration:
    (demonstration,) = taken(path, choices).demonstrations
    return demonstration


def refused(path: Path, choices: Choices = AS_IT_IS) -> str:
    with pytest.raises(UserError) as caught:
        taken(path, choices)
    assert str(path) in str(caught.value)
    return str(caught.value)


def bag1(packing: str) -> Write:
    return lambda folder, sent: made.write_bag1(folder / "take.bag", sent, packing)


def bag2(storage: str, inside: str = "") -> Write:
    def write(folder: Path, sent: list[Sent]) -> Path:
        bag = made.write_bag2(folder / "take", sent, storage)
        return bag / inside if inside else bag

    return write


FORMATS = [
    pytest.param(bag1(""), ROS1, id="bag"),
    pytest.param(bag1("BZ2"), ROS1, id="bag-bz2"),
    pytest.param(bag1("LZ4"), ROS1, id="bag-lz4"),
    pytest.param(bag2("sqlite3"), ROS2, id="db3-folder"),
    pytest.param(bag2("sqlite3", "take.db3"), ROS2, id="db3"),
    pytest.param(bag2("mcap"), ROS2, id="mcap-folder"),
    pytest.param(bag2("mcap", "take.mcap"), ROS2, id="mcap"),
]


@pytest.mark.parametrize(("write", "types"), FORMATS)
def test_the_poses_of_a_bag_are_read_as_they_are(
    write: Write, types: object, tmp_path: Path
) -> None:
    found = taken(write(tmp_path, made.poses_sent(types)))
    (shown,) = found.demonstrations
    np.testing.assert_array_equal(shown.positions, made.way())
    np.testing.assert_allclose(shown.time_s, 0.01 * np.arange(made.SAMPLES), atol=1e-12)
    assert shown.orientations is not None
    assert shown.orientations.shape == (made.SAMPLES, 4)
    assert set(shown.states) == {None}
    assert "/tool_pose (geometry_msgs/msg/PoseStamped)" in found.notes[0]


def test_odometry_is_a_pose(tmp_path: Path) -> None:
    sent = [("/odom", ns, made.odometry(ROS2, ns, at)) for ns, at in
            zip(made.times_ns(), made.way(), strict=True)]  # fmt: skip
    np.testing.assert_array_equal(only(made.write_bag2(tmp_path / "b", sent)).positions, made.way())


def test_velocities_are_integrated(tmp_path: Path) -> None:
    # A straight way at 0.1 m/s while it turns about z at 0.5 rad/s, for 1 s, then a silence.
    times = [made.BEGUN_NS + k * made.PERIOD_NS for k in range(101)]
    times += [times[-1] + 10 * 10**9]
    twist = (0.1, 0.0, -0.2, 0.0, 0.0, 0.5)
    sent = [("/servo", ns, made.twist_stamped(ROS2, ns, twist)) for ns in times]
    shown = only(made.write_bag2(tmp_path / "b", sent))
    np.testing.assert_allclose(shown.positions[100], (0.1, 0.0, -0.2), atol=1e-12)
    np.testing.assert_allclose(shown.positions[101], shown.positions[100], atol=1e-12)
    assert shown.orientations is not None
    np.testing.assert_allclose(
        shown.orientations[100], (0, 0, np.sin(0.25), np.cos(0.25)), atol=1e-9
    )


def test_a_velocity_that_grows_leads_as_far_as_its_mean(tmp_path: Path) -> None:
    times = made.times_ns(101)
    sent = [("/servo", ns, made.twist_stamped(ROS2, ns, (0.01 * k, 0, 0, 0, 0, 0)))
            for k, ns in enumerate(times)]  # fmt: skip
    shown = only(made.write_bag2(tmp_path / "b", sent))
    np.testing.assert_allclose(shown.positions[:, 0], 0.5 * shown.time_s**2, atol=1e-12)


def test_joint_positions_become_poses_by_the_urdf(tmp_path: Path) -> None:
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(made.ARM)
    names = ("elbow", "finger", "rail", "shoulder")
    rows = [(0.1 * k, 9.0, 0.01 * k, -0.05 * k) for k in range(20)]
    times = made.times_ns(len(rows))
    sent = [("/joint_states", ns, made.joint_state(ROS2, ns, names, row)) for ns, row in
            zip(times, rows, strict=True)]  # fmt: skip
    bag = made.write_bag2(tmp_path / "b", sent)
    shown = only(bag, choices_of(urdf=urdf))
    elbow, _, rail, shoulder = np.array(rows).T
    both = shoulder + elbow
    reach = 0.3 + rail
    np.testing.assert_allclose(
        shown.positions,
        np.stack(
            [
                0.4 * np.cos(shoulder) + reach * np.cos(both),
                0.4 * np.sin(shoulder) + reach * np.sin(both),
                np.full(len(rows), 0.3),
            ],
            axis=1,
        ),
        atol=1e-9,
    )
    degrees = only(bag, choices_of(urdf=urdf, units=["deg"]))
    assert not np.allclose(degrees.positions, shown.positions)
    assert "--urdf" in refused(bag)
    other = tmp_path / "other.urdf"
    other.write_text(made.ARM.replace('"elbow"', '"wrist"'))
    assert "wrist" in refused(bag, choices_of(urdf=other))


def test_force_and_pressed_buttons_come_with_the_motion(tmp_path: Path) -> None:
    times = made.times_ns()
    sent = made.poses_sent()
    sent += [("/ft", ns, made.wrench_stamped(ROS2, ns, (k, 0, 0, 0, 0, -k)))
             for k, ns in enumerate(times) if k % 2 == 0]  # fmt: skip
    pressed = {10: (1, 0, 0), 11: (1, 0, 0), 20: (0, 0, 0), 30: (0, 1, 0), 40: (0, 0, 1)}
    sent += [("/joy", times[k], made.joy(ROS2, times[k], own)) for k, own in pressed.items()]
    bag = made.write_bag2(tmp_path / "b", sorted(sent, key=lambda each: each[1]))
    shown = only(bag, choices_of(marks="0=approach,1=insert"))
    assert shown.wrenches is not None
    # Between two samples of the force in a straight line, at its last value behind it.
    np.testing.assert_allclose(shown.wrenches[:49, 0], np.arange(49), atol=1e-6)
    np.testing.assert_allclose(shown.wrenches[49], (48, 0, 0, 0, 0, -48), atol=1e-6)
    assert shown.states == (None,) * 10 + ("approach",) * 20 + ("insert",) * 20
    assert set(only(bag).states) == {None}
    assert "Joy" in refused(made.write_bag2(tmp_path / "c", made.poses_sent()),
                            choices_of(marks="0=a"))  # fmt: skip


def test_of_several_topics_one_is_named(tmp_path: Path) -> None:
    sent = made.poses_sent() + made.poses_sent(topic="/camera_pose")
    bag = made.write_bag2(tmp_path / "b", sorted(sent, key=lambda each: each[1]))
    message = refused(bag)
    assert "/tool_pose (geometry_msgs/msg/PoseStamped, 50)" in message
    assert "/camera_pose" in message
    assert "--topic" in message
    assert len(only(bag, choices_of(topics=["/camera_pose"])).time_s) == made.SAMPLES
    assert "/tool_pose" in refused(bag, choices_of(topics=["/nowhere"]))


def test_a_bag_without_motion_says_what_it_has(tmp_path: Path) -> None:
    ns = made.BEGUN_NS
    bag = made.write_bag2(tmp_path / "b", [("/joy", ns, made.joy(ROS2, ns, (1,)))])
    assert "it has /joy (sensor_msgs/msg/Joy, 1)" in refused(bag)
    one = made.write_bag2(tmp_path / "c", made.poses_sent()[:1])
    assert "1 position(s), expected 2" in refused(one)


@pytest.mark.parametrize(
    ("at", "value", "said"),
    [
        (7, (np.nan, 0.0, 0.0), "sample 8 is (nan"),
        (7, (np.inf, 0.0, 0.0), "sample 8 is (inf"),
    ],
)
def test_numbers_that_are_none_are_refused_with_their_sample(
    at: int, value: tuple[float, ...], said: str, tmp_path: Path
) -> None:
    sent = made.poses_sent()
    topic, ns, _ = sent[at]
    sent[at] = (topic, ns, made.pose_stamped(ROS2, ns, value))
    assert said in refused(made.write_bag2(tmp_path / "b", sent))


def test_two_frames_and_times_that_fall_are_refused(tmp_path: Path) -> None:
    sent = made.poses_sent()
    topic, ns, _ = sent[9]
    other = [*sent[:9], (topic, ns, made.pose_stamped(ROS2, ns, (0, 0, 0), "camera")), *sent[10:]]
    assert "frame 'base' first and in 'camera'" in refused(made.write_bag2(tmp_path / "b", other))
    back = [*sent[:9], (topic, ns, made.pose_stamped(ROS2, ns - 10**9, (0, 0, 0))), *sent[10:]]
    assert "earlier than the one before" in refused(made.write_bag2(tmp_path / "c", back))


@pytest.mark.parametrize(("write", "types"), FORMATS)
def test_a_file_that_was_cut_off_is_refused_with_its_remedy(
    write: Write, types: object, tmp_path: Path
) -> None:
    path = write(tmp_path, made.poses_sent(types))
    inside = path if path.is_file() else next(path.glob("take.*"))
    whole = inside.read_bytes()
    for share in (0.2, 0.5):
        inside.write_bytes(whole[: int(share * len(whole))])
        message = refused(path)
        assert any(word in message for word in ("reindex", "recover", "cut off")), message


@pytest.mark.parametrize(("write", "types"), FORMATS)
def test_damaged_bytes_end_in_a_clear_refusal_or_in_a_demonstration(
    write: Write, types: object, tmp_path: Path
) -> None:
    path = write(tmp_path, made.poses_sent(types))
    inside = path if path.is_file() else next(path.glob("take.*"))
    whole = inside.read_bytes()
    rng = np.random.default_rng(1)
    for _ in range(40):
        damaged = bytearray(whole)
        for at in rng.integers(20, len(whole), 20):
            damaged[at] ^= int(rng.integers(1, 256))
        inside.write_bytes(damaged)
        with suppress(UserError):
            taken(path)


def test_a_chunk_that_unpacks_to_more_than_can_be_held_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    still = made.pose_stamped(ROS1, made.BEGUN_NS, (0, 0, 0))
    sent = [("/tool", ns, still) for ns in made.times_ns(1000)]
    for packing in ("BZ2", "LZ4"):
        path = made.write_bag1(tmp_path / f"{packing}.bag", sent, packing)
        # More than the chunk has packed, less than it has unpacked.
        monkeypatch.setattr(bag_chunks, "LARGEST_CHUNK_BYTES", 50_000)
        assert path.stat().st_size < 50_000 < 80 * len(sent)
        assert "chunk of more than" in refused(path)


def test_a_database_with_a_program_in_it_is_refused(tmp_path: Path) -> None:
    bag = made.write_bag2(tmp_path / "b", made.poses_sent())
    database = sqlite3.connect(bag / "b.db3")
    database.executescript(
        "ALTER TABLE messages RENAME TO kept; CREATE VIEW messages AS SELECT * FROM kept;"
    )
    database.close()
    assert "has a view" in refused(bag)


def test_a_packed_bag_says_how_to_unpack_it(tmp_path: Path) -> None:
    bag = made.write_bag2(tmp_path / "b", made.poses_sent())
    file = bag / "metadata.yaml"
    text = file.read_text().replace("compression_mode: ''", "compression_mode: FILE")
    assert "FILE" in text
    file.write_text(text)
    assert "ros2 bag convert" in refused(bag)
    (bag / "c.db3.zstd").write_bytes(b"x")
    with pytest.raises(UserError, match="unzstd"):
        format_of(bag / "c.db3.zstd")


def pose_in_frame(ns: int, at: np.ndarray) -> dict[str, object]:
    return {
        "timestamp": {"sec": ns // 10**9, "nsec": ns % 10**9},
        "frame_id": "base",
        "pose": {
            "position": dict(zip("xyz", at.tolist(), strict=True)),
            "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        },
    }


def test_poses_in_json_are_read_from_mcap(tmp_path: Path) -> None:
    rows = list(zip(made.times_ns(), made.way(), strict=True))
    foxglove = made.write_json_mcap(
        tmp_path / "f.mcap",
        [("/tool", ns, pose_in_frame(ns, at)) for ns, at in rows],
        "foxglove.PoseInFrame",
    )
    shown = only(foxglove)
    np.testing.assert_array_equal(shown.positions, made.way())
    assert shown.orientations is not None
    bare = made.write_json_mcap(
        tmp_path / "g.mcap",
        [("/log", ns, {"level": "info"}) for ns, _ in rows[:2]]
        + [("/xyz", ns, dict(zip("xyz", at.tolist(), strict=True))) for ns, at in rows],
    )
    shown = only(bare)
    np.testing.assert_array_equal(shown.positions, made.way())
    assert shown.orientations is None
    np.testing.assert_allclose(shown.time_s, 0.01 * np.arange(made.SAMPLES), atol=1e-12)
    words = made.write_json_mcap(tmp_path / "h.mcap", [("/log", 1, {"level": "info"})])
    assert "/log (tool, json, 1)" in refused(words)


def test_an_mcap_message_that_is_no_pose_is_refused_with_its_number(tmp_path: Path) -> None:
    rows = [{"x": 0.0, "y": 1.0}, {"x": 0.1, "y": 1.0}, {"x": "far", "y": 1.0}]
    sent = [("/xyz", made.BEGUN_NS + k, fields) for k, fields in enumerate(rows)]
    message = refused(made.write_json_mcap(tmp_path / "f.mcap", sent))
    assert "/xyz: message 3 has 'far' in place of a number" in message


def test_poses_of_protobuf_are_read_by_the_type_their_file_describes(tmp_path: Path) -> None:
    shown = only(made.write_protobuf_mcap(tmp_path / "p.mcap", made.way()))
    np.testing.assert_array_equal(shown.positions, made.way())
    expected = (np.array(made.times_ns()) - made.BEGUN_NS) / 1e9
    np.testing.assert_allclose(shown.time_s - shown.time_s[0], expected, atol=1e-9)


def test_protobuf_that_is_not_described_is_no_motion(tmp_path: Path) -> None:
    message = refused(made.write_protobuf_mcap(tmp_path / "q.mcap", made.way(), described=False))
    assert "lab.PoseInFrame, protobuf" in message
    assert message.count("\n") == 0
