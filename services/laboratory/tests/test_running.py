"""Running: the same rows whoever runs the trials, and a clear word where they cannot be run."""

from typing import Any

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs_laboratory.command import find_study
from hmcs_laboratory.running import StudyResult, measure
from hmcs_laboratory.study import TIMINGS
from hmcs_laboratory.summary import CI95

QUICK = {"noise": {"methods": "svm,lda"}, "restart": {"methods": "concatenated-hmm"}}
"""Methods that take next to no time: what they find is not looked at here."""


def tiny(name: str, **where: Any) -> StudyResult:
    study = find_study(name)
    chosen = {**study.tiny, **QUICK[name]}
    settings = study.settings_from([f"{key}={value}" for key, value in chosen.items()])
    return measure(study, settings, trials=3, **where)


def without_times(result: StudyResult) -> list[dict[str, object]]:
    times = {*TIMINGS, *(name + CI95 for name in TIMINGS)}
    return [{k: v for k, v in row.items() if k not in times} for row in result.rows]


def test_rows_are_the_same_for_one_worker_two_workers_and_a_cluster():
    distributed = pytest.importorskip("distributed")
    alone = without_times(tiny("restart", seed=7, workers=1))
    assert without_times(tiny("restart", seed=7, workers=2)) == alone
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        on_cluster = tiny("restart", seed=7, cluster=cluster.scheduler_address)
    assert without_times(on_cluster) == alone


def test_another_seed_gives_other_rows():
    results = [without_times(tiny("restart", seed=seed, workers=1)) for seed in (1, 1, 2)]
    assert results[0] == results[1]
    assert results[0] != results[2]


def test_progress_counts_every_trial():
    done: list[int] = []
    tiny("restart", workers=1, progress=done.append)
    assert done == [1, 2, 3]


def test_a_result_says_what_it_was_made_with():
    result = tiny("noise", seed=5, workers=1)
    assert (result.study, result.seed, result.trials) == ("noise", 5, 3)
    assert result.settings["noise"] == [0.1, 0.3]
    assert result.versions["numpy"] == np.__version__
    assert {"python", "hmcs", "hmcs-laboratory", "scikit-learn"} <= set(result.versions)


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ({"seed": -1}, "--seed -1: expected 0 or more"),
        ({"workers": 0}, "--workers 0: expected 1 or more"),
        ({"cluster": "tcp://127.0.0.1:9"}, "no Dask scheduler there.*dask scheduler"),
        ({"cluster": "nonsense://"}, "--cluster nonsense://: no Dask scheduler there"),
    ],
)
def test_what_cannot_be_run_is_reported(where, message):
    with pytest.raises(UserError, match=message):
        tiny("noise", **where)


def test_a_hand_too_noisy_to_arrive_is_reported_with_what_to_do():
    study = find_study("noise")
    settings = study.settings_from(["noise=30", "gestemes=2", "methods=lda"])
    with pytest.raises(UserError, match="take less noise"):
        measure(study, settings, trials=1, workers=1)
