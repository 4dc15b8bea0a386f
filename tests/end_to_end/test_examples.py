"""Every example runs as its first lines say, and does what it is for."""

from __future__ import annotations

import lzma
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from hmcs.bus.messages import LastStepsQuestion
from hmcs.bus.verbs import LAST_STEPS
from hmcs.motion.steps import Step
from hmcs.recognition.model_file import load_model
from support.hand import Scene, Watcher
from support.stack import CELL, PATIENT_FIXTURE, Stack, clean_environment, run_python

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
KEPT = ROOT / "shared/tests/recordings/kept/reach-and-lift.mcap.xz"
SCREEN_LINES = 80


def run(name: str, *words: object, folder: Path) -> list[str]:
    """Run an example to its end in a folder of its own; return the lines it printed."""
    done = run_python([str(EXAMPLES / name), *map(str, words)], folder)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_there_are_eight_and_each_fits_on_a_screen() -> None:
    files = sorted(EXAMPLES.glob("*.py"))
    assert [file.name[:3] for file in files] == [f"0{k}_" for k in range(1, 9)]
    for file in files:
        assert len(file.read_text(encoding="utf-8").splitlines()) <= SCREEN_LINES, file.name


def test_the_first_recognizes_the_states_one_after_the_other(tmp_path: Path) -> None:
    believed = [line.split()[2] for line in run("01_recognize.py", folder=tmp_path)]
    assert len(believed) > 40
    assert list(dict.fromkeys(believed)) == ["reach", "turn", "lift"]


def test_a_model_is_learned_from_csv_files_and_kept(tmp_path: Path) -> None:
    lines = run("02_train_from_csv.py", "mine.hmcs", folder=tmp_path)
    assert load_model(tmp_path / "mine.hmcs").state_names == ("reach", "turn", "lift")
    assert int(lines[-1].partition("%")[0]) > 80


def test_the_law_goes_from_free_motion_to_a_hard_ruler(tmp_path: Path) -> None:
    rows = [line.split() for line in run("03_fixture_law.py", folder=tmp_path)[1:]]
    numbers = np.array(rows, dtype=float)
    np.testing.assert_allclose(numbers[0], [0.5, 0.05, 0.025, 0.1, 0.05])
    np.testing.assert_allclose(numbers[-1], [1.0, 0.1, 0.0, 0.1, 0.0])


def test_the_own_recognizer_recognizes_here_and_on_the_bus(
    scene: Scene, steps: list[Step], model_file: Path, performance_file: Path, tmp_path: Path
) -> None:
    said = run("04_own_recognizer.py", model_file, performance_file, folder=tmp_path)
    names = load_model(model_file).state_names
    scene.stack.until_ready(
        scene.stack.start_program(
            "nearest_direction", "mine", EXAMPLES / "04_own_recognizer.py", "--model", model_file
        )
    )
    scene.in_step(steps[:50])
    beliefs = [received.body for received in scene.watcher.beliefs]
    assert [belief.step for belief in beliefs] == list(range(50))
    assert [names[int(b.probabilities.argmax())] for b in beliefs] == said[:50]


def test_the_own_device_drives_the_own_robot_through_a_fixture_controller(stack: Stack) -> None:
    bus = stack.open_bus("observer", "looks")
    stack.watch(bus)
    watcher = Watcher(bus)
    robot = stack.start_program("robot", "point", EXAMPLES / "07_own_robot.py")
    stack.until_ready(robot, stack.start("fixture_controller", "f", *PATIENT_FIXTURE))
    stack.until_ready(stack.start_program("input_device", "circle", EXAMPLES / "05_own_device.py"))
    stack.until(lambda: len(watcher.steps) > 10)
    assert [received.body.index for received in watcher.steps[:10]] == list(range(10))
    assert not watcher.motions[0].body.dead_man

    def way_m() -> float:
        positions = np.array([received.body.tool_position for received in watcher.robot])
        return float(np.ptp(positions, axis=0).max())

    stack.until(lambda: way_m() > 0.05)
    (answer,) = LAST_STEPS.ask(
        bus, LastStepsQuestion(count=5, before=8), service="input_device", timeout_s=5.0
    )
    assert [step.index for step in answer.body.steps] == [3, 4, 5, 6, 7]


def test_a_program_without_hmcs_hears_beliefs(
    scene: Scene, steps: list[Step], model_file: Path
) -> None:
    stack = scene.stack
    stack.bring_up("recognizer", "r", "--model", model_file)
    with (
        subprocess.Popen(
            [sys.executable, str(EXAMPLES / "06_listen_without_hmcs.py"), stack.endpoint, CELL],
            env=clean_environment(),
            stdout=subprocess.PIPE,
            text=True,
        ) as listener,
        ThreadPoolExecutor(1) as aside,
    ):
        try:
            assert listener.stdout is not None
            line = aside.submit(listener.stdout.readline)
            scene.hand.play(steps, 20.0)
            stack.until(line.done)
        finally:
            listener.kill()
    _, step, state, probability = line.result().split()
    assert step.removesuffix(":").isdigit()
    assert state in load_model(model_file).state_names
    assert 0.0 <= float(probability) <= 1.0


@pytest.fixture
def built(tmp_path: Path) -> Path:
    """The C++ client, where there are a compiler and the libraries for it."""
    missing = [name for name in ("cmake", "c++") if shutil.which(name) is None]
    if missing:
        pytest.skip(f"{' and '.join(missing)}: not installed")
    source, folder = EXAMPLES / "listen_in_cpp", tmp_path / "build"
    made = subprocess.run(
        ["cmake", "-S", source, "-B", folder], capture_output=True, text=True, check=False
    )
    if made.returncode:
        found = re.search(r'configuration file provided by "(\w+)"', made.stderr)
        assert found is not None, made.stderr
        pytest.skip(f"{found[1]} is not installed")
    subprocess.run(["cmake", "--build", folder], check=True, capture_output=True)
    return folder / "listen"


def test_a_program_in_cpp_hears_beliefs_and_the_robot(
    built: Path, scene: Scene, steps: list[Step], model_file: Path
) -> None:
    stack = scene.stack
    stack.bring_up("recognizer", "r", "--model", model_file)
    robot = stack.start_program("robot", "point", EXAMPLES / "07_own_robot.py")
    stack.until_ready(robot)
    heard = stack.folder / "heard.txt"
    with heard.open("wb") as stream:
        listener = subprocess.Popen(
            [str(built), stack.endpoint, CELL], stdout=stream, stderr=subprocess.STDOUT
        )
    try:
        scene.hand.play(steps, 20.0)

        def heard_both() -> tuple[str, str] | None:
            assert listener.poll() is None, heard.read_text()
            lines = heard.read_text().splitlines()[:-1]
            beliefs = [line for line in lines if line.startswith("step ")]
            robots = [line for line in lines if line.startswith("point: ")]
            return (beliefs[0], robots[0]) if beliefs and robots else None

        belief, state = stack.until(heard_both)
    finally:
        listener.kill()
        listener.wait()
    _, step, name, probability = belief.split()
    assert step.removesuffix(":").isdigit()
    assert name in load_model(model_file).state_names
    assert 0.0 <= float(probability) <= 1.0
    assert re.fullmatch(r"point: -?\d\.\d{3} -?\d\.\d{3} -?\d\.\d{3} m, \w+", state)


def test_a_recording_is_reported_in_numbers_and_as_demonstrations(tmp_path: Path) -> None:
    file = tmp_path / "kept.mcap"
    file.write_bytes(lzma.decompress(KEPT.read_bytes()))
    lines = run("08_read_recording.py", file, folder=tmp_path)
    assert lines[0] == "0.3 s, whole"
    assert "27 motion/1" in [line.strip() for line in lines]
    assert lines[-1] == "demonstration 0: 0.2 s, reach, lift"


@pytest.mark.parametrize("number", range(1, 9))
def test_the_readme_of_the_examples_names_each(number: int) -> None:
    (file,) = EXAMPLES.glob(f"0{number}_*.py")
    assert f"({file.name})" in (EXAMPLES / "README.md").read_text(encoding="utf-8")
