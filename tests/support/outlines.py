"""A recording as the recorder outlines it for the page."""

from __future__ import annotations

from typing import Any

import numpy as np

from hmcs.bus.messages import Outline

STATES = ("free", "in")


def outline(**changed: Any) -> Outline:
    """Ten seconds along x, one meter in all, its first half labeled `free`."""
    reported = {
        "recordings": ("two.mcap", "one.mcap"),
        "recording": "two.mcap",
        "path": "/takes/two.mcap",
        "duration_s": 10.0,
        "time_s": np.linspace(0.0, 10.0, 101),
        "position": np.linspace([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], 101),
        "begin_s": np.array([0.0]),
        "end_s": np.array([5.0]),
        "states": ("free",),
    }
    return Outline(**(reported | changed))
