"""An arm drawn: its joints at home, seen from the side and from above, and where its tool gets to.

Needs matplotlib, which `hmcs` brings.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hmcs.whole_files import written_whole
from hmcs_robot.description.checking import Reach
from hmcs_robot.description.described import DescribedArm

_VIEWS = (("x", "z", "from the side"), ("x", "y", "from above"))
_MOST_POINTS = 6000


def draw_arm(arm: DescribedArm, reach: Reach, target: Path) -> None:
    """Write a picture of an arm; its ending says the format. Raises OSError, ValueError."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 5.5), layout="constrained")
    FigureCanvasAgg(figure)
    for (across, up, view), axes in zip(_VIEWS, figure.subplots(1, 2), strict=True):
        _draw_view(axes, arm, reach, ("xyz".index(across), "xyz".index(up)))
        axes.set_xlabel(f"{across} / m")
        axes.set_ylabel(f"{up} / m")
        axes.set_title(view)
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False)
    figure.suptitle(
        f"{arm.urdf.robot.get('name') or arm.urdf.file.stem}: {len(arm.chain.joint_names)} joints, "
        f"tool link {arm.tool_link}, reach {reach.farthest_m:.2f} m"
    )
    with written_whole(target) as unfinished:
        figure.savefig(unfinished, dpi=120, format=target.suffix.lower().removeprefix("."))


def _draw_view(axes: Any, arm: DescribedArm, reach: Reach, view: tuple[int, int]) -> None:
    points = reach.points[:_MOST_POINTS, view]
    axes.plot(*points.T, ".", color="0.8", markersize=1.5, label="where the tool gets to")
    for name, positions in {**arm.poses, "home": arm.home}.items():
        line = arm.chain.origins(positions)[:, view]
        home = name == "home"
        axes.plot(
            *line.T,
            "-o" if home else "--",
            color="tab:blue" if home else None,
            linewidth=2.5 if home else 1.5,
            markersize=5,
            label="home" if home else f"pose {name}",
        )
    tool = arm.chain.poses(arm.home)
    for axis, color in enumerate(("tab:red", "tab:green", "tab:purple")):
        tip = tool[:3, 3] + 0.12 * reach.farthest_m * tool[:3, axis]
        axes.plot(
            *np.array([tool[:3, 3], tip])[:, view].T,
            color=color,
            linewidth=2,
            label=f"tool {'xyz'[axis]}",
        )
    axes.plot(0.0, 0.0, "ks", markersize=8, label="base")
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(alpha=0.3)
