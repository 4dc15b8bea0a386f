"""Running a study: its trials in parallel, here or on a cluster, with the same rows."""

from __future__ import annotations

import multiprocessing
import platform
import signal
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import metadata
from typing import Any, NamedTuple

import joblib
import numpy as np
from threadpoolctl import threadpool_limits

from hmcs.errors import UserError
from hmcs_laboratory.study import Measured, Settings, Study
from hmcs_laboratory.summary import Row, rows_of

Progress = Callable[[int], None]
"""Called with the number of trials done so far."""

_PACKAGES = ("hmcs", "hmcs-laboratory", "numpy", "scipy", "scikit-learn", "joblib")
_PEERS = ("hmmlearn", "aeon")


class StudyResult(NamedTuple):
    """What a study found."""

    study: str
    seed: int
    trials: int
    settings: dict[str, Any]
    """Plain JSON."""
    versions: dict[str, str]
    """Of Python, the libraries and the peers that are installed."""
    rows: list[Row]


def measure(
    study: Study[Settings],
    settings: Settings,
    *,
    seed: int = 1,
    trials: int | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    progress: Progress = lambda _: None,
) -> StudyResult:
    """Return what the study finds in so many trials.

    The trials run in `workers` processes, one for each processor by default, or on the Dask
    cluster whose scheduler is at the address `cluster`. Each has a random stream of its own,
    spawned from the seed, so the rows are the same wherever they run, times (`TIMINGS`) aside.
    Raises UserError for a number out of range, a cluster that is not there, and as the study does.
    """
    count = study.trials if trials is None else trials
    for name, value, least in (("seed", seed, 0), ("trials", count, 1), ("workers", workers, 1)):
        if value is not None and value < least:
            raise UserError(f"--{name} {value}: expected {least} or more")
    jobs = [
        joblib.delayed(_trial)(study.trial, settings, stream)
        for stream in np.random.SeedSequence(seed).spawn(count)
    ]
    measured: list[Sequence[Measured]] = []
    with _backend(cluster):
        pool = joblib.Parallel(
            n_jobs=-1 if cluster else min(workers or joblib.cpu_count(), count),
            return_as="generator",
            # A worker takes its next trial when it is done with one.
            batch_size=1,
            pre_dispatch="n_jobs",
        )
        with _interrupts_kept_from_workers():
            outcomes = pool(jobs)
        try:
            for outcome in outcomes:
                measured.append(outcome)
                progress(len(measured))
        except KeyboardInterrupt:
            with warnings.catch_warnings():
                # Joblib warns that trials under way are lost: that is what was asked for.
                warnings.simplefilter("ignore")
                outcomes.close()
            raise
    return StudyResult(
        study.name,
        seed,
        count,
        settings.model_dump(mode="json"),
        versions(),
        rows_of(measured),
    )


def versions() -> dict[str, str]:
    """Return the versions of what a study's numbers may depend on."""
    found = {"python": platform.python_version()}
    for package in (*_PACKAGES, *_PEERS):
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return found


def _trial(
    trial: Callable[[Settings, np.random.Generator], Sequence[Measured]],
    settings: Settings,
    stream: np.random.SeedSequence,
) -> Sequence[Measured]:
    leave_interrupts_to_parent()
    # With one thread sums are added up in the same order everywhere, and times compare.
    with threadpool_limits(1):
        return trial(settings, np.random.default_rng(stream))


def leave_interrupts_to_parent() -> None:
    """In a worker process: be deaf to Ctrl-C, which the process that started it sees to."""
    if multiprocessing.current_process().name.startswith("LokyProcess"):
        signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def _interrupts_kept_from_workers() -> Iterator[None]:
    """Start processes that Ctrl-C does not reach: this one ends them."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _backend(cluster: str | None) -> Iterator[None]:
    if cluster is None:
        with joblib.parallel_config(backend="loky", inner_max_num_threads=1):
            yield
        return
    try:
        from distributed import Client
    except ImportError as error:
        raise UserError(
            "--cluster needs Dask: install the extra hmcs-laboratory[cluster]"
        ) from error
    try:
        client = Client(cluster, timeout="5s")  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise UserError(
            f"--cluster {cluster}: no Dask scheduler there ({error}): start one with "
            "`dask scheduler` and give its address, e.g. tcp://host:8786"
        ) from error
    with client, joblib.parallel_config(backend="dask"):
        yield
