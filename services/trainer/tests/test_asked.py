"""What a process on the bus asks for is data: checked, confined, never a word of a command."""

from __future__ import annotations

import io
import json
import os
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hmcs.bus.messages import Train
from hmcs.bus.session import RequestRefusedError
from hmcs_trainer import job as job_module
from hmcs_trainer.asked import MOST_DEMONSTRATIONS, Job, job_of
from hmcs_trainer.running import _COMMAND

SECRET = "root:x:0:0:secret"


@pytest.fixture
def models(tmp_path: Path) -> Path:
    for folder in ("models", "takes", "outside"):
        (tmp_path / folder).mkdir()
    for file in ("models/found.yaml", "takes/take.csv", "takes/take.mcap", "takes/plain"):
        (tmp_path / file).write_text(SECRET)
    for file in ("outside/task.yaml", "outside/take.csv"):
        (tmp_path / file).write_text(SECRET)
    return tmp_path / "models"


def asked(**changed: Any) -> Train:
    return Train(model="m", task="human-shapes", demonstrations=("take.csv",)).model_copy(
        update=changed
    )


def job(models: Path, **changed: Any) -> Job:
    return job_of(asked(**changed), models, (models.parent / "takes",))


def test_files_of_the_trainers_folders_are_found_by_name_and_by_path(models: Path) -> None:
    takes = models.parent / "takes"
    made = job(
        models,
        task="found.yaml",
        demonstrations=("take.csv", str(takes / "take.mcap"), "lasa:GShape/1-3"),
        find_states=True,
    )
    assert made == Job(
        name="m",
        task=str(models / "found.yaml"),
        demonstrations=(str(takes / "take.csv"), str(takes / "take.mcap"), "lasa:GShape/1-3"),
        recognizer="segment-filter",
        find_states=True,
        model=models / "m.hmcs",
        report=models / "m.html",
    )
    assert Job.model_validate_json(made.model_dump_json()) == made


def test_a_single_file_may_be_one_of_the_sources(models: Path) -> None:
    task = models.parent / "outside" / "task.yaml"
    for name in ("task.yaml", str(task)):
        made = job_of(asked(task=name, demonstrations=("lasa:Sine/1",)), models, (task,))
        assert made.task == str(task)
    with pytest.raises(RequestRefusedError):
        job_of(asked(demonstrations=(str(task.with_name("take.csv")),)), models, (task,))


HOSTILE = [
    "--performance-output=/tmp/x",
    "--output",
    "-h",
    "serve",
    "--",
    "",
    ".",
    "..",
    "/",
    "/etc/passwd",
    "../outside/take.csv",
    "../outside/task.yaml",
    "takes/../../outside/take.csv",
    "plain",
    "a\0b.csv",
    "x" * 5_000 + ".csv",
    "/dev/stdin",
    "lasa:../../etc/1",
    "lasa:GShape/1;rm",
    "lasa:GShape/" + "9" * 5_000,
    "circle.csv",
    "pipe.csv",
    "folder.csv",
]


@pytest.mark.parametrize("name", HOSTILE)
def test_what_is_no_file_of_its_own_is_refused(models: Path, name: str) -> None:
    takes = models.parent / "takes"
    (takes / "circle.csv").symlink_to("circle.csv")
    (takes / "folder.csv").mkdir()
    os.mkfifo(takes / "pipe.csv")
    for changed in ({"demonstrations": ("take.csv", name)}, {"task": name}):
        with pytest.raises(RequestRefusedError) as caught:
            job(models, **changed)
        assert SECRET not in str(caught.value)
        assert len(str(caught.value)) < 1_000


@settings(max_examples=200, suppress_health_check=list(HealthCheck))
@given(st.text(max_size=40), st.sampled_from(["", ".csv", ".mcap"]))
def test_no_name_at_all_leads_out_of_the_trainers_folders(
    models: Path, name: str, ending: str
) -> None:
    try:
        (file,) = job(models, demonstrations=(name + ending,)).demonstrations
    except RequestRefusedError:
        return
    takes = models.parent / "takes"
    assert file.startswith("lasa:") or Path(file).parent in (models, takes)


@pytest.mark.parametrize(
    "changed",
    [
        {"model": "a/b"},
        {"model": "../m"},
        {"model": "--output"},
        {"recognizer": "none"},
        {"recognizer": "--help"},
        {"demonstrations": ()},
        {"demonstrations": ("take.csv",) * (MOST_DEMONSTRATIONS + 1)},
    ],
)
def test_names_are_checked_before_anything_begins(models: Path, changed: dict[str, Any]) -> None:
    with pytest.raises(RequestRefusedError):
        job(models, **changed)


def test_the_command_of_a_training_is_always_the_same() -> None:
    assert (sys.executable, "-m", "hmcs_trainer.job") == _COMMAND


# --- what the process of a training tells ---------------------------------------------------------


def reported(
    made: Job, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> tuple[int, str, str]:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(made.model_dump_json().encode())))
    code = job_module.main()
    said = capsys.readouterr()
    errors = [json.loads(line).get("error", "") for line in said.out.splitlines()]
    return code, " ".join(errors), said.out + said.err


FILES = {
    "a table of users": f"{SECRET}\nbin:x:1:1\n",
    "a header": f"time_s,x_m,y_m,{SECRET.replace(',', ' ')}\n",
    "a number": f"time_s,x_m,y_m\n0,0,{SECRET}\n1,1,1\n",
    "a label": f"time_s,x_m,y_m,state\n0,0,0,{SECRET}\n1,1,1,{SECRET}\n2,2,2,{SECRET}\n",
    "a short label": f"time_s,x_m,y_m,state\n0,0,0,write-g\n1,1,1,{SECRET}\n1.1,2,2,write-g\n"
    "2,3,3,write-g\n",
    "no text": b"\xff\xfe" + SECRET.encode("utf-16-le"),
}


@pytest.mark.parametrize("content", FILES.values(), ids=FILES)
@pytest.mark.parametrize("find_states", [False, True])
def test_a_demonstration_that_is_none_is_reported_without_a_word_of_it(
    models: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    content: str | bytes,
    find_states: bool,
) -> None:
    file = models.parent / "takes" / "take.csv"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    made = job(models, find_states=find_states)
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(made.model_dump_json().encode())))
    assert job_module.main() == 2
    out = capsys.readouterr().out
    assert "secret" not in out
    assert "take.csv" in out


@pytest.mark.parametrize("name", ["take.mcap", "take.csv"])
def test_labels_beside_a_recording_are_not_quoted(
    models: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    name: str,
) -> None:
    (models.parent / "takes" / "take.labels.csv").write_text(SECRET)
    code, error, _ = reported(job(models, demonstrations=(name,)), monkeypatch, capsys)
    assert code == 2
    assert "secret" not in error


@pytest.mark.parametrize(
    "content", [SECRET, f"{SECRET}: 1\n", f"name: [{SECRET}", f"- {SECRET}\n", '"\\ud800"']
)
def test_a_task_that_is_none_is_reported_without_a_word_of_it(
    models: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    content: str,
) -> None:
    (models / "found.yaml").write_text(content)
    made = job(models, task="found.yaml")
    code, error, whole = reported(made, monkeypatch, capsys)
    assert code == 2
    assert error.startswith(str(models / "found.yaml"))
    assert "no task: `hmcs task check`" in error
    assert "secret" not in error
    assert "Traceback" not in whole
