"""The pages on one's own data and one's own fixture, followed as they stand in an empty folder.

The files they name are made by the libraries of those who write such files.
"""

from __future__ import annotations

import lzma
import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from hmcs.motion.demonstrations import Demonstration, read_csv
from hmcs.recognition.model_file import load_model
from hmcs.task import load_task
from hmcs_local.command import app
from support import foreign_files as made
from support.pages import ROOT, blocks, lines_of

DATA = "docs/how-to/own-data.md"
FIXTURE = "docs/how-to/own-fixture.md"
HANDS = [read_csv(ROOT / f"examples/data/hand-{k}.csv") for k in (1, 2)]
STATES = ("approach", "insert", "retract")
"""That the page marks by the buttons 0, 1 and 2."""
KEPT = ROOT / "shared/tests/recordings/kept/reach-and-lift.mcap.xz"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def follow(line: str) -> str:
    """Run a command of a page; return what it prints; raises what it raises."""
    words = shlex.split(line, comments=True)
    assert words[0] == "hmcs", line
    done = CliRunner().invoke(app, words[1:])
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    assert done.exit_code == 0, f"{line}\n{done.output}"
    return done.output


def bag_of(folder: Path, hand: Demonstration, *, joints: bool = False) -> Path:
    """A bag of ROS 2 with the hand's way, as poses or as joints; buttons mark its states."""
    names = list(dict.fromkeys(hand.states))
    sent: list[made.Sent] = []
    switches = zip(hand.time_s, hand.positions, hand.states, hand.switches, strict=True)
    for at_s, position, state, switched in switches:
        ns = made.BEGUN_NS + round(1e9 * float(at_s))
        if switched:
            pressed = [int(name == state) for name in names]
            sent.append(("/joy", ns, made.joy(made.ROS2, ns, pressed)))
        if joints:
            rails = ("along_x", "along_y", "along_z")
            sent.append(("/joint_states", ns, made.joint_state(made.ROS2, ns, rails, position)))
        else:
            sent.append(("/tool_pose", ns, made.pose_stamped(made.ROS2, ns, position)))
    return made.write_bag2(folder, sent)


def gantry() -> str:
    """A robot of three rails to `tool0`: its joint positions are those of the tool."""
    links = "".join(f'<link name="{name}"/>' for name in ("base", "a", "b", "tool0"))
    hung = zip(("base", "a", "b"), ("a", "b", "tool0"), "xyz", strict=True)
    axes = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}
    joints = "".join(
        f'<joint name="along_{axis}" type="prismatic"><parent link="{above}"/>'
        f'<child link="{below}"/><axis xyz="{axes[axis]}"/>'
        '<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>'
        for above, below, axis in hung
    )
    return f'<robot name="gantry">{links}{joints}</robot>'


def so100() -> str:
    """The joints of a LeRobot arm, all of which turn."""
    names = ("shoulder_pan", "shoulder_lift", "elbow_flex")
    links = "".join(f'<link name="l{k}"/>' for k in range(len(names) + 1))
    joints = "".join(
        f'<joint name="{name}" type="continuous"><parent link="l{k}"/><child link="l{k + 1}"/>'
        '<origin xyz="0.1 0 0.05"/><axis xyz="0 0 1"/></joint>'
        for k, name in enumerate(names)
    )
    hand = (
        '<link name="gripper_frame_link"/><joint name="hand" type="fixed">'
        f'<parent link="l{len(names)}"/><child link="gripper_frame_link"/>'
        '<origin xyz="0.2 0 0"/></joint>'
    )
    return f'<robot name="so100">{links}{joints}{hand}</robot>'


def their_files(folder: Path) -> Iterator[Path]:
    """Make what the page names, beside what it makes itself."""
    (folder / "session").mkdir()
    yield bag_of(folder / "session/monday", HANDS[0])
    yield made.write_lerobot(folder / "session/set", [made.way(40)], ("x", "y", "z"))
    yield bag_of(folder / "bag", HANDS[0])
    (folder / "bags").mkdir()
    for number, hand in enumerate(HANDS):
        yield bag_of(folder / f"bags/{number}", hand)
    yield made.write_lerobot(folder / "lerobot", [made.way(40)], ("x", "y", "z"))
    turning = np.outer(np.linspace(0.0, 60.0, 90), [1.0, 0.5, 0.2])
    joints = ("shoulder_pan.pos", "shoulder_lift.pos", "elbow_flex.pos")
    yield made.write_lerobot(folder / "so100", [turning], joints)
    hands = ("ee_0", "ee_1", "ee_2")
    yield made.write_lerobot(folder / "aloha", [made.way(60)], hands, feature="action")
    hand = HANDS[0]
    rows = [
        f"{1000 * at_s:.1f},{','.join(f'{1000 * each:.2f}' for each in position)},{state}"
        for at_s, position, state in zip(hand.time_s, hand.positions, hand.states, strict=True)
    ]
    yield _text(folder / "log.csv", "\n".join(["stamp,px,py,pz,phase", *rows]))
    yield _text(folder / "my_arm.urdf", gantry())
    yield _text(folder / "so100.urdf", so100())
    (folder / "take-1.mcap").write_bytes(lzma.decompress(KEPT.read_bytes()))


def _text(file: Path, text: str) -> Path:
    file.write_text(text, encoding="utf-8")
    return file


def test_the_page_on_own_data_is_followed(folder: Path) -> None:
    assert list(their_files(folder))
    follow("hmcs new my-task --states approach,insert,retract")
    see, labels, joints, columns, make_csv, export = lines_of(DATA)
    for line in (*see, *labels):
        follow(line)
    assert load_model(folder / "my-task.hmcs").state_names == STATES

    (folder / "my-task.hmcs").unlink()
    shutil.rmtree(folder / "bags")
    (folder / "bags").mkdir()
    for number, hand in enumerate(HANDS):
        bag_of(folder / f"bags/{number}", hand, joints=True)
    train, check = joints
    # The buttons of those bags are marks as those of the others were.
    follow(f"{train} --marks 0=approach,1=insert,2=retract")
    assert load_model(folder / "my-task.hmcs").state_names == STATES
    follow(check)

    log, aloha = (follow(line) for line in columns)
    assert "state=phase; positions in mm, times in ms" in log
    extent = np.ptp(HANDS[0].positions, axis=0)
    assert " ".join(f"{each:.2f}" for each in extent) in log
    assert "x=ee_0, y=ee_1, z=ee_2" in aloha
    for number, hand in enumerate(HANDS):
        shutil.rmtree(folder / f"bags/{number}")
        bag_of(folder / f"bags/{number}", hand)
    for line in make_csv:
        follow(line)
    np.testing.assert_allclose(read_csv(folder / "take.csv").positions, HANDS[0].positions)
    assert len(list((folder / "demonstrations").glob("*.csv"))) == 3

    for line in export:
        follow(line)
    assert (folder / "take-1-ros/metadata.yaml").is_file()
    assert (folder / "take-1-set/meta/info.json").is_file()


def test_the_fixture_of_the_page_is_that_of_its_state(folder: Path) -> None:
    follow("hmcs new mine --states insert")
    file = folder / "mine.yaml"
    task = yaml.safe_load(file.read_text(encoding="utf-8"))
    (block,) = blocks(FIXTURE, "yaml")
    task |= yaml.safe_load(block) | {"gestemes": [{"name": "push"}]}
    file.write_text(yaml.safe_dump(task), encoding="utf-8")
    follow("hmcs task check mine.yaml")
    (state,) = load_task(file).states
    assert state.fixture is not None
    assert state.fixture.compliance == "belief"
    assert state.fixture.volume is not None
    assert state.fixture.volume.of_spread == 2.0


def test_what_the_page_on_fixtures_names_is_in_the_program() -> None:
    text = (ROOT / FIXTURE).read_text(encoding="utf-8")
    for command in re.findall(r"`(hmcs [^`]+)`", text):
        follow(f"{command} --help")
