"""The command line: a table or one line of JSON, and exit codes that mean something."""

import json
import os
import signal
import subprocess
import sys

import pytest

from hmcs_laboratory.command import find_study, main
from hmcs_laboratory.studies import STUDIES

TINY = [
    word
    for name, value in {**find_study("noise").tiny, "methods": "svm,lda"}.items()
    for word in ("--set", f"{name}={value}")
]


def test_json_is_one_object_on_the_last_line(capsys):
    arguments = ["study", "noise", "--trials", "2", "--workers", "1", "--seed", "3", "--json"]
    assert main([*arguments, *TINY]) == 0
    reported = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert list(reported) == ["study", "seed", "trials", "settings", "versions", "rows"]
    assert (reported["study"], reported["seed"], reported["trials"]) == ("noise", 3, 2)
    settings = find_study("noise").settings
    assert set(reported["settings"]) == set(settings.model_fields)
    assert settings.model_validate(reported["settings"]).gestemes == 4
    assert {(row["method"], row["noise"]) for row in reported["rows"]} == {
        (method, noise) for method in ("svm", "lda") for noise in (0.1, 0.3)
    }
    for row in reported["rows"]:
        for name in ("accuracy", "fit_s", "us_per_sample"):
            assert row[name] >= 0
            assert row[f"{name}_ci95"] >= 0


def test_a_table_shows_every_method_with_its_interval(capsys):
    assert main(["study", "noise", "--trials", "2", "--workers", "1", *TINY]) == 0
    printed = capsys.readouterr()
    assert "noise: 2 trials, seed 1" in printed.out
    assert printed.out.count("svm") == printed.out.count("lda") == 2
    assert "±" in printed.out
    assert "trial 2 of 2" in printed.err


def test_list_names_every_study(capsys):
    assert main(["study", "--list"]) == 0
    listed = capsys.readouterr().out
    for study in STUDIES:
        assert study.name in listed
        assert study.line in listed


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["nose"],
            "unknown study 'nose', did you mean noise? (choose of: assistance, calibration, ",
        ),
        (["noise", "--set", "nose=1"], "unknown setting 'nose', did you mean noise?"),
        (["noise", "--set", "noise"], "--set noise: write NAME=VALUE"),
        (["noise", "--set", "noise=loud"], "noise=loud: Input should be a valid number"),
        (["noise", "--set", "gestemes=0"], "gestemes=0: Input should be greater than or equal"),
        (["noise", "--set", "kind=square"], "kind=square: Input should be 'line', 'circle'"),
        (["noise", "--set", "methods=lda,magic"], "unknown method 'magic' (choose of: dtw-1nn"),
        (["restart", "--set", "methods=lda"], "unknown method 'lda'"),
        (["noise", "--set", "line_m=2,1"], "line_m=2,1: expected the lower one first"),
        (["lasa-tasks", "--set", "training=6"], "training=6 and held_out=2: expected 7 together"),
        (["noise", "--trials", "0"], "--trials 0: expected 1 or more"),
    ],
)
def test_a_mistake_is_one_line_and_exit_code_2(capsys, arguments, message):
    assert main(["study", "--workers", "1", *arguments]) == 2
    printed = capsys.readouterr()
    assert message in printed.err
    assert "Traceback" not in printed.err
    assert printed.out == ""


def test_ctrl_c_ends_cleanly_with_130():
    process = subprocess.Popen(
        [
            *(sys.executable, "-m", "hmcs_laboratory", "study", "noise", *TINY),
            *("--trials", "100000", "--workers", "2"),
        ],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stderr is not None
    assert "trial 1 of 100000" in process.stderr.readline()
    # To all of them, as a terminal does it.
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert out == ""
    assert "Traceback" not in err
    assert err.splitlines()[-1] == "noise: interrupted"
