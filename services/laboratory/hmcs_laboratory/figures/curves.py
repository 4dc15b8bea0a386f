"""Figures of gesteme classification against one setting at a time: 4.3 to 4.10."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Annotated, Literal, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture
from matplotlib.lines import Line2D
from matplotlib.transforms import offset_copy
from pydantic import Field

from hmcs_laboratory.data.hands import Count, NotNegative
from hmcs_laboratory.figures.drawing import (
    FAINT,
    METHOD_COLORS,
    METHOD_MARKS,
    Drawn,
    Number,
    new_picture,
)
from hmcs_laboratory.study import StudySettings
from hmcs_laboratory.summary import CI95, Row, rows_of

Kind = Literal["line", "circle", "mixed"]

OURS = "hmcs-gestemes"
FLOORED = ("od-hmm", "md-hmm", "fft-hmm")
UNFLOORED = tuple(f"{name}-no-floor" for name in FLOORED)
ALIKE = 0.02
"""Methods whose mean shares differ by less count as alike."""
NAMES = {"od-hmm": "OD", "md-hmm": "MD", "fft-hmm": "FFT", OURS: "ours"}


class CurvesSettings(StudySettings):
    """Of all curves."""

    dimensions: Annotated[int, Field(ge=2, le=3)] = 2
    kinds: tuple[Kind, ...] = ("line", "circle", "mixed")
    """A panel each."""
    trials: Count = 10
    """Random sets of gestemes, as in the thesis."""
    unfloored_trials: Count = 5
    """So many of them are measured without the emission floor too."""
    test: Count = 5
    """Performances of each gesteme to recognize."""


class NoiseCurvesSettings(CurvesSettings):
    """Of figures 4.3 and 4.4."""

    noise: tuple[NotNegative, ...] = (0.05, 0.15, 0.25, 0.35, 0.45, 0.55)
    """κ of (3.3)."""
    gestemes: Count = 10
    training: Count = 5
    """Performances of each gesteme to learn from."""


class GestemeCurvesSettings(CurvesSettings):
    """Of figures 4.5 and 4.6."""

    gestemes: tuple[Count, ...] = (2, 5, 10, 15, 20, 25)
    training: Count = 5
    """Performances of each gesteme to learn from."""
    noise: NotNegative = 0.15
    """κ of (3.3)."""


class TrainingCurvesSettings(CurvesSettings):
    """Of figures 4.7 and 4.8."""

    training: tuple[Count, ...] = (1, 2, 3, 5, 10)
    """Performances of each gesteme to learn from."""
    gestemes: Count = 10
    noise: NotNegative = 0.15
    """κ of (3.3)."""


class SymbolCurvesSettings(CurvesSettings):
    """Of figures 4.9 and 4.10."""

    symbols: tuple[Count, ...] = (2, 4, 10, 25, 60)
    """Centers of the code book (OD), or bins of each dimension (MD, FFT)."""
    gestemes: Count = 10
    training: Count = 5
    """Performances of each gesteme to learn from."""
    noise: NotNegative = 0.15
    """κ of (3.3)."""


class _Point(NamedTuple):
    """Accuracy of a method at a setting."""

    mean: float
    half: float
    """Half width of the 95 % interval; 0 of one trial."""


Curves = Mapping[tuple[str, str], Mapping[float, _Point]]
"""Of each kind and method the points by the value of what varies."""


def noise_curves(settings: NoiseCurvesSettings, rng: np.random.Generator) -> Drawn:
    """Draw figures 4.3 and 4.4."""
    curves = _measured("noise", settings, "noise", rng)
    guess = 1 / settings.gestemes
    picture = _panels(settings, curves, "noise κ", dict.fromkeys(settings.noise, guess))
    at = min(settings.noise, key=lambda noise: abs(noise - 0.35))
    differs = (
        f"The thesis calls κ from 0.3 to 0.5 almost as bad as guessing ({guess:.2f} here). It "
        f"mentions no floor on the probabilities of symbols: {_floors(settings, curves, at)} at "
        f"κ = {at:g}."
    )
    return _drawn(picture, curves, settings, "noise", "κ =", differs)


def gesteme_curves(settings: GestemeCurvesSettings, rng: np.random.Generator) -> Drawn:
    """Draw figures 4.5 and 4.6."""
    curves = _measured("gesteme-count", settings, "gestemes", rng)
    guess = {float(x): 1 / x for x in settings.gestemes}
    picture = _panels(settings, curves, "number of gestemes", guess)
    most = max(settings.gestemes)
    differs = (
        "The thesis falls almost linearly to about 0.60 with 25 gestemes. Here "
        f"{_floors(settings, curves, most)} with {most}."
    )
    return _drawn(picture, curves, settings, "gestemes", "with", differs)


def training_curves(settings: TrainingCurvesSettings, rng: np.random.Generator) -> Drawn:
    """Draw figures 4.7 and 4.8."""
    curves = _measured("training-count", settings, "training", rng)
    guess = 1 / settings.gestemes
    label = "training sequences of each gesteme"
    few = min(settings.training, key=lambda training: abs(training - 2))
    picture = _panels(
        settings, curves, label, dict.fromkeys(map(float, settings.training), guess), log=True
    )
    differs = (
        "The thesis finds the rate quite high already with two training sequences. Here "
        f"{_floors(settings, curves, few)} with {few}: without a floor a symbol never seen in "
        "training rules the right gesteme out."
    )
    return _drawn(picture, curves, settings, "training", "with", differs)


def symbol_curves(settings: SymbolCurvesSettings, rng: np.random.Generator) -> Drawn:
    """Draw figures 4.9 and 4.10."""
    curves = _measured("symbol-count", settings, "symbols", rng)
    guess = 1 / settings.gestemes
    most = max(settings.symbols)
    label = "symbols: centers (OD), bins an axis (MD, FFT)"
    picture = _panels(
        settings, curves, label, dict.fromkeys(map(float, settings.symbols), guess), log=True
    )
    differs = (
        "The thesis finds the number not crucial, with too few and too many both bad. With "
        f"{most} here {_floors(settings, curves, most)}: without a floor each finer symbol is one "
        "more that training may lack. Our method has no symbols; its line is there to compare."
    )
    return _drawn(picture, curves, settings, "symbols", "with", differs)


def _measured(name: str, settings: CurvesSettings, varies: str, rng: np.random.Generator) -> Curves:
    """Run the study of that name for each kind of gesteme."""
    # Peers take seconds to import, which figures without them need not wait for.
    from hmcs_laboratory.studies import STUDIES

    (study,) = (study for study in STUDIES if study.name == name)
    of_study = set(study.settings.model_fields)
    given = {field: value for field, value in settings.model_dump().items() if field in of_study}
    curves: dict[tuple[str, str], dict[float, _Point]] = {}
    for kind, streams in zip(settings.kinds, rng.spawn(len(settings.kinds)), strict=True):
        trials = []
        for number, stream in enumerate(streams.spawn(settings.trials)):
            bare = UNFLOORED if number < settings.unfloored_trials else ()
            chosen = study.settings.model_validate(
                {**given, "kind": kind, "methods": (OURS, *FLOORED, *bare)}
            )
            trials.append(study.trial(chosen, stream))
        rows = rows_of(trials)
        for method in (OURS, *FLOORED, *UNFLOORED):
            curves[kind, method] = {
                float(_number(row, varies)): _Point(
                    _number(row, "accuracy"), _number(row, f"accuracy{CI95}")
                )
                for row in rows
                if row["method"] == method
            }
    return curves


def _number(row: Row, name: str) -> float:
    value = row[name]
    return 0.0 if value is None else float(value)


def _shown(settings: CurvesSettings) -> Kind:
    """The kind of gestemes that is described."""
    return "mixed" if "mixed" in settings.kinds else settings.kinds[0]


def _floors(settings: CurvesSettings, curves: Curves, at: float) -> str:
    """What the floor does at a setting."""
    floored, bare = (
        _numbers([curves[_shown(settings), name][at].mean for name in names])
        for names in (FLOORED, UNFLOORED)
    )
    return f"OD, MD and FFT have {floored} with the floor and {bare} without"


def _panels(
    settings: CurvesSettings,
    curves: Curves,
    label: str,
    guess: Mapping[float, float],
    *,
    log: bool = False,
) -> Picture:
    picture = new_picture(7.6, 11.0)
    rows = picture.subplots(2, len(settings.kinds), sharex=True, sharey=True, squeeze=False)
    values = sorted(guess)
    for axes, methods, floor in ((rows[0], FLOORED, "floor"), (rows[1], UNFLOORED, "no floor")):
        for ax, kind in zip(axes, settings.kinds, strict=True):
            if log:
                ax.set_xscale("log")
            for place, method in enumerate((*methods, OURS)):
                _curve(ax, method, curves[kind, method], 2.5 * (place - 1.5))
            ax.plot(values, [guess[x] for x in values], color=FAINT, linewidth=1.0, ls=":")
            ax.set_xticks(values, [f"{value:g}" for value in values])
            ax.set_xticks([], minor=True)
            ax.set_title(f"{kind}, {settings.dimensions}D, {floor}")
            ax.set_ylim(0.0, 1.03)
        axes[0].set_ylabel("share of gestemes recognized")
    for ax in rows[1]:
        ax.set_xlabel(label)
    picture.legend(handles=_legend(), loc="outside lower center", ncols=5)
    return picture


def _curve(ax: Axes, method: str, points: Mapping[float, _Point], aside_points: float) -> None:
    """Draw a method, so many points aside, that intervals do not hide one another."""
    base = method.removesuffix("-no-floor")
    x = sorted(points)
    mean, half = np.array([points[value] for value in x]).T
    aside = offset_copy(ax.transData, fig=ax.get_figure(root=True), x=aside_points, units="points")
    ax.errorbar(
        x,
        mean,
        yerr=[mean - np.clip(mean - half, 0, 1), np.clip(mean + half, 0, 1) - mean],
        color=METHOD_COLORS[base],
        marker=METHOD_MARKS[base],
        ms=5,
        linewidth=1.6,
        elinewidth=0.9,
        capsize=2,
        transform=aside,
    )


def _legend() -> Sequence[Line2D]:
    return [
        *(
            Line2D(
                [],
                [],
                color=METHOD_COLORS[method],
                marker=METHOD_MARKS[method],
                ms=5,
                linewidth=1.6,
                label=NAMES[method],
            )
            for method in (*FLOORED, OURS)
        ),
        Line2D([], [], color=FAINT, ls=":", label="guessing"),
    ]


def _drawn(
    picture: Picture,
    curves: Curves,
    settings: CurvesSettings,
    varies: str,
    before: str,
    differs: str,
) -> Drawn:
    values = [float(value) for value in getattr(settings, varies)]
    numbers: dict[str, Number] = {varies: values}
    for (kind, method), points in curves.items():
        numbers[f"{kind}_{method}"] = [points[value].mean for value in values]
        numbers[f"{kind}_{method}{CI95}"] = [points[value].half for value in values]
    shown = _shown(settings)

    def ranges(value: float, methods: Sequence[str]) -> str:
        return _numbers([curves[shown, method][value].mean for method in methods])

    ends = dict.fromkeys((values[0], values[len(values) // 2], values[-1]))
    parts = [
        f"{before} {value:g}: {ranges(value, FLOORED)} (no floor {ranges(value, UNFLOORED)}), ours "
        f"{ranges(value, [OURS])}"
        for value in ends
    ]
    overall = {
        method: float(
            np.mean([curves[kind, method][v].mean for kind in settings.kinds for v in values])
        )
        for method in FLOORED
    }
    order = sorted(FLOORED, key=lambda method: -overall[method])
    ranked = NAMES[order[0]]
    for better, worse in pairwise(order):
        alike = overall[better] - overall[worse] < ALIKE
        ranked += f" {'≈' if alike else '>'} {NAMES[worse]}"
    found = (
        f"Shares recognized of {shown} gestemes by OD, MD and FFT, means of {settings.trials} "
        f"trials ({min(settings.unfloored_trials, settings.trials)} without the floor): "
        f"{'; '.join(parts)}. Over all settings drawn with the floor: {ranked}. Bars are 95 % "
        "intervals."
    )
    numbers["mean_of_all"] = [overall[method] for method in FLOORED]
    among_best = overall[order[0]] - overall["od-hmm"] < ALIKE
    first = (
        f"The thesis says that OD appears to be the best; here {ranked}, where ≈ is a difference "
        f"below {ALIKE:g}."
        if among_best
        else f"The thesis says that OD appears to be the best; here {ranked}."
    )
    return Drawn(picture, numbers, found, f"{first} {differs}".strip())


def _numbers(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.2f}" for value in values)
