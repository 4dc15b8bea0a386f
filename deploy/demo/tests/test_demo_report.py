from __future__ import annotations

import re
from pathlib import Path

import matplotlib.image
import pytest

from hmcs.recognition.model import Model
from hmcs_demo.measure import Measured
from hmcs_demo.report import lines, page, write_report
from hmcs_demo.summary import Summary, described

CONTRACT = {
    *("steps", "missing_steps", "lost_messages", "refused_messages", "state_accuracy"),
    *("switch_delay_steps.median", "switch_delay_steps.p95", "false_switches_per_1000_steps"),
    *(f"path_error_mm.{who}.{what}" for who in ("operator", "robot") for what in ("rms", "max")),
    "velocity_tracking_mm_s_rms",
    *(
        f"latency_ms.{hop}.{p}"
        for hop in ("input_to_command", "input_to_robot", "step_to_belief")
        for p in ("p50", "p99")
    ),
    *("swap.missing_steps", "swap.longest_belief_gap_ms"),
    *("cpu_cores", "collisions", "seed", "versions"),
}


def flat(value: object, prefix: str = "") -> set[str]:
    if not isinstance(value, dict) or prefix == "versions":
        return {prefix}
    return {name for key, v in value.items() for name in flat(v, f"{prefix}.{key}".strip("."))}


def test_summary_has_every_figure_that_was_promised(summary: Summary) -> None:
    assert flat(summary.model_dump()) >= CONTRACT


def test_summary_comes_back_from_its_json(summary: Summary) -> None:
    assert Summary.model_validate_json(summary.model_dump_json()) == summary


def test_every_figure_is_explained(summary: Summary) -> None:
    explained = described()
    statistic = re.compile(r"\.(rms|max|p\d\d)$")
    named = {name for name in flat(summary.model_dump()) if not statistic.search(name)}
    assert named <= set(explained)
    assert all(meaning for meaning in explained.values())


def test_goals_are_distinguished_from_what_was_reached(summary: Summary) -> None:
    good = {line.figure: line.reached for line in lines(summary)}
    assert good["Steps without a belief"] is True
    assert good["Hand to mean demonstration"] is None
    bad = summary.model_copy(update={"missing_steps": 1, "state_accuracy": 0.969})
    missed = {line.figure for line in lines(bad) if line.reached is False}
    assert missed == {"Steps without a belief", "Steps recognized right"}


def test_page_shows_all_figures_and_needs_nothing_from_elsewhere(
    summary: Summary, model: Model
) -> None:
    text = page(summary, model.task)
    assert "$" not in text
    for line in lines(summary):
        assert line.figure in text
        assert line.value in text
    assert not re.search(r"https?://", text)
    assert 'class="warning"' not in text


def test_page_shows_names_as_they_read(summary: Summary, model: Model) -> None:
    evil = "<script>top.ran=1</script>\x1b[2J"
    swap = summary.swap.model_copy(update={"killed": evil, "newcomer": evil})
    text = page(summary.model_copy(update={"swap": swap, "versions": {evil: evil}}), model.task)
    assert "<script" not in text
    assert "\x1b" not in text
    assert text.count("&lt;script&gt;top.ran=1&lt;/script&gt;\\x1b[2J") == 4


def test_page_tells_when_the_robot_stopped(summary: Summary, model: Model) -> None:
    text = page(summary.model_copy(update={"stops": 1}), model.task)
    assert 'class="warning"' in text


def test_report_is_a_page_with_the_pictures_it_names(
    measured: Measured, summary: Summary, model: Model, tmp_path: Path
) -> None:
    write_report(tmp_path, measured, summary, model.task)
    text = (tmp_path / "index.html").read_text(encoding="utf-8")
    pictures = re.findall(r'src="([^"]+)"', text)
    assert len(pictures) == 4
    for picture in pictures:
        height, width = matplotlib.image.imread(tmp_path / picture).shape[:2]
        assert width >= 1000
        assert height >= 400
    assert Summary.model_validate_json((tmp_path / "summary.json").read_text("utf-8")) == summary


def test_figures_that_are_no_numbers_are_refused(summary: Summary) -> None:
    with pytest.raises(ValueError, match="finite"):
        Summary.model_validate({**summary.model_dump(), "state_accuracy": float("nan")})
