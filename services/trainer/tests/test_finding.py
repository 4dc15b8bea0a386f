"""States found without labels, and what is reported of recordings that are trained from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from hmcs.bus.messages import Motion
from hmcs.errors import UserError
from hmcs.motion.demonstrations import Demonstration, read_csv, write_csv
from hmcs.recognition.registry import DEFAULT
from hmcs.recognition.segments import LearningError
from hmcs.recordings import json_codec
from hmcs.recordings.file_rotation import Preface, Recording
from hmcs.recordings.labels import labels_beside, labels_of
from hmcs.recordings.reading import RecordingError, read
from hmcs.task import find_task, load_task
from hmcs_trainer.__main__ import main
from hmcs_trainer.judging import judged
from hmcs_trainer.recorded import recording_findings
from hmcs_trainer.references import read_references
from hmcs_trainer.training import train
from support.recordings import BEGUN_NS, KEYS, PERIOD_NS, ROOMY, Maker, Said

LINES = load_task("lines-through-obstacles")
CORNERS = read_csv(find_task(LINES.name).with_suffix(".csv"))
PERIOD_S = PERIOD_NS / 1e9


def shown(seed: int) -> Demonstration:
    """The four lines of the task by a hand that errs."""
    random = np.random.default_rng(seed)
    time_s = np.arange(0.0, CORNERS.time_s[-1], PERIOD_S)
    states = [CORNERS.states[k - 1] for k in np.searchsorted(CORNERS.time_s, time_s, "right")]
    lines = np.stack([np.interp(time_s, CORNERS.time_s, c) for c in CORNERS.positions.T], axis=1)
    wander = np.cumsum(random.normal(scale=3e-4, size=lines.shape), axis=0)
    return Demonstration(f"take-{seed}", time_s, lines + wander, tuple(states))


def hand(positions: NDArray[np.float64], *, gap_at: int | None = None, gap: int = 0) -> list[Said]:
    """A hand that takes hold, moves, lets go; at `gap_at` it lets go for so many samples."""

    def sample(position: NDArray[np.float64], dead_man: bool) -> Said:
        motion = Motion(position=position, velocity=np.zeros(3), dead_man=dead_man)
        return KEYS.motion, motion

    said = [sample(positions[0], False)]
    for k, position in enumerate(positions):
        if k == gap_at:
            said += [sample(positions[k - 1], False)] * gap
        said.append(sample(position, True))
    return [*said, sample(positions[-1], False)]


def true_changes_s(demonstration: Demonstration, begins_s: float) -> list[float]:
    at = np.flatnonzero(demonstration.switches[1:]) + 1
    return [begins_s + float(demonstration.time_s[k]) for k in at]


def within_s(steps: float) -> float:
    """How long the hand takes for so many steps of the dead zone."""
    lengths = np.linalg.norm(np.diff(CORNERS.positions, axis=0), axis=1)
    speed = lengths / np.diff(CORNERS.time_s)
    return steps * LINES.dead_zone_m / float(speed.min())


def found_changes_s(file: Path) -> list[float]:
    content = read(file)
    labels = labels_of(content)
    return [
        (label.begin_ns - content.first_ns) / 1e9
        for before, label in pairwise(labels)
        if label.begin_ns == before.end_ns
    ]


@pytest.fixture
def maker(tmp_path: Path) -> Maker:
    return Maker(tmp_path / "takes")


@pytest.fixture
def takes(maker: Maker) -> list[str]:
    return [str(maker.write(hand(shown(k).positions), f"take-{k}")) for k in range(1, 4)]


def test_changes_are_found_within_a_few_steps_of_the_true_ones(
    takes: list[str], tmp_path: Path
) -> None:
    heard: list[str] = []
    train(LINES.name, takes, tmp_path / "m.hmcs", find_states=True, progress=heard.append)
    for k, file in enumerate(takes, start=1):
        true = true_changes_s(shown(k), PERIOD_S)
        np.testing.assert_allclose(found_changes_s(Path(file)), true, atol=within_s(3))
    assert any("4 states of" in line and "found in 3 demonstrations" in line for line in heard)
    assert any(line.startswith("take-1.mcap: s1 0.0–") for line in heard)


def test_performances_in_one_recording_are_found_at_their_own_times(
    maker: Maker, tmp_path: Path
) -> None:
    # The hand is brought back released, and lets go in the middle of its second performance.
    said, begins, pauses = [], [], (0, 40, 0)
    for k, pause in enumerate(pauses, start=1):
        begins.append((len(said) + 1) * PERIOD_S)
        said += hand(shown(k).positions, gap_at=pause and 30, gap=pause)
    file = maker.write(said)
    train(LINES.name, [str(file)], tmp_path / "m.hmcs", find_states=True)
    true = [
        at
        for k, (begin_s, pause) in enumerate(zip(begins, pauses, strict=True), start=1)
        for at in true_changes_s(shown(k), begin_s + pause * PERIOD_S)
    ]
    np.testing.assert_allclose(found_changes_s(file), true, atol=within_s(3))
    assert [label.state for label in labels_of(read(file))] == ["s1", "s2", "s3", "s4"] * 3


@pytest.mark.long
def test_what_was_found_trains_anew_to_the_same_accuracy(takes: list[str], tmp_path: Path) -> None:
    model = train(LINES.name, takes, tmp_path / "m.hmcs", find_states=True)
    task_file = tmp_path / "m.yaml"
    task = load_task(task_file)
    assert [state.name for state in task.states] == ["s1", "s2", "s3", "s4"]
    again = train(str(task_file), takes, tmp_path / "again.hmcs")
    assert again.task == model.task
    scores = [
        judged(made.task, read_references(takes, made.task), None, DEFAULT).scores
        for made in (model, again)
    ]
    assert scores[0].accuracy == scores[1].accuracy > 0.9
    for name, path in model.paths.items():
        np.testing.assert_array_equal(path.points, again.paths[name].points)


def test_finding_again_writes_over_what_was_found(takes: list[str], tmp_path: Path) -> None:
    train(LINES.name, takes, tmp_path / "m.hmcs", find_states=True)
    first = labels_beside(Path(takes[0])).read_bytes()
    train(LINES.name, takes, tmp_path / "m.hmcs", find_states=True)
    assert labels_beside(Path(takes[0])).read_bytes() == first


def test_labels_and_tasks_that_somebody_wrote_are_never_written_over(
    takes: list[str], tmp_path: Path
) -> None:
    beside = labels_beside(Path(takes[1]))
    beside.write_text("begin_s,end_s,state\n0,1,lift\n")
    with pytest.raises(UserError, match=r"take-2\.labels\.csv: has labels that somebody set"):
        train(LINES.name, takes, tmp_path / "m.hmcs", find_states=True)
    beside.unlink()
    own = tmp_path / "own.yaml"
    own.write_text(find_task(LINES.name).read_text())
    with pytest.raises(UserError, match=r"own\.yaml: is there already"):
        train(str(own), takes, tmp_path / "own.hmcs", find_states=True)
    assert not list(tmp_path.rglob("*.labels.csv"))
    assert own.read_text() == find_task(LINES.name).read_text()
    assert not list(tmp_path.glob("*.hmcs"))


@pytest.fixture
def tables(tmp_path: Path) -> list[str]:
    files = [str(tmp_path / f"take-{seed}.csv") for seed in (1, 2)]
    for seed, file in enumerate(files, start=1):
        write_csv(file, shown(seed))
    return files


def test_labels_found_beside_csv_files_train_anew_to_the_same_model(
    tables: list[str], tmp_path: Path
) -> None:
    before = [Path(file).read_bytes() for file in tables]
    heard: list[str] = []
    model = train(LINES.name, tables, tmp_path / "m.hmcs", find_states=True, progress=heard.append)
    assert [Path(file).read_bytes() for file in tables] == before
    assert any(f"labels written to {labels_beside(Path(tables[0]))}" in line for line in heard)
    again = train(str(tmp_path / "m.yaml"), tables, tmp_path / "again.hmcs")
    assert again.task == model.task
    for name, path in model.paths.items():
        np.testing.assert_array_equal(path.points, again.paths[name].points)


def test_labels_of_another_csv_file_of_that_name_do_not_count(
    tables: list[str], tmp_path: Path
) -> None:
    train(LINES.name, tables, tmp_path / "m.hmcs", find_states=True)
    write_csv(tables[0], shown(7))
    heard: list[str] = []
    train(LINES.name, tables[:1], tmp_path / "n.hmcs", progress=heard.append)
    assert any("take-1.labels.csv are of another demonstration" in line for line in heard)


def test_labels_that_cannot_be_of_a_csv_file_are_reported_with_their_line(
    tables: list[str], tmp_path: Path
) -> None:
    labeled(tables[0], "0,1,lift\n9000,9001,carry\n")
    assert "take-1.labels.csv:3: label 'carry'" in refused(tables[:1], tmp_path)
    labeled(tables[0], "0,1500,lift\n")
    assert "read like milliseconds" in refused(tables[:1], tmp_path)
    assert "is a file of labels" in refused([str(labels_beside(Path(tables[0])))], tmp_path)


def test_what_was_found_is_a_task_of_the_name_of_its_model(
    tables: list[str], tmp_path: Path
) -> None:
    model = train(LINES.name, tables, tmp_path / "mine.hmcs", find_states=True)
    assert (model.name, load_task(tmp_path / "mine.yaml").name) == ("mine", "mine")
    model = train(LINES.name, tables, tmp_path / "b.hmcs", name="other", find_states=True)
    assert (model.name, load_task(tmp_path / "b.yaml").name) == ("other", "other")


def test_a_slip_of_the_hand_is_left_out_and_reported(maker: Maker, tmp_path: Path) -> None:
    positions = shown(1).positions
    slip = np.repeat(positions[:1], 5, axis=0) + np.linspace(0, 1e-3, 5)[:, None]
    file = maker.write([*hand(slip), *hand(positions), *hand(shown(2).positions)])
    heard: list[str] = []
    train(LINES.name, [str(file)], tmp_path / "m.hmcs", find_states=True, progress=heard.append)
    assert any("take.mcap#1: moves hardly at all from 0.0 s to 0.1 s" in line for line in heard)
    assert any("found in 2 demonstrations" in line for line in heard)


def still(count: int) -> NDArray[np.float64]:
    return np.zeros((count, 3))


@pytest.mark.parametrize(
    "positions", [still(30), still(30) + np.linspace(0, 0.002, 30)[:, None]], ids=["still", "short"]
)
def test_a_recording_nothing_can_be_found_in_is_named(
    maker: Maker, tmp_path: Path, takes: Sequence[str], positions: NDArray[np.float64]
) -> None:
    bad = str(maker.write(hand(positions), "bad"))
    with pytest.raises(LearningError, match=r"bad\.mcap"):
        train(LINES.name, [*takes, bad], tmp_path / "m.hmcs", find_states=True)
    assert not list(tmp_path.rglob("*.labels.csv"))


def test_the_command_finds_states_too(
    takes: list[str], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    words = [LINES.name, *takes, "--output", str(tmp_path / "m.hmcs"), "--find-states"]
    assert main(words) == 0
    assert "4 states of" in capfd.readouterr().err


# --- recordings that cannot be used as they are ---------------------------------------------------


def refused(files: list[str], tmp_path: Path) -> str:
    with pytest.raises(UserError) as heard:
        train(LINES.name, files, tmp_path / "m.hmcs")
    assert not (tmp_path / "m.hmcs").exists()
    return str(heard.value)


def labeled(file: str, rows: str) -> None:
    labels_beside(Path(file)).write_text(f"begin_s,end_s,state\n{rows}")


def test_a_label_that_is_no_state_is_reported_with_its_recording_time_and_the_nearest(
    takes: list[str], tmp_path: Path
) -> None:
    labeled(takes[1], "0.5,1.5,lift\n1.5,2.5,cary\n")
    text = refused(takes[1:2], tmp_path)
    assert "take-2.mcap" in text
    assert "'cary' at 1.50 s is no state of task 'lines-through-obstacles'" in text
    assert "did you mean 'carry'?" in text
    assert "states are lift, carry" in text


def test_labels_over_one_another_are_reported_with_their_line(
    takes: list[str], tmp_path: Path
) -> None:
    labeled(takes[0], "0.5,1.5,lift\n1.0,2.5,carry\n")
    assert "take-1.labels.csv:3: begins before the label above it" in refused(takes[:1], tmp_path)


def test_a_recording_without_labels_is_refused_with_three_remedies(
    takes: list[str], tmp_path: Path
) -> None:
    text = refused(takes[:1], tmp_path)
    assert "take-1.mcap" in text
    for remedy in ("the page's timeline", "`hmcs label`", "--find-states"):
        assert remedy in text


def test_labels_where_the_hand_did_not_move_are_reported(takes: list[str], tmp_path: Path) -> None:
    labeled(takes[0], "0,0.005,lift\n")
    assert "labels are where the hand did not move" in refused(takes[:1], tmp_path)


@pytest.mark.parametrize("find_states", [False, True])
def test_a_recording_without_a_hand_that_held_on_is_reported(
    maker: Maker, tmp_path: Path, find_states: bool
) -> None:
    loose = (KEYS.motion, Motion(position=np.zeros(3), velocity=np.zeros(3), dead_man=False))
    file = str(maker.write([loose] * 20))
    with pytest.raises(RecordingError, match=r"take\.mcap: there is no motion of a hand"):
        train(LINES.name, [file], tmp_path / "m.hmcs", find_states=find_states)


def test_a_recording_of_another_version_of_the_contract_is_reported(
    maker: Maker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = str(maker.write(hand(shown(1).positions)))
    monkeypatch.setattr(Motion, "VERSION", 9)
    monkeypatch.delitem(json_codec.BY_SCHEMA, "motion/1")
    assert "has motion/1, expected motion/9: it was recorded with version 1.2.3" in refused(
        [file], tmp_path
    )


Write = Callable[[dict[str, dict[str, str]], Sequence[int]], Path]


@pytest.fixture
def write(maker: Maker) -> Write:
    """Write a recording of a hand with this metadata and these numbers of its messages."""

    def made(metadata: dict[str, dict[str, str]], numbers: Sequence[int]) -> Path:
        preface = Preface(metadata, {})
        recording = Recording(maker.folder, "odd", ROOMY, lambda: preface, BEGUN_NS, "test")
        for k, (key, body) in zip(numbers, hand(shown(1).positions), strict=False):
            recording.write(key, maker.fields(body, k), BEGUN_NS + k * PERIOD_NS, None)
        recording.finish()
        return recording.path

    return made


def test_a_recording_made_with_another_task_is_warned_of(write: Write) -> None:
    metadata = {
        "input_device/hand": {"task": LINES.name},
        "robot/arm": {"task": "human-shapes"},
        "recorder/disk": {"task": "no task of anybody"},
    }
    (finding,) = recording_findings(LINES, read(write(metadata, range(50))))
    assert not finding.serious
    assert "odd.mcap: was recorded with task 'human-shapes'" in finding.text


def test_lost_samples_are_warned_of_with_their_time(write: Write) -> None:
    numbers = [*range(20), *range(27, 60)]
    (finding,) = recording_findings(LINES, read(write({}, numbers)))
    assert "7 samples of the hand were lost, the first 7 of them before 0.27 s" in finding.text


def test_a_recording_that_is_whole_is_not_warned_of(write: Write) -> None:
    metadata = {"robot/arm": {"task": LINES.name}}
    assert not list(recording_findings(LINES, read(write(metadata, range(50)))))
