"""The page of the figures; it needs nothing but the pictures beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from string import Template
from typing import TYPE_CHECKING, Any

from hmcs.shown import as_html
from hmcs_laboratory.figures.figure import Figure
from hmcs_laboratory.running import versions

if TYPE_CHECKING:
    from hmcs_laboratory.figures.run import Made

_PAGE = Template(
    """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>HMCS figures</title>
<style>
  body { font: 16px/1.55 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; color: #222;
         max-width: 62rem; margin: 0 auto; padding: 1.5rem 1.2rem 4rem; background: #fff; }
  h1 { font-size: 1.7rem; line-height: 1.2; margin: 1rem 0 .4rem; }
  h2 { font-size: 1.2rem; margin: 0 0 .6rem; }
  p, dd { max-width: 46rem; }
  section { border-top: 1px solid #e3e3e3; margin-top: 2.6rem; padding-top: 1.6rem; }
  nav { columns: 2; margin: 1.2rem 0; }
  nav a { display: block; }
  img { width: 100%; height: auto; }
  dl { margin: 1rem 0; }
  dt { font-weight: 600; margin-top: .7rem; } dd { margin: 0; color: #333; }
  table { border-collapse: collapse; font-size: .9rem; }
  td { text-align: left; vertical-align: top; padding: .22rem 1.2rem .22rem 0;
       border-bottom: 1px solid #e3e3e3; }
  code { font-size: .92em; }
  summary { cursor: pointer; }
  .small { color: #555; font-size: .9rem; }
</style>
</head>
<body>
<h1>The figures of the thesis, made anew</h1>
<p>D. Aarno, <i>Intention Recognition in Human Machine Collaborative Systems</i> (KTH, 2007). For
each figure: what the thesis shows, what came out here, with numbers computed from the very data
drawn, and where the two differ. Figures B.1 and B.2 are of what the thesis leaves open.</p>
$fast
<nav>
$contents
</nav>
$sections
<section>
<p class="small">Seed $seed; $versions. All numbers are in
<a href="figures.json">figures.json</a> too.</p>
</section>
</body>
</html>
"""
)

_SECTION = Template(
    """<section id="$name">
<h2>Figure $number: $title</h2>
<a href="$name.svg"><img src="$name.png" alt="Figure $number: $title"></a>
<dl>
<dt>The thesis</dt><dd>$shows</dd>
<dt>Here</dt><dd>$found</dd>
$stand_in
<dt>Where they differ</dt><dd>$differs</dd>
</dl>
<details><summary>Settings, seed $seed$shared</summary>
<table>
$settings
</table>
</details>
</section>"""
)

_FAST = """<p><b>Made fast:</b> with fewer trials and settings than the figures deserve.
Make them without <code>--fast</code> before reading anything from the curves.</p>"""


def page(figures: Sequence[Figure[Any]], made: Sequence[Made], *, fast: bool, seed: int) -> str:
    """Return the page of these figures, as they were made."""
    contents = [
        f'<a href="#{as_html(figure.name)}">{as_html(f"{figure.number} {figure.title}")}</a>'
        for figure in figures
    ]
    return _PAGE.substitute(
        fast=_FAST if fast else "",
        contents="\n".join(contents),
        sections="\n".join(
            _section(figure, each, seed) for figure, each in zip(figures, made, strict=True)
        ),
        seed=seed,
        versions=as_html(", ".join(f"{name} {v}" for name, v in versions().items())),
    )


def _section(figure: Figure[Any], made: Made, seed: int) -> str:
    stand_in = ""
    if figure.stand_in:
        stand_in = f"<dt>Data</dt><dd>{as_html(figure.stand_in)}</dd>"
    return _SECTION.substitute(
        name=as_html(figure.name),
        number=as_html(str(figure.number)),
        title=as_html(figure.title),
        shows=as_html(figure.shows),
        found=as_html(made.found),
        stand_in=stand_in,
        differs=as_html(made.differs),
        seed=seed,
        shared=as_html(f", data of figure {figure.data_of}") if figure.data_of else "",
        settings="\n".join(_rows(figure, made.settings)),
    )


def _rows(figure: Figure[Any], settings: Mapping[str, Any]) -> list[str]:
    fields = type(figure.settings).model_fields
    return [
        f"<tr><td><code>{as_html(name)}</code></td><td>{as_html(_value(value))}</td>"
        f"<td>{as_html(' '.join((fields[name].description or '').split()))}</td></tr>"
        for name, value in settings.items()
    ]


def _value(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(map(_value, value))
    return f"{value:g}" if isinstance(value, float) else str(value)
