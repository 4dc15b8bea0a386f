from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from hmcs.arms.control import Following, Standing, Tuning, follow
from hmcs.arms.limits import bounds_of
from hmcs.arms.state import Pose, Touch
from hmcs.task import ForbiddenRegion, Obstacle
from hmcs_robot.kinematics import UnreachablePoseError
from hmcs_robot.simulation import Scene, Simulation, StartPoseError
from support.arms import limits_about

WALL = Obstacle(name="wall", shape="box", position_m=(0.60, 0.25, 0.50), size_m=(0.3, 0.1, 0.3))
BALL = Obstacle(name="ball", shape="sphere", position_m=(0.60, 0.0, 0.65), radius_m=0.05)
POST = Obstacle(
    name="post", shape="cylinder", position_m=(0.60, -0.12, 0.5), radius_m=0.02, length_m=0.4
)


def drive(rig: Any, twist: Any, cycles: int = 600) -> tuple[str, ...]:
    """Follow `twist` until something is touched; return what."""
    for _ in range(cycles):
        rig.follow(twist)
        contacts: tuple[str, ...] = rig.simulation.read().contacts
        if contacts:
            return contacts
    return ()


@pytest.mark.parametrize(
    ("obstacle", "twist"),
    [(WALL, [0, 0.1, 0, 0, 0, 0]), (BALL, [0, 0, 0.1, 0, 0, 0]), (POST, [0, -0.1, 0, 0, 0, 0])],
)
def test_driving_into_an_obstacle_is_a_contact_with_it(
    bench: Any, obstacle: Obstacle, twist: list[float]
) -> None:
    rig = bench(obstacles=(obstacle,))
    nearest = rig.simulation.read().nearest
    assert nearest is not None
    assert nearest.distance_m > 0.01
    assert drive(rig, twist) == (obstacle.name,)
    nearest = rig.simulation.read().nearest
    assert nearest is not None
    assert nearest.name == obstacle.name
    assert -0.005 < nearest.distance_m < 0.001


def test_nearest_distance_is_that_of_the_shapes(bench: Any) -> None:
    # The pen is a cylinder along x of radius 5 mm at its tip; the sphere hangs above the tip.
    rig = bench(
        obstacles=(
            Obstacle(name="ball", shape="sphere", position_m=(0.62, 0, 0.65), radius_m=0.04),
        )
    )
    found = rig.simulation.read().nearest
    assert found is not None
    expected = np.hypot(0.02, 0.15 - 0.005) - 0.04
    assert found.distance_m == pytest.approx(expected, abs=0.002)


def test_an_obstacle_out_of_reach_of_the_search_is_not_named(bench: Any) -> None:
    far = Obstacle(name="far", shape="sphere", position_m=(-2, 0, 0.5), radius_m=0.1)
    assert bench(obstacles=(far,)).simulation.read().nearest is None


def test_a_touching_arm_cannot_press_on_but_can_move_away(bench: Any) -> None:
    rig = bench(obstacles=(WALL,))
    assert drive(rig, [0, 0.1, 0, 0, 0, 0]) == ("wall",)
    before = rig.simulation.read().tool.position
    blocked = 0
    for _ in range(120):
        blocked += "contact" in rig.follow([0, 0.1, 0, 0, 0, 0]).limited
    pressed = rig.simulation.read()
    assert blocked > 0
    assert pressed.tool.position[1] - before[1] < 0.002
    for _ in range(120):
        motion = rig.follow([0, -0.1, 0, 0, 0, 0])
    away = rig.simulation.read()
    assert "contact" not in motion.limited
    assert away.contacts == ()
    assert before[1] - away.tool.position[1] > 0.03


def test_parting_speed_has_the_sign_of_the_distance(bench: Any) -> None:
    rig = bench(obstacles=(WALL,))
    drive(rig, [0, 0.1, 0, 0, 0, 0])
    arm = rig.simulation.read()
    inward = np.linalg.pinv(arm.jacobian) @ [0, 1, 0, 0, 0, 0]
    assert all(touch.separation_per_joint @ inward < -0.5 for touch in arm.touches)


def test_an_obstacle_at_the_start_pose_is_refused(starts: dict[str, Pose], engine: str) -> None:
    hit = Obstacle(name="hit", shape="sphere", position_m=(0.60, 0.0, 0.50), radius_m=0.05)
    with pytest.raises(StartPoseError, match="touches hit at the start pose"):
        Simulation(Scene("puma560", starts["puma560"], (hit,)), 1 / 240, engine=engine)


def test_an_unreachable_start_pose_is_refused(starts: dict[str, Pose], engine: str) -> None:
    far = starts["puma560"]._replace(position=np.array([1.6, 0.0, 0.5]))
    with pytest.raises(UnreachablePoseError, match="puma560"):
        Simulation(Scene("puma560", far, ()), 1 / 240, engine=engine)


def test_the_arm_begins_at_rest_at_the_start_pose(
    bench: Any, robot: str, starts: dict[str, Pose]
) -> None:
    arm = bench(robot).simulation.read()
    assert arm.tool.position == pytest.approx(starts[robot].position, abs=1e-5)
    assert not arm.joint_velocities.any()


def test_an_arm_whose_own_links_meet_touches_itself_and_can_part_them(
    bench: Any, robot: str
) -> None:
    simulation = bench(robot).simulation
    assert simulation.read().contacts == ()
    random, limits = np.random.default_rng(1), simulation.limits
    for _ in range(4000):
        posture = random.uniform(limits.lower, limits.upper)
        simulation.engine.place(posture)
        touches = simulation.read().touches
        if len(touches) == 1:
            break
    assert [touch.name for touch in touches] == ["itself"]
    (touch,) = touches
    parting = touch.separation_per_joint / np.linalg.norm(touch.separation_per_joint)

    def meets(along: float) -> bool:
        simulation.engine.place(posture + along * parting)
        return "itself" in simulation.read().contacts

    assert meets(-0.005)
    assert any(not meets(along) for along in np.linspace(0.0, 0.4, 41))


def test_links_that_meet_cannot_be_pressed_together(bench: Any) -> None:
    rig = bench("puma560")
    state = rig.simulation.read()
    parting = np.zeros(len(state.joint_positions))
    parting[1] = -1.0
    bounds = bounds_of(state._replace(touches=(Touch("itself", parting),)), rig.limits)
    pressing, opening = -0.3 * parting, 0.3 * parting
    assert bounds.scale(np.zeros_like(pressing), pressing)[0] < 0.01
    assert bounds.scale(np.zeros_like(opening), opening)[0] == 1.0


def region(**fields: Any) -> ForbiddenRegion:
    return ForbiddenRegion.model_validate({"name": "region", **fields})


AROUND_THE_ELBOW = {
    "sphere": {"shape": "sphere", "position_m": [0.25, 0.35, 0.55], "radius_m": 0.1},
    "box": {"shape": "box", "position_m": [0.25, 0.4, 0.55], "size_m": [0.3, 0.2, 0.3]},
    "capsule": {
        "shape": "capsule", "position_m": [0.25, 0.4, 0.2], "end_m": [0.25, 0.4, 0.9],
        "radius_m": 0.1,
    },
    "plane": {"shape": "plane", "position_m": [0, 0.35, 0], "normal": [0, -1, 0]},
}  # fmt: skip


def ball_of_triangles(folder: Path, center: list[float], radius_m: float, finer: int) -> Any:
    """Return a mesh; it has 20 * 4**finer triangles."""
    file = folder / "ball.stl"
    trimesh.creation.icosphere(subdivisions=finer, radius=radius_m).export(file)
    return region(shape="mesh", position_m=center, file=str(file))


@pytest.mark.parametrize("shape", [*AROUND_THE_ELBOW, "mesh"])
def test_links_are_kept_out_of_forbidden_regions_while_the_tool_is_far(
    starts: dict[str, Pose], engine: str, period_s: float, shape: str, tmp_path: Path
) -> None:
    start = starts["puma560"]
    sphere = AROUND_THE_ELBOW["sphere"]
    around = (
        ball_of_triangles(tmp_path, sphere["position_m"], sphere["radius_m"], 4)
        if shape == "mesh"
        else region(**AROUND_THE_ELBOW[shape])
    )
    simulation = Simulation(Scene("puma560", start, (), (around,)), period_s, engine=engine)
    limits = limits_about(simulation.limits, start.position, 2.0)
    carried: Following | Standing = Standing()
    nearest = []
    try:
        for cycle in range(1200):
            arm = simulation.read()
            nearest.append(min((near.distances_m.min() for near in arm.links_near), default=np.inf))
            # Round about, so that every link comes near.
            angle = cycle / 200
            twist = np.array([0.2 * np.cos(angle), 0.25, 0.2 * np.sin(angle), 0, 0, 0])
            motion = follow(arm, twist, carried, simulation.home, limits, Tuning(), period_s)
            carried = motion.carried
            simulation.move(motion.joint_velocities)
    finally:
        simulation.close()
    assert min(nearest) < 0.02
    assert min(nearest) > -1e-4


def test_however_fine_a_mesh_is_few_of_its_places_are_reported_and_none_is_farther_than_the_mesh(
    starts: dict[str, Pose], engine: str, period_s: float, tmp_path: Path
) -> None:
    center, radius_m = [0.35, 0.3, 0.75], 0.25
    found = {}
    for finer in (2, 6):
        mesh = ball_of_triangles(tmp_path, center, radius_m, finer)
        sphere = region(shape="sphere", position_m=center, radius_m=radius_m)
        reported = []
        for around in (mesh, sphere):
            simulation = Simulation(
                Scene("puma560", starts["puma560"], (), (around,)), period_s, engine=engine
            )
            reported.append(simulation.read().links_near)
            simulation.close()
        near, exactly = reported
        assert len(near) >= len(exactly) > 0
        found[finer] = sum(len(each.distances_m) for each in near)
        least_m = min(float(each.distances_m.min()) for each in near)
        exact_m = min(float(each.distances_m.min()) for each in exactly)
        # Boxes stick out of a ball by less than this; flat triangles lie in it by as little.
        assert exact_m - 0.012 < least_m < exact_m + 0.006
    assert found[6] < 1000


def test_a_link_in_the_boxes_about_a_mesh_and_not_in_it_is_kept_where_it_is(
    starts: dict[str, Pose], engine: str, period_s: float, tmp_path: Path
) -> None:
    start = starts["puma560"]
    # A shell about the whole arm: boxes that cover a coarse one reach far into it.
    file = tmp_path / "shell.stl"
    trimesh.creation.icosphere(subdivisions=1, radius=2.0).export(file)
    shell = region(shape="mesh", position_m=[0.0, 0.0, 0.0], file=str(file))
    simulation = Simulation(Scene("puma560", start, (), (shell,)), period_s, engine=engine)
    try:
        assert simulation.links_within == ()
        assert all((near.distances_m > 0).all() for near in simulation.read().links_near)
    finally:
        simulation.close()


@pytest.mark.parametrize("written", ["stl", "stl_ascii", "obj"])
def test_a_mesh_is_taken_from_every_kind_of_file(
    starts: dict[str, Pose], engine: str, period_s: float, tmp_path: Path, written: str
) -> None:
    file = tmp_path / f"ball.{written[:3]}"
    trimesh.creation.icosphere(subdivisions=3, radius=0.05).export(file, file_type=written)
    ball = region(shape="mesh", position_m=[0.2, -0.2, 0.9], file=str(file))
    simulation = Simulation(
        Scene("puma560", starts["puma560"], (), (ball,)), period_s, engine=engine
    )
    try:
        assert simulation.links_within == ("upper_arm in region",)
    finally:
        simulation.close()


def test_a_link_in_a_forbidden_region_at_the_start_stays_there_and_the_others_are_kept_out(
    starts: dict[str, Pose], engine: str, period_s: float
) -> None:
    table = region(shape="plane", position_m=[0, 0, 0.48], normal=[0, 0, 1])
    simulation = Simulation(
        Scene("puma560", starts["puma560"], (), (table,)), period_s, engine=engine
    )
    try:
        assert simulation.links_within
        assert all(text.endswith(" in region") for text in simulation.links_within)
        near = simulation.read().links_near
        assert near
        assert all((each.distances_m > 0).all() for each in near)
    finally:
        simulation.close()
