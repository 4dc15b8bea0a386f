"""`hmcs demo`: teach, run the stack on held-out human motion, swap a classifier, report."""

from __future__ import annotations

import importlib.metadata
import platform
import random
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from hmcs.errors import UserError
from hmcs.motion.demonstrations import read_csv
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model
from hmcs.task import Task, load_task
from hmcs.write_places import check_folder_place
from hmcs_demo.measure import measure
from hmcs_demo.play import RATE_HZ, Plan, Played, play
from hmcs_demo.progress import ProgressLine
from hmcs_demo.recording import Recording, load_recording
from hmcs_demo.report import write_report
from hmcs_demo.summary import RunFacts, summarize
from hmcs_demo.truth import RunError
from hmcs_local.interrupts import interruptible

TASK = "human-shapes"
DRAWINGS = tuple(range(1, 8))
"""Numbers of the human demonstrations there are of each shape."""
HELD_OUT_COUNT = 2
MIDDLE = 0.1
"""The kill falls within this share of the motion around its middle."""

_INTERRUPTED = 130


def run(*, output: Path, seed: int, held_out: tuple[int, ...]) -> int:
    """Run the demo and put its report into `output`; return the exit code.

    `seed` chooses which classifier is killed, and when. 0 when the report is written, 1 when the
    run did not come about (its logs are then in `output`-failed), 130 after Ctrl-C. The report
    comes whole or not at all. Raises UserError for numbers that cannot be held out, and where the
    folder cannot be written.
    """
    _check(held_out)
    check_folder_place(output, "--output")
    failed = output.with_name(f"{output.name}-failed")
    console = Console(highlight=False, soft_wrap=True)
    try:
        with interruptible(), _workshop(output) as folder:
            try:
                _run(folder, seed, held_out, console)
            except RunError:
                _deliver(folder / "stack" / "logs", failed)
                raise
            _deliver(folder / "report", output)
    except KeyboardInterrupt:
        console.print("stopped: nothing was written")
        return _INTERRUPTED
    except RunError as error:
        console.print(f"the demo did not come about: {error}", style="red", markup=False)
        console.print(f"the logs of this run are in {failed.resolve()}")
        return 1
    console.print(f"open {(output / 'index.html').resolve()}", style="bold")
    return 0


def _run(folder: Path, seed: int, held_out: tuple[int, ...], console: Console) -> None:
    began_s = time.monotonic()
    task = load_task(TASK)
    stack_folder, report = folder / "stack", folder / "report"
    report.mkdir()
    model_file = stack_folder / "models" / f"{TASK}.hmcs"
    performance_file = report / "performance.csv"
    model = _teach(task, held_out, model_file, performance_file, console)
    performance = read_csv(performance_file)
    motion_s = float(performance.time_s[-1] - performance.time_s[0])

    chance = random.Random(seed)
    plan = Plan(
        performance=performance_file,
        kill_at_s=motion_s * (0.5 + MIDDLE * (chance.random() - 0.5)),
        victim=chance.randrange(2),
    )
    with ProgressLine(console, motion_s) as line:
        played = play(plan, stack_folder, report / "recording.npz", line)
    console.print("writing the report")
    recording = _recording(report / "recording.npz")
    measured = measure(recording, performance, model, RATE_HZ)
    summary = summarize(measured, _facts(played, recording, model, seed, held_out))
    shutil.copytree(stack_folder / "logs", report / "logs")
    shutil.copy(model_file, report / model_file.name)
    write_report(report, measured, summary, task)
    console.print(
        f"{summary.steps} steps, {summary.missing_steps} missing, "
        f"{100 * summary.state_accuracy:.1f} % of them recognized right; "
        f"{time.monotonic() - began_s:.0f} s in all"
    )


def _check(held_out: tuple[int, ...]) -> None:
    if (
        len(held_out) != HELD_OUT_COUNT
        or len(set(held_out)) != len(held_out)
        or not set(held_out) <= set(DRAWINGS)
    ):
        raise UserError(
            f"--held-out {','.join(map(str, held_out))}: name two different numbers from "
            f"{DRAWINGS[0]} to {DRAWINGS[-1]}, e.g. 1,5"
        )


def _teach(
    task: Task, held_out: tuple[int, ...], model_file: Path, performance: Path, console: Console
) -> Model:
    from hmcs_trainer.performance import perform
    from hmcs_trainer.training import train

    shapes = [state.gestemes[0] for state in task.states]
    taught = [number for number in DRAWINGS if number not in held_out]
    console.print(
        f"teaching {task.name}: demonstrations {_listed(taught)} of {', '.join(shapes)}; "
        f"{_listed(held_out)} are held out, to be played"
    )
    references = [f"lasa:{shape}/{number}" for shape in shapes for number in taught]
    model_file.parent.mkdir(parents=True)
    train(TASK, references, model_file)
    perform(
        task, [f"lasa:{shape}/{number}" for number in held_out for shape in shapes], performance
    )
    return load_model(model_file)


def _listed(numbers: list[int] | tuple[int, ...]) -> str:
    return ", ".join(map(str, numbers))


def _recording(path: Path) -> Recording:
    try:
        return load_recording(path)
    except (OSError, KeyError, ValueError) as error:
        raise RunError(f"the observer left no recording: {error}") from error


def _facts(
    played: Played, recording: Recording, model: Model, seed: int, held_out: tuple[int, ...]
) -> RunFacts:
    members = recording.members
    ready = members.received_ns[(members.instance == played.newcomer) & members.alive]
    if not len(ready):
        raise RunError(f"{played.newcomer} was never ready: its log says why")
    packages = ("hmcs", "eclipse-zenoh", "numpy", played.engine)
    return RunFacts(
        killed=played.killed,
        newcomer=played.newcomer,
        killed_ns=played.killed_ns,
        ready_ns=int(ready[0]),
        cpu_cores=played.cpu_cores,
        lost_messages=played.lost_messages,
        refused_messages=played.refused_messages,
        held_out=held_out,
        seed=seed,
        versions={
            **{name: importlib.metadata.version(name) for name in packages},
            "python": platform.python_version(),
            "model": model.hash,
        },
    )


@contextmanager
def _workshop(output: Path) -> Iterator[Path]:
    """Give a folder beside `output` to work in, that is gone in the end however that comes."""
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        folder = Path(tempfile.mkdtemp(prefix=f".{output.name}-", dir=output.parent.resolve()))
    except OSError as error:
        raise UserError(f"--output {output}: cannot be written: {error.strerror}") from error
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _deliver(report: Path, output: Path) -> None:
    """Move all of a folder into `output`, the page that shows it last."""
    report.mkdir(parents=True, exist_ok=True)
    try:
        output.mkdir(exist_ok=True)
        for item in sorted(report.iterdir(), key=lambda path: path.name == "index.html"):
            target = output / item.name
            if target.is_dir():
                shutil.rmtree(target)
            item.replace(target)
    except OSError as error:
        raise UserError(f"--output {output}: cannot be written: {error}") from error
