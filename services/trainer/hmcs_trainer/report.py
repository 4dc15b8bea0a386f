"""The page beside a model: how well it recognizes, what its guides look like, what to do next."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from hmcs.palette import GRID_COLOR, INK, state_color
from hmcs.recognition.model import Model
from hmcs.shown import as_figure, as_html
from hmcs.whole_files import written_whole
from hmcs_trainer.judging import Judgment
from hmcs_trainer.validation import Finding

_PAGE = Template(
    """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$name</title>
<style>
  body { font: 16px/1.5 system-ui, "DejaVu Sans", sans-serif; color: #222; max-width: 60rem;
         margin: 0 auto; padding: 1.5rem; background: #fff; }
  h1 { font-size: 1.6rem; } h2 { font-size: 1.15rem; margin-top: 2rem; }
  svg { max-width: 100%; height: auto; } li { margin: .3rem 0; }
  .numbers { font-size: 1.1rem; } .small { color: #555; font-size: .9rem; }
</style>
</head>
<body>
<h1>Model $name</h1>
<p class="small">$facts</p>
<p class="numbers">$numbers</p>
<h2>What to do next</h2>
<ul>$advice</ul>
$findings
<h2>Which state is taken for which</h2>
$confusion
<h2>Guides, and how far the demonstrations lay apart</h2>
$guides
</body>
</html>
"""
)


def write_report(
    path: Path,
    model: Model,
    judgment: Judgment,
    advice: Sequence[str],
    found: Sequence[Finding],
) -> None:
    """Write the page, whole or not at all; it needs no other file."""
    items = "".join(map(_item, (finding.text for finding in found)))
    page = _PAGE.substitute(
        name=as_html(model.name),
        facts=as_html(
            f"hash {model.hash}, recognizer {model.recognizer}, task {model.task.name}, "
            f"from {', '.join(model.demonstrations)}"
        ),
        numbers=as_html(numbers(judgment)),
        advice="".join(map(_item, advice)),
        findings=f"<h2>About the demonstrations</h2><ul>{items}</ul>" if items else "",
        confusion=_svg(_confusion(model, judgment)),
        guides=_svg(_guides(model)),
    )
    with written_whole(path) as unfinished:
        unfinished.write_text(page, encoding="utf-8")


def _item(text: str) -> str:
    return f"<li>{as_html(text)}</li>"


def numbers(judgment: Judgment) -> str:
    """Return what was measured, in a sentence."""
    if not judgment.left_out:
        return "Not judged: no demonstration can be left out."
    scores = judgment.scores
    changes = ""
    if len(scores.switch_delays):
        changes = (
            f"changes of state seen {scores.switch_delay(50):+.0f} steps later (median), "
            f"{scores.switch_delay(95):+.0f} at most in 95 %; "
        )
    return (
        f"Each of {judgment.left_out} demonstrations recognized by a model of the others: "
        f"{scores.accuracy:.1%} of {scores.labeled_steps} steps right; {changes}"
        f"{scores.false_switches} false changes."
    )


def _confusion(model: Model, judgment: Judgment) -> Figure:
    names, matrix = list(map(as_figure, model.state_names)), judgment.confusion
    shares = matrix / np.maximum(matrix.sum(axis=1, keepdims=True), 1)
    size = 2.2 + 0.55 * len(names)
    picture = Figure(figsize=(size + 1.5, size), layout="constrained")
    ax: Any = picture.add_subplot()
    ax.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0)
    ax.set_xticks(range(len(names)), names, rotation=40, ha="right")
    ax.set_yticks(range(len(names)), names)
    for number, labels in enumerate(zip(ax.get_xticklabels(), ax.get_yticklabels(), strict=True)):
        for label in labels:
            label.set_color(state_color(number))
    ax.set_xlabel("believed state")
    ax.set_ylabel("true state")
    for row, own in enumerate(shares):
        for column, share in enumerate(own):
            if matrix[row, column]:
                color = "white" if share > 0.5 else INK
                ax.text(column, row, f"{share:.0%}", ha="center", va="center", color=color)
    return picture


def _guides(model: Model) -> Figure:
    """Every path in the plane it is widest in, with the band in which demonstrations lay."""
    count = len(model.gesteme_names)
    columns = min(3, count)
    rows = -(-count // columns)
    picture = Figure(figsize=(3.4 * columns, 3.0 * rows), layout="constrained")
    for number, name in enumerate(model.gesteme_names):
        ax: Any = picture.add_subplot(rows, columns, number + 1)
        color = state_color(_state_of(model, name))
        points, spread = model.paths[name].points, model.spreads[name]
        first, second = sorted(np.argsort(np.ptp(points, axis=0))[-2:].tolist())
        flat = points[:, [first, second]]
        tangents = np.gradient(flat, axis=0)
        lengths = np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-12)
        across = np.stack([-tangents[:, 1], tangents[:, 0]], axis=1) / lengths * spread[:, None]
        band = 1e3 * np.concatenate([flat + across, (flat - across)[::-1]])
        ax.fill(*band.T, color=color, alpha=0.25, linewidth=0)
        ax.plot(*(1e3 * flat).T, color=color, linewidth=1.8)
        ax.plot(*(1e3 * flat[0]), "o", color=INK, ms=5)
        ax.set_aspect("equal", adjustable="datalim")
        ax.set_xlabel(f"{'xyz'[first]}, mm")
        ax.set_ylabel(f"{'xyz'[second]}, mm")
        ax.set_title(f"{as_figure(name)}: ± {1e3 * float(spread.mean()):.1f} mm", fontsize=10)
        ax.grid(color=GRID_COLOR, linewidth=0.6)
    return picture


def _state_of(model: Model, gesteme: str) -> int:
    """The number of the state a gesteme belongs to, by whose color the page shows its guide."""
    states = model.task.states
    return next((number for number, state in enumerate(states) if gesteme in state.gestemes), 0)


def _svg(picture: Figure) -> str:
    """The picture to stand in a page."""
    stream = io.StringIO()
    FigureCanvasSVG(picture)
    picture.savefig(
        stream, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type"))
    )
    text = stream.getvalue()
    return text[text.index("<svg") :]
