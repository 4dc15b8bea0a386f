"""What `hmcs check` says of demonstrations, with a task and without."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hmcs.motion.demonstrations import Demonstration, write_csv
from hmcs.recognition.segments import LearningError
from hmcs_trainer.checking import Check, Judged, check_files
from hmcs_trainer.training import checked
from support.lessons import ROUND, lesson_task, performed

Write = Callable[..., str]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def written(name: str, demonstration: Demonstration) -> str:
        write_csv(tmp_path / name, demonstration)
        return str(tmp_path / name)

    return written


def only(check: Check) -> Judged:
    (judged,) = check.judged
    return judged


def serious(check: Check) -> list[str]:
    return [finding.text for finding in check.findings if finding.serious]


def test_a_sound_demonstration_is_measured(write: Write) -> None:
    shown = performed(1)
    judged = only(check_files([write("d.csv", shown)], None))
    assert (judged.verdict, judged.units, judged.fits) == ("yes", "m, s", None)
    assert judged.states == ROUND
    assert judged.samples == len(shown.positions)
    assert judged.rate_hz == pytest.approx(100.0)
    assert judged.lasts_s == pytest.approx(shown.time_s[-1])
    # Steps of 1 cm cut corners.
    truth_m = float(np.linalg.norm(np.diff(shown.positions[::8], axis=0), axis=1).sum())
    assert judged.way_m == pytest.approx(truth_m, rel=0.05)
    np.testing.assert_allclose(judged.upper_m, shown.positions.max(axis=0))


@pytest.mark.parametrize("with_task", [False, True])
def test_millimeters_are_recognized_and_refused(write: Write, with_task: bool) -> None:
    shown = performed(1)
    file = write("d.csv", shown._replace(positions=3000 * shown.positions))
    check = check_files([file], lesson_task() if with_task else None)
    assert only(check).verdict == "no"
    assert "mm" in only(check).units or "cm" in only(check).units
    assert any("are they in" in text and "Give meters" in text for text in serious(check))


def test_a_jump_is_no_matter_of_units(write: Write) -> None:
    shown = performed(1)
    far = shown.positions.copy()
    far[100] += 9.0
    check = check_files([write("d.csv", shown._replace(positions=far))], None)
    assert only(check).units == "m, s"
    assert any("at 1.000 s the hand jumps" in text for text in serious(check))


def test_milliseconds_are_recognized_and_trained_from(write: Write) -> None:
    shown = performed(1)
    check = check_files([write("d.csv", shown._replace(time_s=1000 * shown.time_s))], None)
    assert (only(check).verdict, only(check).units) == ("mind", "m, s or not?")
    assert not serious(check)
    assert any("in milliseconds" in finding.text for finding in check.findings)


def test_a_way_out_of_the_workspace_is_reported(write: Write) -> None:
    shown = performed(1)
    check = check_files(
        [write("d.csv", shown._replace(positions=6 * shown.positions))], lesson_task()
    )
    assert only(check).fits is False
    assert only(check_files([write("e.csv", shown)], lesson_task())).fits is True


def test_a_file_that_cannot_be_read_does_not_keep_others_from_being_judged(
    write: Write, tmp_path: Path
) -> None:
    bad = tmp_path / "bad.csv"
    bad.write_text("time_s,x_m,y_m\n0,1,2\n1,x,2\n")
    check = check_files([str(bad), write("d.csv", performed(1))], None)
    assert only(check).name == "d.csv"
    assert any("bad.csv:3: x_m is 'x'" in text for text in serious(check))


def test_what_training_refuses_is_refused_here(write: Write) -> None:
    shown = performed(1)
    strange = write("d.csv", shown._replace(states=("reach",) * 100 + shown.states[100:]))
    wrong = write("w.csv", shown._replace(states=("rech", *shown.states[1:])))
    for files in ([wrong], [strange, wrong]):
        check = check_files(files, lesson_task())
        assert any("did you mean 'reach'" in text for text in serious(check))
        with pytest.raises(LearningError, match="did you mean 'reach'"):
            checked(lesson_task(), files, lambda _: None)
    assert {judged.name: judged.verdict for judged in check.judged}["w.csv"] == "no"


def test_motion_without_labels_is_judged_for_itself_with_what_to_do(write: Write) -> None:
    shown = performed(1)
    bare = write("bare.csv", shown._replace(states=(None,) * len(shown.states)))
    check = check_files([bare, write("d.csv", performed(2))], lesson_task())
    assert not serious(check)
    assert {judged.name: judged.states for judged in check.judged}["bare.csv"] == ()
    assert any("bare.csv: has no labels" in finding.text for finding in check.findings)


def test_two_dimensions_among_three_are_reported_in_one_line_before_they_disagree(
    write: Write,
) -> None:
    flat = performed(1)
    files = [write("flat.csv", flat._replace(positions=flat.positions * (1, 1, 0)))]
    files += [write(f"d{k}.csv", performed(k)) for k in (2, 3)]
    with pytest.raises(LearningError) as refused:
        checked(lesson_task(), files, lambda _: None)
    assert "flat.csv: 'lift' stays in the plane z = 0" in str(refused.value)
    assert "another way" not in str(refused.value)


def test_a_plane_among_motions_in_space_is_reported(write: Write) -> None:
    flat = performed(1)
    flat = flat._replace(positions=flat.positions * (1, 1, 0))
    check = check_files([write("flat.csv", flat), write("d.csv", performed(2))], None)
    assert any(
        finding.text.startswith("flat.csv: in the plane z = 0") for finding in check.findings
    )
