"""Figure 2.14: force against error for each cue and each scaling."""

from __future__ import annotations

import numpy as np
from matplotlib.lines import Line2D

from hmcs.fixtures.compliance.cues import stiffness_kept
from hmcs.task.fixture_parts import CueName, ScalingName
from hmcs_laboratory.data.hands import Positive
from hmcs_laboratory.figures.drawing import COLORS, INK, Drawn, new_picture
from hmcs_laboratory.figures.fixture_fields import MM
from hmcs_laboratory.study import StudySettings


class ForceSettings(StudySettings):
    """Of figure 2.14."""

    cued_at_m: Positive = 0.01
    fade_m: Positive = 0.015
    reach_m: Positive = 0.04


def force_scaling(settings: ForceSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 2.14: force against error for the nine pairs of cue and scaling."""
    del rng
    picture = new_picture(6.4)
    errors = np.linspace(0.0, settings.reach_m, 201)
    cues: tuple[CueName, ...] = ("pedal", "silence", "recognized")
    names = {"pedal": "explicit: pedal", "silence": "implicit: silence", "recognized": "automatic"}
    scalings: tuple[ScalingName, ...] = ("toggle", "fade", "hold")
    axes = picture.subplots(3, 3, sharex=True, sharey=True)
    # Silence takes a rest before it counts, recognition some motion across the path.
    late_m = {"pedal": 0.0, "silence": 0.0, "recognized": 0.004}
    for row, cue in zip(axes, cues, strict=True):
        at_m = settings.cued_at_m + late_m[cue]
        for ax, scaling in zip(row, scalings, strict=True):
            kept = [
                1.0 if e < at_m else stiffness_kept(e, at_m, scaling, settings.fade_m)
                for e in errors
            ]
            ax.plot(MM * errors, errors * np.array(kept) / at_m, color=COLORS[0], linewidth=1.8)
            ax.axvline(MM * at_m, color=INK, linewidth=0.9, linestyle=(0, (4, 3)))
            ax.set_title(f"{names[cue]}, {scaling}")
    for ax in axes[-1]:
        ax.set_xlabel("error, mm")
    for ax in axes[:, 0]:
        ax.set_ylabel("force / force at the cue")
    picture.legend(
        [Line2D([], [], color=INK, linewidth=0.9, linestyle=(0, (4, 3)))],
        ["cue takes effect"],
        loc="outside lower center",
    )
    return Drawn(
        picture,
        {"cued_at_mm": MM * settings.cued_at_m, "fade_mm": MM * settings.fade_m},
        "Up to the cue the force grows with the error; then toggle ends it, hold keeps it, and "
        f"fade takes it away over {MM * settings.fade_m:.0f} mm.",
        "The thesis shows the three scalings; here each stands beside each cue. The automatic cue "
        "comes later, since it takes motion across the path to recognize.",
    )
