"""An arm of one's own: what its file says, what it leaves out, and what is refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import yourdfpy

from hmcs.arms.chain import chain_of
from hmcs.arms.tools import tool_links
from hmcs.arms.urdf import UrdfError, read_urdf
from hmcs.errors import UserError
from hmcs_robot.description.checking import reach_of
from hmcs_robot.description.described import check_follows, describe
from hmcs_robot.robots import ROBOTS, RobotModel
from support.urdfs import LIMIT, OFFSETS, arm, joint, link, written


def model(file: Path, **more: object) -> RobotModel:
    return RobotModel(file, "tool", 0.0)._replace(**more)


RAIL = link("ground") + joint(
    "rail", "ground", "base", "prismatic", "0 1 0",
    more='<limit lower="-1" upper="1" effort="500" velocity="0.5"/>',
)  # fmt: skip
REVERSED = joint("j1", "base", "l1", axis="0 0 -3", xyz="0 0 0.3")
TURNING = joint(
    "j6", "l5", "l6", "continuous", "1 0 0", "0.06 0 0", '<limit effort="10" velocity="3"/>'
)
LIMIT_OF_FINGER = '<limit lower="0.1" upper="0.5" effort="5" velocity="1"/>'
FINGERS = "\n".join(
    [
        link("a"),
        joint("finger", "tool", "a", "prismatic", more=LIMIT_OF_FINGER),
        link("b"),
        joint(
            "other", "tool", "b", "prismatic", "0 0 -1",
            more=LIMIT_OF_FINGER + '<mimic joint="finger" multiplier="2" offset="0.1"/>',
        ),
    ]
)  # fmt: skip


# --- the arm --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [arm(), arm(more=RAIL), arm({1: REVERSED}), arm({6: TURNING}), arm(more=FINGERS)],
    ids=["six axes", "rail", "reversed axis", "continuous wrist", "gripper"],
)
def test_the_tool_is_where_another_library_has_it(tmp_path: Path, text: str) -> None:
    file = written(tmp_path, text)
    described = describe(model(file))
    oracle = yourdfpy.URDF.load(str(file))
    for positions in described.chain.drawn(20):
        oracle.update_cfg(dict(zip(described.chain.joint_names, positions, strict=True)))
        expected = oracle.get_transform("tool", described.urdf.root)
        np.testing.assert_allclose(described.chain.poses(positions), expected, atol=1e-9)


@pytest.mark.parametrize("text", [arm(more=RAIL), arm({1: REVERSED, 6: TURNING})])
def test_the_jacobian_is_the_derivative_of_the_pose(tmp_path: Path, text: str) -> None:
    chain = describe(model(written(tmp_path, text))).chain
    h = 1e-6
    for at in chain.drawn(5):
        jacobian = chain.jacobians(at)
        for number in range(len(at)):
            step = h * np.eye(len(at))[number]
            ahead, behind = chain.poses(at + step), chain.poses(at - step)
            linear = (ahead[:3, 3] - behind[:3, 3]) / (2 * h)
            turning = (ahead[:3, :3] - behind[:3, :3]) / (2 * h) @ chain.poses(at)[:3, :3].T
            angular = [turning[2, 1], turning[0, 2], turning[1, 0]]
            np.testing.assert_allclose(jacobian[:, number], [*linear, *angular], atol=1e-8)


def test_a_joint_between_base_and_tool_may_follow_another(tmp_path: Path) -> None:
    parallel = joint(
        "j3", "l2", "l3", axis="0 1 0", xyz="0 0 0.4",
        more=LIMIT + '<mimic joint="j2" multiplier="-0.5" offset="0.2"/>',
    )  # fmt: skip
    text = arm({3: parallel}, RAIL)
    chain = describe(model(written(tmp_path, text))).chain
    free = describe(model(written(tmp_path, arm(more=RAIL)))).chain
    assert chain.joint_names == ("rail", "j1", "j2", "j4", "j5", "j6")
    at = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    same = np.array([0.1, 0.2, 0.3, -0.5 * 0.3 + 0.2, 0.4, 0.5, 0.6])
    np.testing.assert_allclose(chain.poses(at), free.poses(same), atol=1e-12)
    spread = free.jacobians(same)
    expected = np.delete(spread, 3, axis=1)
    expected[:, 2] += -0.5 * spread[:, 3]
    np.testing.assert_allclose(chain.jacobians(at), expected, atol=1e-12)
    # Half as fast, and no farther than the joint that follows gets.
    assert chain.limits.lower[2] == pytest.approx(-2.8)
    assert chain.limits.upper[2] == pytest.approx(2.8)


def test_joints_beside_the_arm_are_held_within_their_ranges_and_mimics_with_them(
    tmp_path: Path,
) -> None:
    chain = describe(model(written(tmp_path, arm(more=FINGERS)))).chain
    assert chain.held == pytest.approx({"finger": 0.3, "other": 2 * 0.3 + 0.1})
    assert chain.followers == {}


def test_the_base_link_is_where_the_arm_is_measured_from(tmp_path: Path) -> None:
    described = describe(model(written(tmp_path, arm(more=RAIL)), base_link="base"))
    assert described.chain.joint_names == ("j1", "j2", "j3", "j4", "j5", "j6")
    assert described.chain.held == {"rail": 0.0}
    moved = written(tmp_path, described.to_draw())
    oracle = yourdfpy.URDF.load(str(moved))
    oracle.update_cfg(dict.fromkeys(described.chain.joint_names, 0.3))
    np.testing.assert_allclose(
        oracle.get_transform("tool", oracle.base_link),
        described.chain.poses(np.full(6, 0.3)),
        atol=1e-9,
    )


def test_what_is_made_anew_for_engines_moves_as_the_file_says(tmp_path: Path) -> None:
    described = describe(model(written(tmp_path, arm({6: TURNING}, FINGERS))))
    again = chain_of(read_urdf(written(tmp_path, described.to_simulate())), "tool")
    assert again.joint_names == described.chain.joint_names
    assert again.held == {}
    assert again.assumed == ()
    for at in described.chain.drawn(5):
        np.testing.assert_allclose(again.poses(at), described.chain.poses(at), atol=1e-12)


# --- its postures ---------------------------------------------------------------------------------


def test_a_home_is_found_far_from_singularities_and_always_the_same(tmp_path: Path) -> None:
    file = written(tmp_path, arm({6: TURNING}))
    one, other = describe(model(file)), describe(model(file))
    np.testing.assert_array_equal(one.home, other.home)
    assert np.linalg.svd(one.chain.jacobians(one.home), compute_uv=False)[-1] > 0.1


def test_postures_are_given_in_order_or_by_joint(tmp_path: Path) -> None:
    file = written(tmp_path, arm())
    described = describe(
        model(file, home=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6), poses={"ready": {"j2": 0.5}})
    )
    np.testing.assert_array_equal(described.home, [0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    np.testing.assert_array_equal(described.poses["ready"], [0, 0.5, 0, 0, 0, 0])


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"home": (0.0,) * 5}, "home .* 5 positions, and the arm 6 joints: j1, j2"),
        ({"home": {"j9": 0.0}}, "home .* 'j9', which is no joint .*j1, j2"),
        ({"poses": {"up": {"j2": 3.0}}}, r"pose 'up' .* joint j2 at 3, expected -2.8 to 2.8 rad"),
        ({"joint_speed_rad_s": (1.0,)}, "1 joint speeds are given for its 6 joints"),
        ({"tool_link": "tol"}, "no link 'tol'.*did you mean tool"),
        ({"base_link": "tool", "tool_link": "l1"}, "'l1' does not hang on base link 'tool'"),
    ],
)
def test_what_is_none_of_the_arms_is_refused(
    tmp_path: Path, more: dict[str, object], said: str
) -> None:
    with pytest.raises(UserError, match=said):
        describe(model(written(tmp_path, arm()), **more))


def test_the_one_link_that_may_be_the_tool_is_taken_and_of_several_one_is_asked_for(
    tmp_path: Path,
) -> None:
    assert describe(model(written(tmp_path, arm()), tool_link=None)).tool_link == "tool"
    file = written(tmp_path, arm(more=FINGERS))
    assert tool_links(read_urdf(file)) == ("tool", "a", "b")
    with pytest.raises(UrdfError, match="one of: tool, a, b"):
        describe(model(file, tool_link=None))


def few(*held: int) -> str:
    """Return the arm with some of its joints fixed."""
    fixed = {
        k: joint(f"j{k}", f"l{k - 1}" if k > 1 else "base", f"l{k}", "fixed", xyz=OFFSETS[k - 1])
        for k in held
    }
    return arm(fixed)


def test_an_arm_that_cannot_be_led_everywhere_is_refused_with_what_it_cannot(
    tmp_path: Path,
) -> None:
    described = describe(model(written(tmp_path, few(1, 2, 3, 4))))
    with pytest.raises(UrdfError, match=r"2 joints that move \(j5, j6\), expected 3 or more"):
        check_follows(described)
    # Three parallel axes move it in a plane.
    described = describe(model(written(tmp_path, few(1, 4, 6))))
    with pytest.raises(UrdfError, match=r"do not move 'tool' along \(-?0\.00, -?1\.00, -?0\.00\)"):
        check_follows(described)


@pytest.mark.parametrize(("held", "lost"), [((4,), 1), ((4, 6), 2), ((4, 5, 6), 3)])
def test_which_turns_an_arm_of_few_joints_cannot_follow_is_told(
    tmp_path: Path, held: tuple[int, ...], lost: int
) -> None:
    described = describe(model(written(tmp_path, few(*held))))
    check_follows(described)
    assert f"{6 - len(held)} joints lead link tool to every position" in described.told
    assert described.told.count("(-") + described.told.count("(0") == (lost if lost < 3 else 0)


def test_the_tool_of_an_arm_of_few_joints_is_found(tmp_path: Path) -> None:
    assert tool_links(read_urdf(written(tmp_path, few(4)))) == ("tool",)


def test_reach_is_that_of_the_stretched_arm(tmp_path: Path) -> None:
    shoulder_m, stretched_m = 0.5, 0.4 + 0.2 + 0.2 + 0.06 + 0.08
    found = reach_of(describe(model(written(tmp_path, arm()))).chain)
    assert found.upper[0] == pytest.approx(stretched_m, rel=0.01)
    assert found.farthest_m == pytest.approx(shoulder_m + stretched_m, rel=0.01)


# --- what is left out -----------------------------------------------------------------------------


def limited(more: str, kind: str = "revolute") -> str:
    return arm({2: joint("j2", "l1", "l2", kind, "0 1 0", "0 0 0.2", more)})


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (limited(""), ["j2 has no range", "j2 has no velocity: 1 rad/s", "j2 has no effort"]),
        (limited('<limit lower="-1" upper="1" effort="9"/>'), ["j2 has no velocity: 1 rad/s"]),
        (limited('<limit lower="-1" upper="1" velocity="2"/>'), ["j2 has no effort: 20000 N·m"]),
        (limited('<limit upper="1" effort="9" velocity="2"/>'), ["j2 has no lower limit: 0"]),
        (
            limited('<limit lower="-1" upper="1" effort="0" velocity="0"/>'),
            ["velocity 0, with", "effort 0, with"],
        ),
        (
            limited('<limit effort="0"/>', "prismatic"),
            ["j2 has no range", "0.2 m/s", r"50000 N assumed"],
        ),
    ],
)
def test_what_a_joint_lacks_is_assumed_and_reported_with_its_line(
    tmp_path: Path, text: str, said: list[str]
) -> None:
    described = describe(model(written(tmp_path, text)))
    line = next(k for k, each in enumerate(text.splitlines(), 1) if 'name="j2"' in each)
    assert [note.line for note in described.notes] == [line] * len(said)
    for part in said:
        assert any(part in note.message for note in described.notes), described.told
    assert described.told.startswith(f"{described.urdf.file}:{line}: ")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (link("l3"), '<link name="l3"><visual/></link>', "l3 has no inertia: 1 kg"),
        (link("l3"), link("l3", -1.0), "l3 has no mass above 0: 1 kg"),
        (link("l3"), link("l3").replace('ixx="0.002"', 'ixx="-1"'), "no body has"),
        (link("l3"), link("l3").replace('ixx="0.002"', 'ixx="nan"'), "not of finite numbers"),
    ],
)
def test_an_inertia_that_cannot_be_is_assumed_and_reported(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    described = describe(model(written(tmp_path, arm().replace(old, new))))
    (note,) = described.notes
    assert said in note.message
    assert describe(model(written(tmp_path, described.to_simulate()))).notes == ()


def test_of_an_arm_that_says_all_nothing_is_reported(robot: str) -> None:
    assert describe(ROBOTS[robot]).told == ""


# --- what is refused ------------------------------------------------------------------------------

TWICE = joint("again", "base", "l2", "fixed", more="")


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("robot", 1, "no XML"),
        (arm().replace("</robot>", ""), 19, "no XML"),
        ("<mujoco/>", 1, "a MuJoCo model.*expected <robot>"),
        ('<robot name="x">\n<xacro:include/></robot>', 2, "xacro own.urdf > own.urdf"),
        ("<!DOCTYPE r [<!ENTITY a 'b'>]><robot/>", 1, "entities"),
        ("<robot/>", 1, "has no link"),
        (arm().replace('<child link="l2"/>', '<child link="l22"/>'), 6, "'l22'.*did you mean l2"),
        (arm().replace("revolute", "revolut", 1), 4, "'revolut', expected one of"),
        (arm(more=TWICE), 17, "hangs on joint again and on j2"),
        (arm(more=link("alone")), 17, "'base', 'alone' hang on no joint"),
        (arm({1: joint("j1", "tool", "l1")}), 4, "hangs on itself"),
        (arm(more=link("l2")), 17, "'l2' stands here a second time"),
        (arm().replace("0.2 0 0", "nan 0 0", 1), 10, "'nan 0 0', expected 3 finite numbers"),
        (arm().replace('axis xyz="0 0 1"', 'axis xyz="0 0 0"', 1), 4, "axis 0 0 0"),
        (limited('<limit lower="0" upper="0" effort="9" velocity="1"/>'), 6, "empty.*continuous"),
        (limited('<limit lower="1" upper="-1" effort="9" velocity="1"/>'), 6, "inverted"),
        (limited("", "floating"), 6, "is floating, expected one of.*'l2' as base_link"),
        (limited("", "planar"), 6, "is planar"),
        (limited(LIMIT + '<mimic joint="no"/>'), 6, "mimics 'no', which is no joint"),
        (limited(LIMIT + '<mimic joint="j2"/>'), 6, "mimics itself"),
    ],
)
def test_a_broken_file_is_refused_with_its_line(
    tmp_path: Path, text: str, line: int, said: str
) -> None:
    file = written(tmp_path, text)
    with pytest.raises(UrdfError) as error:
        describe(model(file))
    assert str(error.value).startswith(f"{file}:{line}: "), error.value
    assert re.search(said, str(error.value)), error.value


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UrdfError, match="no such file; expected a URDF"):
        describe(model(tmp_path / "none.urdf"))
