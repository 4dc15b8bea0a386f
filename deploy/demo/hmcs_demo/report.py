"""The report: a page on what happened, with pictures and figures, and files behind it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from hmcs.shown import as_html
from hmcs.task import Task
from hmcs_demo import figures
from hmcs_demo.measure import Measured
from hmcs_demo.page import PAGE
from hmcs_demo.summary import RmsMax, Summary, described

PATHS, BELIEF, LATENCY, PATH_ERROR = (
    "hand_and_robot.png",
    "belief.png",
    "latency.png",
    "path_error.png",
)

ACCURACY_GOAL = 0.97
"""Of the demo's own; the mean over all ways to hold two out is another figure."""


class Line(NamedTuple):
    """A line of the table of figures."""

    figure: str
    value: str
    goal: str
    """Empty where there is none."""
    reached: bool | None
    """None where there is no goal."""


def write_report(folder: Path, measured: Measured, summary: Summary, task: Task) -> None:
    """Write `summary.json`, the pictures and `index.html` into `folder`."""
    text = summary.model_dump_json(indent=2)
    (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
    figures.draw_paths(measured, folder / PATHS)
    figures.draw_belief(measured, summary, folder / BELIEF)
    figures.draw_latency(measured, summary, folder / LATENCY)
    figures.draw_path_error(measured, folder / PATH_ERROR)
    (folder / "index.html").write_text(page(summary, task), encoding="utf-8")


def page(summary: Summary, task: Task) -> str:
    """Return the page."""
    swap = summary.swap
    return PAGE.substitute(
        verdict=as_html(_verdict(summary)),
        steps=summary.steps,
        motion_s=f"{summary.motion_s:.0f}",
        shapes=as_html(", ".join(gesteme.name for gesteme in task.gestemes)),
        held_out=as_html(" and ".join(map(str, summary.held_out))),
        dead_zone_mm=f"{1e3 * task.dead_zone_m:g}",
        xi=f"{task.fixture.maximum_factor:g}",
        killed=as_html(swap.killed),
        newcomer=as_html(swap.newcomer),
        killed_at_s=f"{swap.at_s:.1f}",
        ready_after_s=f"{swap.ready_after_s:.1f}",
        stopped=_stopped(summary),
        rows="\n".join(_row(line) for line in lines(summary)),
        meanings="\n".join(_meanings()),
        versions=as_html(", ".join(f"{k} {v}" for k, v in summary.versions.items())),
        seed=summary.seed,
    )


def lines(summary: Summary) -> list[Line]:
    """Return the table of figures, with the goals of the project beside them."""
    delay, error, latency = (
        summary.switch_delay_steps,
        summary.path_error_mm,
        summary.latency_ms,
    )
    p99_ms = latency.step_to_belief.p99
    tracking = summary.velocity_tracking_mm_s_rms
    return [
        Line(
            "Steps recognized right",
            f"{100 * summary.state_accuracy:.1f} %",
            f"at least {100 * ACCURACY_GOAL:g} %",
            summary.state_accuracy >= ACCURACY_GOAL,
        ),
        Line("Switch delay, median", f"{delay.median:.1f} steps", "", None),
        _at_most("Switch delay, p95", delay.p95, 2, "steps"),
        _at_most("False switches in 1000 steps", summary.false_switches_per_1000_steps, 1, ""),
        _none("Steps without a belief", summary.missing_steps),
        _none("Steps without a belief around the swap", summary.swap.missing_steps),
        _none("Lost messages", summary.lost_messages),
        _none("Refused messages", summary.refused_messages),
        Line("Beliefs without some evidence", str(summary.degraded_steps), "", None),
        Line(
            "Longest wait for a belief around the swap",
            f"{summary.swap.longest_belief_gap_ms:.1f} ms",
            "",
            None,
        ),
        _hop("Hand → command", latency.input_to_command.p50, latency.input_to_command.p99),
        _hop("Hand → robot state", latency.input_to_robot.p50, latency.input_to_robot.p99),
        Line(
            "Step → belief, p50 / p99",
            f"{latency.step_to_belief.p50:.1f} / {p99_ms:.1f} ms",
            "p99 at most 10 ms",
            p99_ms <= 10,
        ),
        _at_most("Robot velocity against its reference, rms", tracking, 3, "mm/s"),
        Line("Hand to mean demonstration", _rms_max(error.operator), "", None),
        Line("Robot to mean demonstration", _rms_max(error.robot), "", None),
        _at_most("Processor, the whole stack", summary.cpu_cores, 1, "cores", digits=2),
        _none("Collisions", summary.collisions),
        _none("Stops of the robot by itself", summary.stops),
    ]


def _at_most(figure: str, value: float, goal: float, unit: str, digits: int = 1) -> Line:
    shown = f"{value:.{digits}f} {unit}".strip()
    return Line(figure, shown, f"at most {goal:g} {unit}".strip(), value <= goal)


def _none(figure: str, value: int) -> Line:
    return Line(figure, str(value), "0", value == 0)


def _hop(figure: str, p50: float, p99: float) -> Line:
    return Line(f"{figure}, p50 / p99", f"{p50:.1f} / {p99:.1f} ms", "", None)


def _rms_max(error: RmsMax) -> str:
    return f"{error.rms:.1f} mm rms, {error.max:.0f} mm at most"


def _verdict(summary: Summary) -> str:
    missing = "not one" if summary.missing_steps == 0 else str(summary.missing_steps)
    return (
        f"{100 * summary.state_accuracy:.1f} % of {summary.steps} steps recognized right while "
        f"they were made; {missing} went without a belief, though a classifier was killed midway."
    )


def _stopped(summary: Summary) -> str:
    if not summary.stops:
        return ""
    return (
        '<p class="warning">The robot stopped by itself: commands came too late, as this machine '
        "was too busy. The operator then let go of the dead-man and pressed it again; what the "
        "hand moved meanwhile, the robot did not follow. Recognition is not touched by it; run the "
        "demo again on a quieter machine for the robot's figures.</p>"
    )


def _row(line: Line) -> str:
    mark = {None: "", True: '<td class="yes">reached</td>', False: '<td class="no">missed</td>'}
    cells = "".join(f"<td>{as_html(cell)}</td>" for cell in (line.figure, line.value, line.goal))
    return f"<tr>{cells}{mark[line.reached] or '<td></td>'}</tr>"


def _meanings() -> Iterable[str]:
    for name, meaning in described().items():
        yield f"<dt><code>{as_html(name)}</code></dt><dd>{as_html(meaning)}</dd>"
