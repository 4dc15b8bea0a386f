"""`hmcs replay`: a recording again, beside what was believed and done then, or through a stack."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from hmcs.errors import UserError
from hmcs.recognition.model import Model
from hmcs.recordings.comparing import (
    Comparison,
    FixtureComparison,
    compared,
    fixtures_compared,
    rows_of,
)
from hmcs.recordings.fixture_replay import FixtureReplay, replay_fixture
from hmcs.recordings.labels import labels_of
from hmcs.recordings.reading import read
from hmcs.recordings.replaying import Replay, kept_model, replayed
from hmcs.shown import plain
from hmcs.task import load_task
from hmcs.whole_files import written_whole
from hmcs.write_places import check_file_place
from hmcs_local import guard
from hmcs_local.connecting import Reached
from hmcs_local.interrupts import interruptible
from hmcs_local.tables import show_table

DRAWN_AS = (".png", ".svg")
OPEN_LOOP = (
    "an open loop: hand and robot are where they were recorded, the hand did not react to "
    "what the fixture would have done"
)
_END_WITHIN_S = 5.0
"""So long a live replay has to say goodbye when it is interrupted."""


class Files(NamedTuple):
    """What is to be written of a replay; None for what is not."""

    steps: Path | None = None
    """A table of every step, CSV."""
    picture: Path | None = None
    """PNG or SVG."""


def check_files(files: Files) -> None:
    """Raise UserError for a file that cannot be written, or a picture of no known kind."""
    if files.picture is not None and files.picture.suffix.lower() not in DRAWN_AS:
        raise UserError(f"--picture {files.picture}: expected a name that ends in .png or .svg")
    for target, option in ((files.steps, "--out"), (files.picture, "--picture")):
        if target is not None:
            check_file_place(target, option)
            if not target.parent.is_dir():
                raise UserError(f"{option} {target}: there is no folder {target.parent}: make it")


def replay_in_process(
    file: Path, model: Model | None, files: Files, console: Console, *, as_json: bool
) -> None:
    """Replay a recording, show how it stands to what was recorded, and write `files`.

    Without a model the one that is kept with the recording replays it. Raises a UserError for a
    recording or model that cannot be used, or do not fit each other, and for a file that cannot be
    written; none of the files is written then.
    """
    content = read(file)
    chosen = kept_model(content) if model is None else model
    with Progress(
        TextColumn("replaying"), BarColumn(), MofNCompleteColumn(), console=Console(stderr=True)
    ) as progress:
        task = progress.add_task("", total=100)

        def percents(begin: int, end: int) -> Callable[[float], None]:
            return lambda share: progress.update(task, completed=int(begin + (end - begin) * share))

        replay = replayed(content, chosen, percents(0, 50))
        fixture = replay_fixture(content, replay, percents(50, 100))
    if files.steps is not None:
        _write_steps(files.steps, replay, fixture)
    if files.picture is not None:
        from hmcs_local.replay_picture import draw_replay

        with _written(files.picture) as unfinished:
            form = files.picture.suffix.lower().removeprefix(".")
            begun_ns = content.first_ns
            draw_replay(unfinished, form, replay, fixture, labels_of(content), begun_ns)
    beliefs, fixtures = compared(replay), fixtures_compared(fixture)
    notes = [*_degraded(beliefs), *replay.notes, *fixture.notes]
    if as_json:
        figures = {
            "model": chosen.name,
            "model_hash": chosen.hash,
            "recorded_model": replay.compared_with,
            **beliefs._asdict(),
            **{f"fixture_{name}": value for name, value in fixtures._asdict().items()},
            "notes": notes,
        }
        # JSON has no NaN.
        figures = {name: None if value != value else value for name, value in figures.items()}
        console.print(json.dumps(figures), soft_wrap=True, highlight=False, markup=False)
    else:
        _show_side_by_side(console, file.name, replay, beliefs, fixtures)
        for note in [*([OPEN_LOOP] if fixture.ticks else []), *notes]:
            console.print(f"note: {plain(note)}", highlight=False, markup=False)


def _degraded(beliefs: Comparison) -> Iterator[str]:
    """What to tell of steps that were believed without all evidence."""
    if beliefs.degraded:
        yield (
            f"{beliefs.steps} steps, {beliefs.degraded} of them believed without all evidence "
            "live: they are compared with nothing"
        )


def replay_live(file: Path, rate: float, task: str, to: Reached) -> int:
    """Be the input device of a cell that plays a recording, to its end; return the exit code.

    Ctrl-C ends it before, with the dead-man released.
    """
    read(file)
    load_task(task)
    command = [sys.executable, "-m", "hmcs_input_device", "--source", "recording"]
    command += ["--demonstration", str(file), "--speed", str(rate), "--task", task]
    command += ["--router", to.router, "--cell", to.cell, "--exit-when-played"]
    tls = {f"HMCS_{name.upper()}": str(file) for name, file in to.tls.items()}
    bound = [sys.executable, "-S", "-E", guard.__file__, str(os.getpid()), *command]
    with interruptible():
        # In a session of its own, so that it is ended by this process and not by the terminal.
        device = subprocess.Popen(bound, env=os.environ | tls, start_new_session=True)
        try:
            return device.wait()
        except KeyboardInterrupt:
            device.terminate()
            with suppress(subprocess.TimeoutExpired):
                device.wait(_END_WITHIN_S)
            return 0
        finally:
            device.kill()
            device.wait()


def _show_side_by_side(
    console: Console,
    title: str,
    replay: Replay,
    beliefs: Comparison,
    fixtures: FixtureComparison,
) -> None:
    """What was and what is, a line a figure; no line for what there is nothing of."""
    heading = (
        f"{title}: {beliefs.steps} steps in {replay.lasted_s:.1f} s; recorded "
        f"{replay.compared_with or 'nobody'}, replayed {replay.model.name}, "
        f"{beliefs.times_real:.0f} times as fast"
    )
    rows = []
    for name, *cells in (*_belief_rows(beliefs), *_fixture_rows(fixtures)):
        shown = ["" if "nan" in cell else cell for cell in cells]
        if any(shown):
            rows.append((name, *shown))
    columns = ("recorded", "replayed", "side by side")
    show_table(console, heading, ("", *columns), rows, columns)


def _belief_rows(beliefs: Comparison) -> Iterator[tuple[str, str, str, str]]:
    steps = f"of {beliefs.compared} steps"
    yield (
        "right by the labels",
        f"{beliefs.recorded_right:.1%}",
        f"{beliefs.replayed_right:.1%}",
        "",
    )
    if beliefs.compared:
        yield "same likely state", "", "", f"{beliefs.agreement:.1%} {steps}"
        yield "same belief, bit by bit", "", "", f"{beliefs.same_bits} {steps}"
    yield "changes of state", "", "", f"{beliefs.later_steps:+.0f} steps later"


def _fixture_rows(fixtures: FixtureComparison) -> Iterator[tuple[str, str, str, str]]:
    if not fixtures.compared:
        return
    then = fixtures.guides_both + fixtures.guides_recorded_only
    now = fixtures.guides_both + fixtures.guides_replayed_only
    yield "fixture guides", f"{then:.1%}", f"{now:.1%}", f"both {fixtures.guides_both:.1%}"
    yield "  of the same state, or none", "", "", f"{fixtures.same_state:.1%} of the time"
    yield "  factor k, mean", "", "", f"{fixtures.factor_apart:.3f} apart"
    yield "  preferred direction, mean", "", "", f"{fixtures.directions_apart_deg:.1f}° apart"
    yield "  commanded velocity, rms", "", "", f"{fixtures.velocities_apart_mm_s:.1f} mm/s apart"
    yield (
        "  robot beside its guide, mean",
        f"{fixtures.recorded_off_guide_mm:.1f} mm",
        f"{fixtures.replayed_off_guide_mm:.1f} mm",
        "",
    )
    yield (
        "  takes hold",
        f"{fixtures.recorded_takes_hold} ×",
        f"{fixtures.replayed_takes_hold} ×",
        f"{fixtures.takes_hold_later_ms:+.0f} ms later",
    )
    yield (
        "  lets go",
        f"{fixtures.recorded_lets_go} ×",
        f"{fixtures.replayed_lets_go} ×",
        f"{fixtures.lets_go_later_ms:+.0f} ms later",
    )


def _write_steps(target: Path, replay: Replay, fixture: FixtureReplay) -> None:
    rows = rows_of(replay, fixture)
    first = next(rows)
    with (
        _written(target) as unfinished,
        unfinished.open("w", encoding="utf-8", newline="") as stream,
    ):
        writer = csv.DictWriter(stream, list(first), lineterminator="\n")
        writer.writeheader()
        writer.writerow(first)
        writer.writerows(rows)


@contextmanager
def _written(target: Path) -> Iterator[Path]:
    """`written_whole`, with an error that names the reason where it cannot be written."""
    try:
        with written_whole(target) as unfinished:
            yield unfinished
    except OSError as error:
        raise UserError(f"{target}: cannot be written: {error.strerror or error}") from error
