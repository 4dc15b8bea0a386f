"""A recording as Rerun has it: files are written, and read back by Rerun's own reader."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rerun.chunk import RrdReader

from hmcs.bus.messages import Belief, FixtureState, Label, Motion, RobotState
from hmcs.palette import UNKNOWN_COLOR, state_color
from hmcs.recordings.reading import RecordingContent, RecordingError, read
from hmcs.recordings.rerun_view import rows
from hmcs.recordings.rerun_view.rows import TIMELINE
from hmcs.recordings.rerun_view.showing import rerun_file
from support.recordings import BEGUN_NS, KEYS, PERIOD_NS, Maker, Said

STATES = ("reach", "turn")
ROUNDS = 60
KINDS = 4
"""Messages of a round."""
URDF = b"""<robot name="any">
<link name="floor"/>
<link name="arm"><visual><geometry><box size="1 1 1"/></geometry></visual>
<collision><geometry><sphere radius="1"/></geometry></collision></link>
<link name="hand">
<visual><geometry><mesh filename="file:///etc/hostname"/></geometry></visual></link>
<joint name="turns" type="revolute"><parent link="floor"/><child link="arm"/>
<origin xyz="0 0 1"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="slides" type="prismatic"><parent link="arm"/><child link="hand"/>
<axis xyz="1 0 0"/><limit lower="0" upper="1" effort="1" velocity="1"/>
<mimic joint="turns" multiplier="0.5" offset="0.1"/></joint>
</robot>"""


def said() -> list[Said]:
    """Sixty rounds, each of a hand, a robot, a fixture and a belief; the second half is a turn."""
    return list(_rounds())


def _rounds() -> Iterator[Said]:
    for k in range(ROUNDS):
        state = STATES[k >= ROUNDS // 2]
        if k in (0, ROUNDS // 2):
            yield KEYS.label, Label(state=state)
        at = np.array([0.001 * k, 0.0, 0.5])
        six = np.arange(6.0)
        yield (
            KEYS.motion,
            Motion(position=at, velocity=np.zeros(3), wrench=six + k, dead_man=k >= 3),
        )
        yield (
            KEYS.robot_state,
            RobotState(
                robot="lab-arm",
                joint_names=("turns",),
                joint_positions=np.array([0.01 * k]),
                joint_velocities=np.zeros(1),
                tool_position=2.0 * at,
                tool_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
                tool_twist=np.zeros(6),
                reference_twist=np.zeros(6),
                nearest_obstacle="",
                nearest_distance_m=None,
                contacts=(),
                stop="disengaged" if k < 3 else "none",
                limited=(),
            ),
        )
        yield (
            KEYS.fixture_state,
            FixtureState(
                law="guide",
                model="mine",
                state=state,
                factor=k / ROUNDS,
                compliance=1.0 - k / ROUNDS,
                preferred_direction=np.array([0.0, 1.0, 0.0]),
                progress=0.0,
                operator_twist=np.zeros(6),
                command_twist=np.zeros(6),
                wrench=-six,
                engaged=True,
                reason="guiding",
            ),
        )
        sure = np.array([0.8, 0.1] if state == "reach" else [0.1, 0.8])
        yield (
            KEYS.belief("mine", "r"),
            Belief(
                model_hash="0" * 8,
                clock="clock",
                step=k,
                states=STATES,
                probabilities=sure,
                unknown=0.1,
                likely_gesteme=state,
                segment_start=0,
            ),
        )


class Shown:
    """A file of Rerun's, by entity."""

    def __init__(self, file: Path) -> None:
        self._chunks = RrdReader(file).store().stream().to_chunks()

    @property
    def entities(self) -> set[str]:
        return {chunk.entity_path for chunk in self._chunks}

    def column(self, entity: str, component: str) -> list[Any]:
        """The values of one component, in their order; one that never changes once."""
        return [
            row[0] if len(row) == 1 else row
            for chunk in self._chunks
            if chunk.entity_path == entity
            for name, column in zip(
                chunk.to_record_batch().schema.names, chunk.to_record_batch().columns, strict=True
            )
            if name.endswith(f":{component}")
            for row in column.to_pylist()
        ]

    def times_ns(self, entity: str) -> list[int]:
        """When the values of an entity begin to hold."""
        return [
            at
            for chunk in self._chunks
            if chunk.entity_path == entity and not chunk.is_static
            for at in chunk.to_record_batch().column(TIMELINE).cast("int64").to_pylist()
        ]


def written(content: RecordingContent, file: Path) -> tuple[str, ...]:
    data, notes = rerun_file(content, lambda *_: None)
    file.write_bytes(data)
    return notes


@pytest.fixture
def shown(maker: Maker, tmp_path: Path) -> Shown:
    joints = {"lab-arm.urdf": URDF}
    file = tmp_path / "take.rrd"
    assert written(read(maker.write(said(), attachments=joints)), file) == ()
    return Shown(file)


def number(color: str) -> int:
    return int(f"{color[1:]}ff", 16)


def test_beliefs_and_fixture_are_series_at_the_times_they_were_recorded(shown: Shown) -> None:
    believed = shown.column("/beliefs/mine/turn", "scalars")
    assert believed == [0.1] * 30 + [0.8] * 30
    assert shown.column("/beliefs/mine/unknown", "scalars") == [0.1] * 60
    assert shown.column("/fixture/factor", "scalars") == [k / ROUNDS for k in range(ROUNDS)]
    assert shown.column("/fixture/compliance", "scalars")[-1] == 1.0 - 59 / ROUNDS
    times = shown.times_ns("/fixture/factor")
    assert times[0] == BEGUN_NS + 3 * PERIOD_NS
    assert np.diff(times).min() == KINDS * PERIOD_NS


def test_states_are_lanes_in_their_colors_and_change_when_they_changed(shown: Shown) -> None:
    for lane in ("believed\\ by\\ mine", "fixture"):
        assert shown.column(f"/states/{lane}", "state") == ["reach", "turn"]
        colors = dict(
            zip(
                shown.column(f"/states/{lane}", "values")[0],
                shown.column(f"/states/{lane}", "colors")[0],
                strict=True,
            )
        )
        assert colors == {name: number(state_color(k)) for k, name in enumerate(STATES)}
    assert shown.column("/states/lab-arm\\ stops", "state") == ["disengaged", ""]
    assert [state for state in shown.column("/states/labeled", "state") if state] == list(STATES)


def test_forces_of_operator_and_fixture_are_shown_in_newton(shown: Shown) -> None:
    assert shown.column("/forces/operator\\ y", "scalars") == [1.0 + k for k in range(ROUNDS)]
    assert shown.column("/forces/fixture\\ z", "scalars") == [-2.0] * ROUNDS


def test_the_robot_is_drawn_from_its_urdf_and_its_joints_move_as_recorded(shown: Shown) -> None:
    assert "/base/lab-arm/visual_geometries/arm/visual_0" in shown.entities
    turned = shown.column("/base/lab-arm/joints/turns", "quaternion")
    angles = [2.0 * np.arctan2(z, w) for _, _, z, w in turned]
    np.testing.assert_allclose(angles, [0.01 * k for k in range(ROUNDS)], atol=1e-6)
    slid = shown.column("/base/lab-arm/joints/slides", "translation")
    np.testing.assert_allclose([x for x, _, _ in slid], 0.005 * np.arange(ROUNDS) + 0.1, atol=1e-6)


def test_no_file_that_a_description_names_is_read_and_such_links_are_lines(shown: Shown) -> None:
    assert not any("visual_geometries/hand" in entity for entity in shown.entities)
    assert "/base/lab-arm/bones/slides" in shown.entities


def test_ways_are_pieces_in_the_color_of_the_state_that_was_believed(shown: Shown) -> None:
    (strips,) = shown.column("/operator/path", "strips")
    (colors,) = shown.column("/operator/path", "colors")
    expected = [number(UNKNOWN_COLOR), *(number(state_color(k)) for k in range(2))]
    assert colors == expected[1:]
    # The hand is shown while it drives; the belief of a sample comes after it.
    assert strips[0][0] == pytest.approx([0.003, 0.0, 0.5])
    assert strips[0][-1] == strips[1][0] == pytest.approx([0.030, 0.0, 0.5])
    (tool_colors,) = shown.column("/base/path", "colors")
    assert set(tool_colors) <= set(expected)
    assert shown.column("/base/path", "strips")[0][-1][-1] == pytest.approx([0.118, 0.0, 1.0])


def test_what_is_held_before_it_is_sent_is_bounded_and_nothing_of_it_is_lost(
    maker: Maker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rows, "MOST_ROWS", 7)
    file = tmp_path / "take.rrd"
    written(read(maker.write(said())), file)
    assert Shown(file).column("/fixture/factor", "scalars") == [k / ROUNDS for k in range(ROUNDS)]


@pytest.mark.parametrize(
    ("attached", "note"),
    [
        ({}, "does not say how it looks"),
        ({"lab-arm.urdf": b"<robot"}, "is no XML"),
        ({"lab-arm.urdf": b'<!DOCTYPE a [<!ENTITY b "c">]><robot/>'}, "document type"),
        ({"lab-arm.urdf": b'<robot name="x"/>'}, "lab-arm.urdf"),
    ],
)
def test_a_robot_that_cannot_be_drawn_is_noted_and_the_rest_is_shown(
    maker: Maker, tmp_path: Path, attached: dict[str, bytes], note: str
) -> None:
    file = tmp_path / "take.rrd"
    content = read(maker.write(said(), attachments=attached))
    (told,) = written(content, file)
    assert note in told
    assert "/base/tool" in Shown(file).entities


def test_a_recording_with_nothing_to_show_is_refused(maker: Maker) -> None:
    content = read(maker.write([(KEYS.label, Label(state="reach"))]))
    with pytest.raises(RecordingError, match="no motion"):
        rerun_file(content, lambda *_: None)
