"""Recordings looked at, exported and replayed; what is wrong with them is one message."""

from __future__ import annotations

import csv
import json
import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hmcs.bus.messages import Belief, FixtureState, Label, Motion, Step
from hmcs.bus.wire import encode
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model, save_model
from hmcs.recordings.file_rotation import Preface, Recording
from hmcs.recordings.json_codec import BY_SCHEMA, fields_of
from hmcs.task import Task
from hmcs_local.commands.recordings import replay as replay_command
from hmcs_local.replays import OPEN_LOOP
from support.cells import KEYS, Logged, performance, write_cell
from support.lessons import ROUND, lesson_task
from support.lessons import performed as lesson
from support.mcap_files import chunks_of, with_bytes
from support.recordings import ROOMY

Run = Callable[..., subprocess.CompletedProcess[str]]
CUTS = 20


def renamed(task: Task, names: dict[str, str]) -> Task:
    """The same task with other names of its states."""
    reported = task.model_dump(mode="json")
    reported["start"] = [names.get(name, name) for name in reported["start"]]
    for state in reported["states"]:
        state["name"] = names.get(state["name"], state["name"])
        state["next"] = [names.get(name, name) for name in state["next"]]
    return Task.model_validate_json(json.dumps(reported))


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The model that was followed, another of its task, of a changed task, and of another one."""
    folder, task = tmp_path_factory.mktemp("models"), lesson_task()
    shown = [lesson(seed) for seed in (1, 2, 3)]
    taught = learn(task, shown)
    made: dict[str, Model] = {
        "lesson": taught,
        "other": learn(task, shown[:1])._replace(name="other"),
        "changed": taught._replace(name="changed", task=renamed(task, {"lift": "raise"})),
        "foreign": taught._replace(
            name="foreign", task=renamed(task, {name: f"my-{name}" for name in ROUND})
        ),
    }
    for name, model in made.items():
        save_model(model, folder / f"{name}.hmcs")
    return {name: folder / f"{name}.hmcs" for name in made}


@pytest.fixture(scope="module")
def said(models: dict[str, Path]) -> list[Logged]:
    return list(performance(load_model(models["lesson"]), lesson(9)))


@pytest.fixture(scope="module")
def take(
    models: dict[str, Path], said: list[Logged], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """A recording of a task performed once, its model kept with it."""
    kept = {"lesson.hmcs": models["lesson"].read_bytes()}
    return write_cell(tmp_path_factory.mktemp("takes"), said, attachments=kept)


def test_the_same_model_is_found_to_have_believed_the_same(hmcs: Run, take: Path) -> None:
    ended = hmcs("replay", str(take))
    assert ended.returncode == 0
    assert "same belief, bit by bit" in ended.stdout
    assert "100.0% of" in ended.stdout
    assert f"note: {OPEN_LOOP}" in ended.stdout
    assert "nan" not in ended.stdout


@pytest.mark.parametrize("width", [40, 80, 200])
def test_what_was_and_what_is_stand_side_by_side_at_any_width(
    hmcs: Run, take: Path, monkeypatch: pytest.MonkeyPatch, width: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    out = hmcs("replay", str(take)).stdout
    assert out.replace("\n", "").isprintable()
    table = out.partition("note:")[0]
    assert all(len(line.rstrip()) <= width for line in table.splitlines())
    for words in ("same belief, bit by bit", "robot beside its guide, mean", "recorded lesson"):
        assert words in " ".join(table.split())
    assert "…" not in table


def test_every_figure_of_the_json_line_stands_in_the_help(
    hmcs: Run, take: Path, models: dict[str, Path]
) -> None:
    reported = json.loads(
        hmcs("replay", str(take), "--json", "--model", str(models["other"])).stdout
    )
    explained = str(replay_command.__doc__)
    assert reported["recorded_model"] == "lesson"
    assert reported["same_bits"] == 0 < reported["compared"]
    assert reported["fixture_guides_both"] > 0.1
    for name in set(reported) - {"model", "model_hash", "recorded_model"}:
        assert f"`{name}`" in explained or f"`{name.removeprefix('fixture')}`" in explained, name
        assert not isinstance(reported[name], dict)


def test_steps_and_picture_are_written(hmcs: Run, take: Path, tmp_path: Path) -> None:
    for picture, begins in (("both.png", b"\x89PNG"), ("both.svg", b"<?xml")):
        ended = hmcs("replay", str(take), "--out", "steps.csv", "--picture", picture)
        assert ended.returncode == 0
        assert (tmp_path / picture).read_bytes().startswith(begins)
    with (tmp_path / "steps.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    guided = [row for row in rows if float(row["replayed_factor"]) > 0.6]
    assert len(guided) > len(rows) / 2
    apart = [float(r["replayed_factor"]) - float(r["recorded_factor"]) for r in rows]
    assert np.abs(apart).max() < 1e-6


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--picture", "both.gif"], "expected a name that ends in .png or .svg"),
        (["--picture", "none/both.png"], "there is no folder none"),
        (["--out", "none/steps.csv"], "there is no folder none"),
        (["--out", "."], "is a folder"),
        (["--model", "none.hmcs"], "none.hmcs"),
    ],
)
def test_what_cannot_be_written_or_read_is_reported_with_exit_code_2(
    hmcs: Run, take: Path, tmp_path: Path, words: list[str], says: str
) -> None:
    ended = hmcs("replay", str(take), *words)
    assert ended.returncode == 2
    assert says in ended.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_a_file_is_reported(hmcs: Run, take: Path, tmp_path: Path) -> None:
    (tmp_path / "tables").write_text("mine")
    ended = hmcs("export", str(take), "--to", "tables")
    assert ended.returncode == 2
    assert "--to: tables: is no folder" in ended.stderr
    assert (tmp_path / "tables").read_text() == "mine"


def test_a_model_of_another_task_is_refused_and_of_a_changed_one_reported(
    hmcs: Run, take: Path, models: dict[str, Path], tmp_path: Path
) -> None:
    ended = hmcs("replay", str(take), "--model", str(models["foreign"]), "--out", "steps.csv")
    assert ended.returncode == 2
    assert "is of another task than model 'foreign'" in ended.stderr
    assert "my-reach" in ended.stderr
    assert list(tmp_path.iterdir()) == []
    ended = hmcs("replay", str(take), "--model", str(models["changed"]))
    assert ended.returncode == 0
    assert "name states that task 'lesson' of model 'changed' has not: lift" in ended.stdout


def test_labels_of_another_task_are_reported(
    hmcs: Run, said: list[Logged], models: dict[str, Path], tmp_path: Path
) -> None:
    step = next(each for each in said if each.is_of(Step))
    label = step._replace(key=KEYS.label, body=Label(state="weld"))
    take = write_cell(tmp_path / "takes", [*said[:200], label, *said[200:]])
    ended = hmcs("replay", str(take), "--model", str(models["lesson"]))
    assert ended.returncode == 0
    assert "the labels name states that task 'lesson' of model 'lesson' has not: weld" in (
        ended.stdout
    )


def test_a_recording_without_steps_can_be_looked_at_and_not_replayed(
    hmcs: Run, said: list[Logged], models: dict[str, Path], tmp_path: Path
) -> None:
    take = write_cell(tmp_path / "takes", [each for each in said if each.is_of(Motion)])
    inspected = hmcs("inspect", str(take))
    assert inspected.returncode == 1
    assert "there are no steps" in inspected.stdout
    assert hmcs("export", str(take), "--to", "tables").returncode == 0
    ended = hmcs("replay", str(take), "--model", str(models["lesson"]), "--out", "steps.csv")
    assert ended.returncode == 2
    assert "has no steps" in ended.stderr
    assert not (tmp_path / "steps.csv").exists()


def test_a_recording_with_gaps_is_replayed_and_the_gaps_are_reported(
    hmcs: Run, said: list[Logged], models: dict[str, Path], tmp_path: Path
) -> None:
    begin_ns = said[0].log_ns + 1_500_000_000
    gap = range(begin_ns, begin_ns + 500_000_000)
    take = write_cell(tmp_path / "takes", [each for each in said if each.log_ns not in gap])
    inspected = hmcs("inspect", str(take))
    assert inspected.returncode == 1
    assert "messages are missing on hmcs/@v1/test/input/motion" in inspected.stdout
    ended = hmcs("replay", str(take), "--model", str(models["lesson"]))
    assert ended.returncode == 0
    assert "steps are missing: recognition begins anew" in ended.stdout
    assert "50 samples of the operator's device are missing" in ended.stdout


@pytest.mark.parametrize("of_another_version", [Step, FixtureState])
def test_a_recording_of_another_version_of_the_contract_is_reported(
    hmcs: Run,
    said: list[Logged],
    models: dict[str, Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    of_another_version: type[Step] | type[FixtureState],
) -> None:
    newer = f"{of_another_version.SCHEMA}/99"
    with monkeypatch.context() as patch:
        patch.setitem(BY_SCHEMA, newer, of_another_version)
        preface = Preface({"hmcs": {"version": "9.9.9"}}, {})
        recording = Recording(
            tmp_path / "takes", "take", ROOMY, lambda: preface, said[0].log_ns, "test"
        )
        for each in said:
            fields = fields_of(encode(each.body, each.envelope))
            if each.is_of(of_another_version):
                fields["schema"] = newer
            recording.write(each.key, fields, each.log_ns, None)
        recording.finish()
    inspected = hmcs("inspect", str(recording.path))
    assert inspected.returncode == 1
    assert f"{newer} cannot be read: it is of another version" in inspected.stdout
    assert "version 9.9.9 of hmcs" in inspected.stdout
    assert hmcs("export", str(recording.path), "--to", "tables").returncode == 0
    ended = hmcs(
        "replay", str(recording.path), "--model", str(models["lesson"]), "--out", "steps.csv"
    )
    assert ended.returncode == 2
    assert f"has {newer}, expected {of_another_version.SCHEMA}/" in ended.stderr
    assert "version 9.9.9 of hmcs" in ended.stderr
    assert not (tmp_path / "steps.csv").exists()


@pytest.mark.long
def test_a_recording_cut_at_any_byte_is_reported_and_leaves_nothing_half_written(
    hmcs: Run, take: Path, models: dict[str, Path], tmp_path: Path
) -> None:
    data, codes = take.read_bytes(), set()
    cut_off = tmp_path / "cut.mcap"
    # The model is the first and a large part of it: some cuts are in the messages.
    begins = data.index(models["lesson"].read_bytes()[-64:]) + 64
    random = np.random.default_rng(5)
    cuts = np.concatenate(
        [random.integers(0, begins, CUTS), random.integers(begins, len(data), CUTS)]
    )
    for cut in cuts.tolist():
        cut_off.write_bytes(data[:cut])
        inspected = hmcs("inspect", str(cut_off))
        assert (inspected.returncode, "it was cut off" in inspected.stdout) in (
            (1, True),
            (0, False),
        )
        assert hmcs("export", str(cut_off), "--to", "tables").returncode == 0
        ended = hmcs("replay", str(cut_off), "--out", "steps.csv")
        codes.add(ended.returncode)
        written = {file.name for file in tmp_path.iterdir()} - {"cut.mcap", "tables"}
        assert written == ({"steps.csv"} if ended.returncode == 0 else set()), cut
        assert ended.returncode == 0 or ended.stderr.count("hmcs: ") == 1
        for name in written:
            (tmp_path / name).unlink()
    assert codes == {0, 2}


# --- recordings of others, damaged ones -----------------------------------------------------------

EVIL = "[/bold]\x1b[31m\u202e[link=file:///x]"


def test_words_of_a_recording_are_shown_and_never_obeyed(
    hmcs: Run, said: list[Logged], tmp_path: Path
) -> None:
    preface = Preface(
        {f"robot/{EVIL}": {EVIL: EVIL}, "hmcs": {"version": EVIL}}, {f"../{EVIL}.hmcs": b"x"}
    )
    recording = Recording(tmp_path, "take", ROOMY, lambda: preface, said[0].log_ns, "test")
    for each in said[:300]:
        key = f"hmcs/@v1/x/{EVIL}" if each.is_of(Motion) else each.key
        fields = fields_of(encode(each.body, each.envelope))
        recording.write(key, fields, each.log_ns, None)
    label = next(each for each in said if each.is_of(Step))._replace(body=Label(state=EVIL))
    fields = fields_of(encode(label.body, label.envelope))
    recording.write(KEYS.label, fields, said[300].log_ns, None)
    recording.write(KEYS.label, fields, said[300].log_ns + 10**7, None)
    recording.finish()
    path = str(recording.path)
    for words in (
        ["inspect", path],
        ["label", path],
        ["replay", path],
        ["inspect", path, "--json"],
    ):
        ended = hmcs(*words)
        assert ended.returncode in (0, 1, 2), words
        shown = ended.stdout + ended.stderr
        assert "Traceback" not in shown
        assert "\x1b" not in shown
        assert "\u202e" not in shown
    assert "[/bold]" in hmcs("inspect", path).stdout
    assert hmcs("export", path, "--to", "tables").returncode == 0
    assert all("\x1b" not in file.name for file in (tmp_path / "tables").iterdir())


def test_damage_in_the_middle_is_reported_with_its_times_and_the_rest_is_used(
    hmcs: Run, take: Path, tmp_path: Path
) -> None:
    begin, end = chunks_of(take)[1]
    bad = with_bytes(take, tmp_path / "bad.mcap", (begin + end) // 2, b"\0" * 8, 8)
    inspected = hmcs("inspect", str(bad))
    assert inspected.returncode == 1
    assert re.search(r"missing: between \d+\.\d+ s and \d+\.\d+ s something is", inspected.stdout)
    assert "last moments" not in inspected.stdout
    assert hmcs("replay", str(bad)).returncode == 0


@pytest.mark.long
def test_steps_believed_without_all_evidence_are_counted_apart(
    hmcs: Run, said: list[Logged], models: dict[str, Path], tmp_path: Path
) -> None:
    steps = 0
    made = []
    for each in said:
        if each.is_of(Belief):
            steps += 1
            if steps % 3 == 0:
                body = each.body.model_copy(update={"missing_gestemes": ("lift",)})
                each = each._replace(body=body)
        made.append(each)
    take = write_cell(tmp_path / "takes", made)
    ended = hmcs("replay", str(take), "--model", str(models["lesson"]))
    assert ended.returncode == 0
    lost = steps // 3
    assert f"{steps} steps, {lost} of them believed without all evidence live" in ended.stdout
    reported = json.loads(
        hmcs("replay", str(take), "--model", str(models["lesson"]), "--json").stdout
    )
    assert (reported["degraded"], reported["compared"]) == (lost, steps - lost)
