"""Demonstrations are validated, the model judged, and advice given in words."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from hmcs.motion.demonstrations import Demonstration, read_csv, write_csv
from hmcs.recognition.learning import learn
from hmcs.recognition.registry import DEFAULT
from hmcs.recognition.segments import LearningError
from hmcs.task import find_task, load_task
from hmcs_trainer.advice import advice
from hmcs_trainer.judging import judged
from hmcs_trainer.training import train
from hmcs_trainer.validation import findings

LINES = load_task("lines-through-obstacles")
CORNERS = read_csv(find_task(LINES.name).with_suffix(".csv"))


def shown(seed: int, name: str = "") -> Demonstration:
    """The four lines of the task by a hand that errs."""
    random = np.random.default_rng(seed)
    time_s = np.arange(0.0, CORNERS.time_s[-1], 0.02)
    states = [CORNERS.states[k - 1] for k in np.searchsorted(CORNERS.time_s, time_s, "right")]
    lines = np.stack([np.interp(time_s, CORNERS.time_s, c) for c in CORNERS.positions.T], axis=1)
    wander = np.cumsum(random.normal(scale=4e-4, size=lines.shape), axis=0)
    return Demonstration(name or f"take-{seed}", time_s, lines + wander, tuple(states))


def relabeled(demonstration: Demonstration, begin_s: float, end_s: float, label: str | None):
    within = (demonstration.time_s >= begin_s) & (demonstration.time_s < end_s)
    states = tuple(
        label if inside else state
        for inside, state in zip(within, demonstration.states, strict=True)
    )
    return demonstration._replace(states=states)


def texts(*demonstrations: Demonstration) -> list[str]:
    return [finding.text for finding in findings(LINES, demonstrations)]


def test_good_demonstrations_have_no_findings() -> None:
    assert texts(shown(1), shown(2), shown(3)) == []


def test_motion_without_a_label_between_labels_is_named_with_its_time() -> None:
    found = texts(relabeled(shown(1), 2.2, 3.2, None), shown(2), shown(3))
    (text,) = (each for each in found if "without a label" in each)
    assert "take-1: from 2.2 s to 3.2 s the hand moves 0.1" in text


def test_a_label_that_lasts_a_moment_is_named() -> None:
    taken = relabeled(shown(1), 2.2, 2.5, "over")
    assert any("'over' from 2.2 s to 2.5 s" in text for text in texts(taken, shown(2)))


def test_a_state_shown_once_is_named() -> None:
    only = relabeled(shown(2), 0.0, 2.2, None)
    assert any("'lift' is shown once" in text for text in texts(shown(1), only))


def test_a_wild_outlier_is_named_with_how_far_it_is_off() -> None:
    wild = shown(4)
    late = wild.time_s >= CORNERS.time_s[3]
    positions = wild.positions.copy()
    positions[late] += np.linspace(0, -1.0, int(late.sum()))[:, None] * [0, 0, 1.0]
    found = texts(shown(1), shown(2), shown(3), wild._replace(positions=positions))
    assert any("take-4: 'lower' is" in text and "leave it out" in text for text in found)


def test_a_gesteme_that_is_never_shown_ends_it() -> None:
    without = relabeled(shown(1), 0.0, 2.2, None)
    serious = [f for f in findings(LINES, [without, without._replace(name="b")]) if f.serious]
    assert "gesteme 'up' has no demonstration" in serious[0].text


def test_demonstrations_left_out_are_recognized_and_states_counted() -> None:
    demonstrations = [shown(seed) for seed in range(1, 4)]
    judgment = judged(LINES, demonstrations, None, DEFAULT)
    assert judgment.left_out == 3
    assert judgment.scores.accuracy > 0.9
    assert judgment.confusion.sum() == judgment.scores.labeled_steps
    assert judgment.confusion.trace() == judgment.scores.right_steps


def test_advice_names_the_states_that_are_confused_and_what_would_help() -> None:
    demonstrations = [shown(seed) for seed in range(1, 4)]
    judgment = judged(LINES, demonstrations, None, DEFAULT)
    model = learn(LINES, demonstrations)
    assert advice(model, judgment) == [
        "Nothing stands out: states are recognized correctly and soon, and demonstrations agree."
    ]
    confused = np.diag([40, 40, 40, 40])
    confused[0, 1] = 20
    (text, *_) = advice(model, judgment._replace(confusion=confused))
    assert text.startswith("lift and carry are confused in 20% of their steps; two more")
    (first, *_) = advice(model, judgment._replace(left_out=0))
    assert "show the whole task at least twice" in first


def test_training_writes_a_page_that_needs_nothing_else(tmp_path: Path) -> None:
    files = []
    for seed in range(1, 4):
        files.append(str(tmp_path / f"take-{seed}.csv"))
        write_csv(files[-1], shown(seed))
    reported: list[str] = []
    train(
        LINES.name,
        files,
        tmp_path / "m.hmcs",
        report=tmp_path / "m.html",
        progress=reported.append,
    )
    page = (tmp_path / "m.html").read_text()
    assert "http://" not in page.replace("http://www.w3.org", "").replace("http://purl.org", "")
    assert "recognized by a model of the others" in page
    assert page.count("<svg") == 2
    for picture in page.split("<svg")[1:]:
        ElementTree.fromstring("<svg" + picture.split("</svg>")[0] + "</svg>")
    assert any("steps right" in line for line in reported)
    assert sorted(f.name for f in tmp_path.iterdir() if "m." in f.name) == ["m.hmcs", "m.html"]


def test_what_cannot_be_learned_from_is_reported_and_nothing_is_written(tmp_path: Path) -> None:
    write_csv(tmp_path / "a.csv", shown(1))
    backwards = shown(2)
    write_csv(tmp_path / "b.csv", backwards._replace(positions=-backwards.positions))
    with pytest.raises(LearningError, match="goes another way than anywhere else"):
        train(LINES.name, [str(tmp_path / "a.csv"), str(tmp_path / "b.csv")], tmp_path / "m.hmcs")
    assert not (tmp_path / "m.hmcs").exists()
