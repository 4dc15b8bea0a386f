"""Operators, recognizer, fixture and robot in one loop, and what is measured of it."""

from __future__ import annotations

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs.motion.closed_loop_operators import STEADY, ClosedLoopOperator
from hmcs.motion.paths import Path
from hmcs.recognition.learning import learn
from hmcs_laboratory.assistance.laws import DEFAULT_LAW, LAWS
from hmcs_laboratory.assistance.loop import Run, demonstrated, perform
from hmcs_laboratory.assistance.measures import fighting, leave_s, measures, off_path, tremor_left
from hmcs_laboratory.assistance.robots import LaggingTool
from hmcs_laboratory.assistance.scenarios import FAMILIES, TASKS, Scenario, unseen_order
from hmcs_laboratory.command import main
from hmcs_laboratory.studies.assistance import ASSISTANCE
from hmcs_laboratory.studies.experiments import EXPERIMENT_1, EXPERIMENT_2, EXPERIMENT_3
from hmcs_laboratory.studies.force_tasks import FORCE_TASK_2D, FORCE_TASK_3D
from hmcs_laboratory.study import TIMINGS

LINE = Path(np.array([[0.0, 0, 0], [1.0, 0, 0]]))
PERIOD_S = 0.01


def rows_of(seed: int = 5, **given: str):
    settings = ASSISTANCE.settings_from([f"{name}={value}" for name, value in given.items()])
    return ASSISTANCE.trial(settings, np.random.default_rng(seed))


def run_of(robot: np.ndarray, **changed: np.ndarray) -> Run:
    count = len(robot)
    velocity = np.tile([0.1, 0.0, 0.0], (count, 1))
    made = Run(
        PERIOD_S,
        True,
        robot,
        velocity,
        velocity,
        velocity,
        velocity,
        np.zeros((count, 3)),
        robot[:, 0],
        np.full(count, 0.5),
        ("",) * count,
        np.zeros(count),
        (),
        np.zeros(0, dtype=np.int64),
        frozenset(),
    )
    return made._replace(**changed)


@pytest.fixture(scope="module")
def rows():
    return rows_of(law="insistence", task="lines,unexpected-obstacle", demonstrations="3")


def test_a_row_names_law_task_and_operator_and_compares_with_the_operator_alone(rows):
    assert [(row.setting["law"], row.setting["task"]) for row in rows] == [
        ("none", "lines"),
        ("insistence", "lines"),
        ("none", "unexpected-obstacle"),
        ("insistence", "unexpected-obstacle"),
    ]
    for row in rows:
        assert row.setting["operator"] == "steady"
        assert row.setting["default_law"] == (row.method == DEFAULT_LAW)
        assert row.measures["arrived"] == 1.0
        if row.method == "none":
            assert row.measures["error_ratio"] == row.measures["time_ratio"] == 1.0
            assert row.measures["fighting"] == row.measures["force_n"] == 0.0
            assert row.measures["tremor_left"] == pytest.approx(1.0)


def test_the_default_law_helps_where_the_path_was_taught():
    helped = [
        row.measures
        for seed in (1, 2)
        for row in rows_of(seed, law="insistence", task="lines", demonstrations="5")
        if row.method == "insistence"
    ]
    assert np.mean([each["error_ratio"] for each in helped]) < 0.75
    assert np.mean([each["time_ratio"] for each in helped]) < 1.03
    assert np.mean([each["fighting"] for each in helped]) < 0.05
    assert np.mean([each["tremor_left"] for each in helped]) < 0.1


def test_an_obstacle_is_passed_and_leaving_is_timed(rows):
    for row in rows[2:]:
        assert row.measures["hits"] == 0.0
        assert row.measures["clearance_mm"] > 0
        assert row.measures["leave_s"] > 0


def test_a_law_measures_the_same_alone_and_among_others():
    def measured(law: str):
        return [
            {name: value for name, value in row.measures.items() if name not in TIMINGS}
            for row in rows_of(law=law, task="lines", demonstrations="2")
            if row.method == "thesis"
        ]

    np.testing.assert_equal(measured("thesis"), measured("general,thesis"))


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"law": "insistense"}, "did you mean insistence"),
        ({"task": "line"}, "did you mean lines"),
        ({"operator": "expert"}, "novice"),
        ({"law": "pull,pull"}, "once"),
    ],
)
def test_unknown_names_are_reported(given, says):
    with pytest.raises(UserError, match=says):
        rows_of(**given)


@pytest.mark.parametrize("name", TASKS)
def test_every_task_can_be_performed_alone(name):
    rng = np.random.default_rng(2)
    taught = FAMILIES[TASKS[name].family](rng, 0.005)
    scenario = TASKS[name].meaning(taught, rng)
    shown = demonstrated(
        ClosedLoopOperator(STEADY, scenario.meant, rng),
        taught,
        "alone",
        period_s=PERIOD_S,
        most_s=200.0,
    )
    assert np.linalg.norm(shown.positions[-1] - scenario.meant.points[-1]) < 0.01
    off = off_path(shown.positions, scenario.meant, np.zeros(len(shown.positions)))
    assert off[0] < 0.01


def test_a_demonstration_has_every_state_in_turn():
    taught = FAMILIES["lines"](np.random.default_rng(0), 0.005)
    operator = ClosedLoopOperator(STEADY, taught.path, np.random.default_rng(0))
    shown = demonstrated(operator, taught, "d", period_s=PERIOD_S, most_s=60.0)
    assert tuple(dict.fromkeys(shown.states)) == taught.states


def test_distance_is_that_to_the_path_near_the_operators_place():
    points = np.array([[0.1, 0.003, 0.004], [0.5, 0, 0]])
    np.testing.assert_allclose(off_path(points, LINE, np.array([0.1, 0.5])), [0.005, 0.0])


def test_fighting_is_the_share_of_time_much_is_taken():
    robot = np.outer(np.linspace(0, 1, 100), [1.0, 0, 0])
    passed = np.tile([0.1, 0.0, 0.0], (100, 1))
    passed[:25] *= 0.5
    assert fighting(run_of(robot, passed=passed)) == 0.25


def test_tremor_left_is_a_share_of_power():
    time_s = PERIOD_S * np.arange(1000)
    hand = np.outer(np.sin(2 * np.pi * 10 * time_s), [0, 0.01, 0])
    run = run_of(np.zeros((1000, 3)), hand_velocity=hand, command=0.5 * hand)
    assert tremor_left(run) == pytest.approx(0.25)


def test_leaving_is_timed_from_where_the_operator_means_to():
    taught = FAMILIES["lines"](np.random.default_rng(0), 0.005)
    scenario = TASKS["unexpected-obstacle"].meaning(taught, np.random.default_rng(1))
    detour = scenario.detour
    # A robot that follows the meant path exactly, at 0.1 m/s.
    count = int(detour.path.length_m / 0.001)
    places = np.linspace(0, detour.path.length_m, count)
    run = run_of(detour.path.at(places), progress_m=places)
    away = leave_s(run, scenario)
    assert 0.0 < away < 1.0
    assert np.isnan(leave_s(run, Scenario(scenario.meant)))
    assert measures(run, scenario)["clearance_mm"] == pytest.approx(15.0, abs=0.5)


def test_every_law_says_where_it_is_from():
    assert len({law.name for law in LAWS}) == len(LAWS)
    for law in LAWS:
        assert law.source
        law.rules(FAMILIES["lines"](np.random.default_rng(0), 0.005).task)
    assert DEFAULT_LAW in {law.name for law in LAWS}


def test_an_operator_who_never_arrives_is_said_not_to():
    taught = FAMILIES["lines"](np.random.default_rng(0), 0.005)
    shown = [
        demonstrated(
            ClosedLoopOperator(STEADY, taught.path, np.random.default_rng(k)),
            taught,
            f"d{k}",
            period_s=PERIOD_S,
            most_s=60.0,
        )
        for k in range(2)
    ]
    model = learn(taught.task, shown)
    run = perform(
        ClosedLoopOperator(STEADY, taught.path, np.random.default_rng(9)),
        LaggingTool(taught.path.points[0], np.array([0.0, 0.0, 0.0, 1.0]), 0.03),
        model,
        LAWS[-1].rules(taught.task),
        period_s=PERIOD_S,
        most_s=1.0,
    )
    assert not run.arrived
    assert len(run.robot) == 100


@pytest.mark.parametrize("suffix", [".png", ".svg"])
def test_the_study_draws_its_result(tmp_path, capsys, suffix):
    file = tmp_path / f"worth{suffix}"
    tiny = [f"--set={name}={value}" for name, value in ASSISTANCE.tiny.items()]
    assert main(["study", "assistance", "--trials", "1", *tiny, "--picture", str(file)]) == 0
    assert file.stat().st_size > 5000
    assert "insistence" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["assistance", "--picture", "a.gif"], "ends in .png or .svg"),
        (["restart", "--picture", "a.png"], "those that have: assistance"),
    ],
)
def test_a_picture_that_cannot_be_is_a_users_mistake(capsys, arguments, says):
    tiny = [f"--set={name}={value}" for name, value in ASSISTANCE.tiny.items()]
    tiny = tiny if arguments[0] == "assistance" else []
    assert main(["study", *arguments, "--trials", "1", *tiny]) == 2
    assert says in capsys.readouterr().err


@pytest.mark.parametrize("study", [EXPERIMENT_1, EXPERIMENT_2, EXPERIMENT_3])
def test_the_experiments_of_chapter_3_are_run_to_their_end(study):
    settings = study.settings_from([f"{name}={value}" for name, value in study.tiny.items()])
    rows = study.trial(settings, np.random.default_rng(1))
    assert [row.method for row in rows] == ["none", "chapter-3"]
    for row in rows:
        assert row.measures["arrived"] == 1.0
        assert row.measures["error_mm"] < 20.0


def test_an_arm_among_its_obstacles_follows_an_operator_without_touching_them():
    settings = EXPERIMENT_1.settings_from(["law=insistence", "demonstrations=2"])
    assert settings.robot == "physics"
    for row in EXPERIMENT_1.trial(settings, np.random.default_rng(2)):
        assert row.measures["arrived"] == 1.0
        assert row.measures["collisions"] == 0.0
        assert row.measures["error_mm"] < 15.0


def test_a_robot_that_nobody_simulates_is_reported():
    settings = EXPERIMENT_1.settings_from(["robot=psychics", "demonstrations=2"])
    with pytest.raises(UserError, match="did you mean physics"):
        EXPERIMENT_1.trial(settings, np.random.default_rng(2))


@pytest.mark.parametrize("study", [FORCE_TASK_2D, FORCE_TASK_3D])
def test_a_robot_led_by_its_tool_is_recognized_and_touches_nothing(study):
    settings = study.settings_from(["demonstrations=2", "performances=1"])
    assert settings.robot == "physics"
    rows = study.trial(settings, np.random.default_rng(3))
    orders = {row.setting["order"] for row in rows}
    assert orders == ({"trained order", "unseen order"} if study is FORCE_TASK_2D else orders)
    for row in rows:
        assert row.measures["arrived"] == 1.0
        assert row.measures["collisions"] == 0.0
        assert row.measures["error_mm"] < 10.0
        assert row.measures["accuracy"] > (0.8 if row.setting["recognizer"] == "lhmm" else 0.9)


def test_the_unseen_order_is_made_of_the_strokes_that_were_taught():
    taught = FAMILIES["surface"](np.random.default_rng(0), 0.01)
    other = unseen_order(taught, np.random.default_rng(0))
    assert other.meant.length_m == pytest.approx(taught.path.length_m, rel=1e-3)
    assert other.ends_m is not None
    assert other.ends_m[-1] == pytest.approx(taught.ends_m[-1])
    gestemes = [taught.task.state(state).gestemes[0] for state in other.states]
    assert gestemes == ["stroke", "rise", "bow", "stroke", "bow", "rise"]
