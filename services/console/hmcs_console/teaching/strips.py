"""The labels of a recording and what a model found in it, as two strips over one axis of time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import floor, log10

from hmcs.palette import FAINT, UNKNOWN_COLOR
from hmcs.recordings.stretches import NS_PER_S, Stretch
from hmcs.shown import as_html
from hmcs_console.seeing.found import colored_states
from hmcs_console.seeing.takes import Found, Take, band_color
from hmcs_console.shapes.palette import css

_WIDTH, _HEIGHT = 300, 100
_LEFT, _RIGHT = 4, 292
_STRIP = 16
_LABELS_Y, _FOUND_Y, _AXIS_Y = 16, 50, 70
_EMPTY = "#f1f1f1"
_HATCH = "hmcs-unknown"
_MOST_TICKS = 6
_LONGEST_NAME = 80
_SEEN_SHARE = 0.01
"""Of a strip that has to be empty to be seen."""
_SVG = (
    f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" width="100%" role="img" '
    'aria-label="labels, and what was found, over time" font-size="10" fill="currentColor" '
    'font-family="inherit">'
    f'<defs><pattern id="{_HATCH}" width="5" height="5" patternUnits="userSpaceOnUse" '
    f'patternTransform="rotate(45)"><rect width="5" height="5" fill="{_EMPTY}"></rect>'
    f'<rect width="2" height="5" fill="{UNKNOWN_COLOR}"></rect></pattern></defs>'
)
_KEY = '<span style="white-space:nowrap;margin-right:0.8em">{} {}</span>'
_SQUARE = '<span style="display:inline-block;width:0.8em;height:0.8em;border-radius:2px;{}"></span>'
_HATCHED = f"background:repeating-linear-gradient(135deg,{UNKNOWN_COLOR} 0 2px,{_EMPTY} 2px 5px)"


def strips(take: Take, found: Found, states: Sequence[str]) -> str:
    """Return HTML of both strips, with what their colors mean.

    Unknown motion is hatched; where nothing is labeled, or no hand held on, it is empty.
    """
    named = colored_states(take, states)
    duration_s = max(take.duration_s, 1e-3)
    parts = [
        _SVG,
        _title("labels", _LABELS_Y),
        *_strip(take.labels, None, _LABELS_Y, duration_s, named),
        _title(f"found by {found.model}", _FOUND_Y),
        *_strip(found.segments, found.probability, _FOUND_Y, duration_s, named),
        *_axis(duration_s),
        "</svg>",
        _legend(
            [each.state for each in (*take.labels, *found.segments)],
            named,
            _has_gaps(take.labels, duration_s) or _has_gaps(found.segments, duration_s),
        ),
    ]
    return f'<div style="padding:0 0.5em">{"".join(parts)}</div>'


def ticks(duration_s: float) -> list[float]:
    """Return round times from 0, a few of them, up to the end of a recording, s."""
    least = duration_s / _MOST_TICKS
    power = 10.0 ** floor(log10(least))
    step = next(step for step in (power, 2 * power, 5 * power, 10 * power) if step >= least)
    return [number * step for number in range(int(duration_s / step + 1e-9) + 1)]


def _title(text: str, strip_y: int) -> str:
    return f'<text x="{_LEFT}" y="{strip_y - 4}">{as_html(text, _LONGEST_NAME)}</text>'


def _strip(
    stretches: Sequence[Stretch],
    probability: Sequence[float] | None,
    y: int,
    duration_s: float,
    named: Sequence[str],
) -> Iterator[str]:
    yield _box(_LEFT, _RIGHT, y, _EMPTY, "")
    for number, stretch in enumerate(stretches):
        begin_s, end_s = (at / NS_PER_S for at in stretch[:2])
        hint = f"{stretch.state or 'unknown'}, {begin_s:.2f} s to {end_s:.2f} s"
        if probability is not None:
            hint += f", {probability[number]:.0%}"
        color = css(band_color(stretch.state, named)) if stretch.state else f"url(#{_HATCH})"
        yield _box(_x(begin_s, duration_s), _x(end_s, duration_s), y, color, hint)


def _box(begin: float, end: float, y: int, fill: str, hint: str) -> str:
    title = f"<title>{as_html(hint, 2 * _LONGEST_NAME)}</title>" if hint else ""
    return (
        f'<rect x="{begin:.2f}" y="{y}" width="{max(end - begin, 0.0):.2f}" height="{_STRIP}" '
        f'fill="{fill}">{title}</rect>'
    )


def _axis(duration_s: float) -> Iterator[str]:
    yield (f'<path d="M{_LEFT} {_AXIS_Y}H{_RIGHT}" stroke="{FAINT}" fill="none"></path>')
    for at_s in ticks(duration_s):
        x = _x(at_s, duration_s)
        yield f'<path d="M{x:.2f} {_AXIS_Y}v3" stroke="{FAINT}" fill="none"></path>'
        anchor = "start" if at_s == 0 else "middle"
        yield f'<text x="{x:.2f}" y="{_AXIS_Y + 13}" text-anchor="{anchor}">{at_s:g}</text>'
    middle = (_LEFT + _RIGHT) / 2
    yield f'<text x="{middle:g}" y="{_AXIS_Y + 26}" text-anchor="middle">time, s</text>'


def _x(at_s: float, duration_s: float) -> float:
    return _LEFT + (_RIGHT - _LEFT) * min(max(at_s / duration_s, 0.0), 1.0)


def _has_gaps(stretches: Sequence[Stretch], duration_s: float) -> bool:
    covered_ns = sum(stretch.end_ns - stretch.begin_ns for stretch in stretches)
    return covered_ns < (1 - _SEEN_SHARE) * duration_s * NS_PER_S


def _legend(said: Iterable[str], named: Sequence[str], has_gaps: bool) -> str:
    """What the colors mean, of states that occur, in the order of the task."""
    there = set(said)
    bare = {state.partition("/")[0] for state in there if state}
    known = [state for state in named if state in bare]
    keys = [
        _KEY.format(
            _SQUARE.format(f"background:{css(band_color(state, named))}"),
            as_html(state, _LONGEST_NAME),
        )
        for state in (*known, *sorted(bare - set(known)))
    ]
    if "" in there:
        keys.append(_KEY.format(_SQUARE.format(_HATCHED), "unknown"))
    if has_gaps:
        keys.append(_KEY.format(_SQUARE.format(f"background:{_EMPTY}"), "none"))
    return f'<div style="font-size:0.8em;line-height:1.6">{"".join(keys)}</div>'
