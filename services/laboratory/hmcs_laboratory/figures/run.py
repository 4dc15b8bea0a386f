"""Making figures: in parallel, the same whatever the number of workers, and never half a file."""

from __future__ import annotations

import json
import os
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import joblib
from matplotlib.figure import Figure as Picture
from threadpoolctl import threadpool_limits

from hmcs.errors import UserError
from hmcs.write_places import check_folder_place
from hmcs_laboratory.figures.catalog import find_figures
from hmcs_laboratory.figures.drawing import Files, Number, files_of, house_style
from hmcs_laboratory.figures.figure import Figure
from hmcs_laboratory.figures.page import page
from hmcs_laboratory.running import (
    _interrupts_kept_from_workers,
    leave_interrupts_to_parent,
    versions,
)
from hmcs_laboratory.study import Study
from hmcs_laboratory.summary import Row

Progress = Callable[[str, int, int], None]
"""Called with the number of the figure just made, how many are, and how many are to be."""

PAGE, FINDINGS = "index.html", "figures.json"


class Made(NamedTuple):
    """A figure that was made."""

    number: str
    files: Files
    settings: dict[str, Any]
    """Plain JSON."""
    numbers: Mapping[str, Number]
    found: str
    differs: str
    seconds: float
    """Processor time of one thread."""


def make_figures(
    folder: Path,
    *,
    numbers: Sequence[str] = (),
    fast: bool = False,
    seed: int = 1,
    workers: int | None = None,
    progress: Progress = lambda *_: None,
) -> tuple[Made, ...]:
    """Make the figures of those numbers, all for none, and write them and their page to a folder.

    Each has random numbers of its own, so that it is the same whichever others are made and in
    however many processes, one for each processor by default. Raises UserError for an unknown
    number, a seed or a number of workers out of range, and a folder that cannot be written.
    """
    for name, value, least in (("seed", seed, 0), ("workers", workers, 1)):
        if value is not None and value < least:
            raise UserError(f"--{name} {value}: expected {least} or more")
    figures = find_figures(numbers)
    check_folder_place(folder, "--output")
    folder.mkdir(parents=True, exist_ok=True)
    made: dict[str, Made] = {}
    for each in _made(figures, fast, seed, workers):
        name = next(figure.name for figure in figures if figure.number == each.number)
        write(folder / f"{name}.png", each.files.png)
        write(folder / f"{name}.svg", each.files.svg)
        made[each.number] = each
        progress(each.number, len(made), len(figures))
    in_order = tuple(made[figure.number] for figure in figures)
    write(folder / FINDINGS, _findings(in_order, fast, seed).encode())
    write(folder / PAGE, page(figures, in_order, fast=fast, seed=seed).encode())
    return in_order


def write(path: Path, content: bytes) -> None:
    """Write a file as a whole or not at all; raises UserError where it cannot be written."""
    try:
        descriptor, temporary = tempfile.mkstemp(prefix=".", suffix=".part", dir=path.parent)
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror}") from error
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
        # As any file that is simply written, not as a private one.
        Path(temporary).chmod(0o666 & ~_umask())
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def draw_study(study: Study[Any], rows: Sequence[Row], path: Path) -> None:
    """Draw the rows of a study that has a picture to a file, .svg by its ending or else PNG.

    Raises UserError where the file cannot be written.
    """
    module, _, function = study.picture.partition(":")
    draw: Callable[[Sequence[Row]], Picture] = getattr(import_module(module), function)
    with house_style():
        files = files_of(draw(rows))
    write(path, files.svg if path.suffix == ".svg" else files.png)


def make(figure: Figure[Any], *, fast: bool, seed: int) -> Made:
    """Make one figure."""
    leave_interrupts_to_parent()
    began_s = time.thread_time()
    settings = figure.chosen(fast=fast)
    # With one thread sums are added up in the same order everywhere.
    with threadpool_limits(1), house_style():
        drawn = figure.draw(settings, figure.generator(seed))
        files = files_of(drawn.picture)
    return Made(
        figure.number,
        files,
        settings.model_dump(mode="json"),
        dict(drawn.numbers),
        drawn.found,
        drawn.differs,
        time.thread_time() - began_s,
    )


def _made(
    figures: Sequence[Figure[Any]], fast: bool, seed: int, workers: int | None
) -> Iterator[Made]:
    jobs = [joblib.delayed(make)(figure, fast=fast, seed=seed) for figure in figures]
    pool = joblib.Parallel(
        n_jobs=min(workers or joblib.cpu_count(), len(figures)),
        return_as="generator_unordered",
        # A worker takes its next figure when it is done with one.
        batch_size=1,
        pre_dispatch="n_jobs",
    )
    with joblib.parallel_config(backend="loky", inner_max_num_threads=1):
        with _interrupts_kept_from_workers():
            outcomes = pool(jobs)
        try:
            yield from outcomes
        except KeyboardInterrupt:
            with warnings.catch_warnings():
                # Joblib warns that figures under way are lost: that is what was asked for.
                warnings.simplefilter("ignore")
                outcomes.close()
            raise


def _findings(made: Sequence[Made], fast: bool, seed: int) -> str:
    figures = {
        each.number: {
            "settings": each.settings,
            "numbers": each.numbers,
            "found": each.found,
            "differs": each.differs,
        }
        for each in made
    }
    findings = {"seed": seed, "fast": fast, "versions": versions(), "figures": figures}
    return json.dumps(findings, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current
