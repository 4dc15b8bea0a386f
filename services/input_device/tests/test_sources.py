"""Sources: those that come along, and those that other distributions add."""

from __future__ import annotations

import sys
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hmcs.bus import messages
from hmcs.bus.messages import Motion
from hmcs.errors import UserError
from hmcs.motion.demonstrations import Demonstration, read_csv, write_csv
from hmcs.motion.paths import Path as Curve
from hmcs.motion.steps import steps_of
from hmcs.task import find_task, load_task
from hmcs_input_device.played import BUILT_IN
from hmcs_input_device.settings import InputDeviceSettings
from hmcs_input_device.sources import LIVE, Source, open_source
from support.recordings import BEGUN_NS, PERIOD_NS, Maker

SHAPES = load_task("human-shapes")
LINES = load_task("lines-through-obstacles")
LINES_CSV = find_task("lines-through-obstacles").with_suffix(".csv")


def opened(task: str = SHAPES.name, **settings: Any) -> Source:
    return open_source(InputDeviceSettings(task=task, **settings), load_task(task), BUILT_IN)


def played(source: Source) -> np.ndarray:
    """All positions with the dead-man held, shape (T, 3)."""
    samples = (source.sample(k / 100) for k in range(int(source.duration_s * 100) + 1))
    return np.array([s.position for s in samples if s is not None and s.dead_man])


# --- recorded -------------------------------------------------------------------------------------


def test_a_recording_is_played_from_its_file(line_file: Path, line: Demonstration) -> None:
    source = opened(source="recorded", demonstration=line_file, lead_in_s=0.1)
    np.testing.assert_allclose(played(source)[[0, -1]], line.positions[[0, -1]], atol=1e-9)


def test_recorded_without_a_demonstration_says_what_to_give() -> None:
    with pytest.raises(UserError, match="--demonstration"):
        opened(source="recorded")


def test_a_recording_that_is_none_is_named_with_its_line(tmp_path: Path) -> None:
    file = tmp_path / "bad.csv"
    file.write_text("time_s,x_m,y_m\n0,0,0\n1,nan,0\n")
    with pytest.raises(UserError, match=r"bad\.csv:3: x_m is nan"):
        opened(source="recorded", demonstration=file)


def test_a_dead_zone_larger_than_the_recording_is_an_error_before_it_starts(
    line_file: Path,
) -> None:
    assert opened(source="recorded", demonstration=line_file, dead_zone_m=0.19)
    small = line_file.with_name("small.csv")
    write_csv(
        small, Demonstration("s", np.arange(2.0), np.array([[0, 0, 0], [0, 0.1, 0]]), (None,) * 2)
    )
    with pytest.raises(UserError, match=r"small\.csv: moves at most 0\.1 m .* dead zone of 0\.15"):
        opened(source="recorded", demonstration=small, dead_zone_m=0.15)


def test_switches_of_a_recording_without_labels_cannot_be_marked(line_file: Path) -> None:
    with pytest.raises(UserError, match=r"no labels.*add a column 'state'"):
        opened(source="recorded", demonstration=line_file, mark_switches=True)


# --- synthetic ------------------------------------------------------------------------------------


def test_a_simulated_operator_is_the_same_for_the_same_seed() -> None:
    one, same, other = (played(opened(seed=seed)) for seed in (3, 3, 4))
    np.testing.assert_array_equal(one, same)
    assert one.shape != other.shape or not np.allclose(one, other)


def test_it_starts_where_the_robot_does_and_stays_on_the_axes_that_are_looked_at() -> None:
    positions = played(opened(noise=0))
    np.testing.assert_allclose(positions[0], SHAPES.robot.tool_start_m)
    np.testing.assert_allclose(positions[:, 0], SHAPES.robot.tool_start_m[0])
    assert np.ptp(positions[:, 1:], axis=0).min() > 0.05


def test_it_makes_steps_for_every_shipped_task() -> None:
    for task in (SHAPES, LINES):
        assert len(steps_of(played(opened(task.name)), task.dead_zone_m)) > 20


def test_it_marks_where_another_state_is_performed() -> None:
    source = opened(LINES.name, demonstration=LINES_CSV, noise=0, mark_switches=True)
    samples = [source.sample(k / 100) for k in range(int(source.duration_s * 100))]
    down = np.array([sample is not None and sample.pedal for sample in samples])
    lines = sum(1 for _ in groupby(read_csv(LINES_CSV).states))
    assert np.diff(down.astype(int), prepend=0).clip(0).sum() == lines > 3


def test_it_follows_the_lines_of_a_demonstration() -> None:
    source = opened(LINES.name, demonstration=LINES_CSV, noise=0)
    positions = played(source)
    np.testing.assert_allclose(positions[0], (0.55, 0.18, 0.38), atol=1e-9)
    np.testing.assert_allclose(positions[-1], (0.65, -0.16, 0.40), atol=0.025)
    for corner in ((0.55, 0.18, 0.60), (0.55, 0.0, 0.60), (0.65, -0.16, 0.60)):
        assert np.linalg.norm(positions - corner, axis=1).min() < 0.02


def test_it_follows_the_order_of_the_task_along_a_models_paths(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Only the paths of a model matter here; what a model file is stands in its own tests.
    steps = {"up": (0, 0, 1), "across": (0, -1, 0), "ahead": (1, 0, 0), "down": (0, 0, -1)}
    paths = {n: Curve(np.array([(0, 0, 0), d]) * 0.1) for n, d in steps.items()}
    monkeypatch.setattr(
        "hmcs_input_device.played.load_model", lambda _: type("M", (), {"paths": paths})
    )
    positions = played(opened(LINES.name, model="m.hmcs", noise=0))
    moved = positions[-1] - positions[0]
    np.testing.assert_allclose(moved, (0.1, -0.1, 0), atol=0.03)
    del paths["down"]
    with pytest.raises(UserError, match="no gesteme down of task"):
        opened(LINES.name, model="m.hmcs")


def test_a_demonstration_with_a_foreign_state_is_refused_with_the_choices(tmp_path: Path) -> None:
    file = tmp_path / "f.csv"
    file.write_text("time_s,x_m,y_m,state\n0,0,0,lift\n1,1,1,fly\n2,2,2,fly\n")
    with pytest.raises(UserError, match=r"sample 2 is of state 'fly'.*carry, lift, lower, over"):
        opened(LINES.name, demonstration=file)


# --- devices of other distributions ---------------------------------------------------------------


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Install a distribution with two devices, one of which cannot be loaded."""
    (tmp_path / "fake_arm.py").write_text(
        "import numpy as np\n"
        "from hmcs.errors import UserError\n"
        "from hmcs_input_device.sources import LIVE, DeviceSample\n"
        "class Arm:\n"
        "    rate_hz, duration_s, reach_m = 500.0, LIVE, None\n"
        "    def sample(self, elapsed_s):\n"
        "        return DeviceSample(np.ones(3), np.zeros(3), dead_man=True)\n"
        "    def close(self): pass\n"
        "def open_arm(settings, task):\n"
        "    if 'port' not in settings.options:\n"
        "        raise UserError('options: the arm needs a port')\n"
        "    return Arm()\n"
    )
    info = tmp_path / "fake_arm-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: fake-arm\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[hmcs.input_sources]\narm = fake_arm:open_arm\nbroken = fake_arm:nothing\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "fake_arm", raising=False)


@pytest.mark.usefixtures("installed")
def test_another_distribution_can_add_a_device() -> None:
    source = opened(source="arm", options={"port": 3})
    assert (source.rate_hz, source.duration_s) == (500, LIVE)
    sample = source.sample(None)
    assert sample is not None
    assert sample.dead_man
    with pytest.raises(UserError, match="needs a port"):
        opened(source="arm")


@pytest.mark.usefixtures("installed")
def test_a_device_that_cannot_be_loaded_or_is_not_there_is_a_users_mistake() -> None:
    with pytest.raises(UserError, match=r"fake_arm:nothing.*cannot be loaded"):
        opened(source="broken")
    with pytest.raises(
        UserError,
        match="choose of: arm, broken, gamepad, keyboard, mouse, page, recorded, recording, "
        "ros2, simulated, spacemouse, synthetic",
    ):
        opened(source="joystick")


def test_a_recording_is_played_without_the_devices_that_did_not_drive(tmp_path: Path) -> None:
    maker = Maker(tmp_path)
    recording = maker.begin()
    for number in range(60):
        for boot, x_m, dead_man in (("hand", 0.001 * number, number >= 10), ("page", 5.0, False)):
            motion = Motion(
                position=np.array([x_m, 0.0, 0.0]), velocity=np.zeros(3), dead_man=dead_man
            )
            device = messages.Source(service="input_device", instance=boot, boot=boot)
            fields = maker.fields(motion, number, device)
            recording.write("k", fields, BEGUN_NS + number * PERIOD_NS, None)
    recording.finish()
    source = opened(source="recording", demonstration=recording.path, lead_in_s=0.1)
    samples = [source.sample(0.1 + 0.01 * k + 1e-4) for k in range(50)]
    places_m = [round(sample.position[0], 6) for sample in samples if sample is not None]
    assert places_m == [round(0.001 * k, 6) for k in range(10, 60)]
