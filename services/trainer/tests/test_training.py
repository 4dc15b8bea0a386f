"""Training from the command line: a model file, a performance, or one clear line."""

import re

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs.motion.demonstrations import read_csv, write_csv
from hmcs.motion.lasa import read_drawing, shapes
from hmcs.recognition.model_file import load_model
from hmcs.task import load_task
from hmcs_trainer.__main__ import main
from hmcs_trainer.training import train

TASK = "human-shapes"
SHAPES = ["GShape", "NShape", "PShape", "JShape", "Snake"]
TWO_OF_EACH = [f"lasa:{shape}/1-2" for shape in SHAPES]


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    folder = tmp_path_factory.mktemp("trained")
    code = main(
        [
            TASK,
            *TWO_OF_EACH,
            "--output",
            str(folder / "m.hmcs"),
            "--name",
            "mine",
            "--performance",
            *[f"lasa:{shape}/3" for shape in SHAPES],
            "--performance-output",
            str(folder / "p.csv"),
        ]
    )
    assert code == 0
    return folder


@pytest.mark.long
def test_a_model_names_its_task_and_every_demonstration(trained):
    model = load_model(trained / "m.hmcs")
    assert model.name == "mine"
    assert model.task == load_task(TASK)
    assert model.demonstrations == tuple(f"lasa:{shape}/{k}" for shape in SHAPES for k in (1, 2))


def test_a_performance_never_jumps_and_carries_every_state(trained):
    performance = read_csv(trained / "p.csv")
    task = load_task(TASK)
    assert list(dict.fromkeys(performance.states)) == [state.name for state in task.states]
    np.testing.assert_allclose(performance.positions[0], task.robot.tool_start_m)
    speeds = np.linalg.norm(np.diff(performance.positions, axis=0), axis=1) / np.diff(
        performance.time_s
    )
    assert speeds.max() < 0.5


def test_a_drawing_enters_the_workspace_as_the_task_says():
    task = load_task(TASK)
    drawing = read_drawing("GShape", 1, task)
    assert set(drawing.states) == {"write-g"}
    assert (drawing.positions[:, 0] == 0).all()
    # A G begins at its upper right end: drawn leftward at first, which is +y seen from behind.
    assert drawing.positions[200, 1] > 0
    assert len(shapes()) == 30


def test_a_csv_demonstration_trains_like_the_drawings_it_holds(trained, tmp_path):
    task = load_task(TASK)
    references = []
    for shape in SHAPES:
        for number in (1, 2):
            path = tmp_path / f"{shape}-{number}.csv"
            write_csv(path, read_drawing(shape, number, task))
            references.append(str(path))
    assert main([TASK, *references, "--output", str(tmp_path / "csv.hmcs")]) == 0
    from_csv, from_drawings = load_model(tmp_path / "csv.hmcs"), load_model(trained / "m.hmcs")
    np.testing.assert_array_equal(
        from_csv.knowledge.parameters.means, from_drawings.knowledge.parameters.means
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["no-such-task", "lasa:GShape/1"], "no-such-task"),
        ([TASK, "lasa:GShape/8"], "lasa:GShape/8: there are drawings 1 to 7"),
        ([TASK, "lasa:Circle/1"], "no such shape; shapes are Angle"),
        ([TASK, "lasa:Sine/1"], "Sine is no gesteme of a state of task 'human-shapes'"),
        ([TASK, "lasa:GShape"], "write lasa:SHAPE/NUMBER"),
        ([TASK, "lasa:GShape/5-1"], "the first number is larger"),
        ([TASK, "lasa:GShape/1"], "gesteme 'NShape'.*has no demonstration"),
        (["lines-through-obstacles", "lasa:GShape/1"], "does not say how drawings enter"),
        ([TASK, "nowhere.csv"], "nowhere.csv"),
        ([TASK, *TWO_OF_EACH, "--name", "a/b"], "model 'a/b' cannot be part of a key"),
    ],
)
def test_a_mistake_ends_with_code_2_and_one_clear_line(arguments, message, tmp_path, capfd):
    output = tmp_path / "m.hmcs"
    assert main([*arguments, "--output", str(output)]) == 2
    error = capfd.readouterr().err
    assert re.search(message, error), error
    assert "Traceback" not in error
    assert not output.exists()


@pytest.mark.parametrize(
    "setting",
    [
        "temperature=0",
        "temperature=-4",
        "prune_nats=nan",
        "background_quantile=2",
        "window_factor=-1",
        "alarm_window_steps=0",
        "filter.unknown_after=0",
        "filter.any_state=3",
        "prior_demonstrations=-2",
        "alignment_sigma=1e300",
        "unknown_rise=1e308",
    ],
)
def test_settings_that_make_no_model_are_reported_and_nothing_is_written(setting, tmp_path):
    name, _, value = setting.partition("=")
    with pytest.raises(UserError), np.errstate(all="ignore"):
        train(TASK, TWO_OF_EACH, tmp_path / "m.hmcs", settings={name: value})
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_learned_for_a_stack_of_another_task(tmp_path, capfd):
    output = tmp_path / "m.hmcs"
    words = [TASK, *TWO_OF_EACH, "--output", str(output), "--stack-task"]
    assert main([*words, "/tasks/mine.yaml"]) == 0
    assert "the stack is for /tasks/mine.yaml" in capfd.readouterr().err
    assert not output.exists()
