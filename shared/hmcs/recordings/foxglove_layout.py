"""A layout for Foxglove: the scene with tool, hand and trail, the robot, and its joints over time.

In the format of layouts that Foxglove imports and exports. The description of the robot is a file
of its own beside the layout, since a viewer reads none of what is attached to a recording.
"""

from __future__ import annotations

import json
from typing import Any

from hmcs.palette import STATE_COLORS
from hmcs.recordings.foxglove import BASE, PREFIX

LAYOUT_NAME = "foxglove-layout.json"
"""Of the attachment of a recording."""
_SCENE, _JOINTS = "3D!hmcs", "Plot!hmcs"


def foxglove_layout() -> bytes:
    """Return the layout as the content of its file."""
    return (json.dumps(_layout(), indent=2) + "\n").encode()


def _layout() -> dict[str, Any]:
    shown = {f"{PREFIX}{name}": {"visible": True} for name in ("tool", "hand", "joints")}
    trail = {"visible": True, "type": "line", "lineWidth": 0.004, "gradient": STATE_COLORS[:2]}
    return {
        "configById": {
            _SCENE: {
                "followTf": BASE,
                "followMode": "follow-none",
                "cameraState": {
                    "perspective": True,
                    "distance": 2.0,
                    "phi": 60,
                    "thetaOffset": 45,
                    "target": [0.0, 0.0, 0.0],
                    "targetOffset": [0.4, 0.0, 0.3],
                    "targetOrientation": [0, 0, 0, 1],
                    "fovy": 45,
                    "near": 0.01,
                    "far": 100,
                },
                "layers": {
                    "grid": {
                        "layerId": "foxglove.Grid",
                        "instanceId": "grid",
                        "label": "Grid, 0.1 m",
                        "visible": True,
                        "frameId": BASE,
                        "size": 2,
                        "divisions": 20,
                    }
                },
                "topics": {**shown, f"{PREFIX}trail": trail},
            },
            _JOINTS: {
                "title": "joint positions, rad or m",
                "paths": [
                    {
                        "value": f"{PREFIX}joints.joints[:].position",
                        "enabled": True,
                        "timestampMethod": "receiveTime",
                    }
                ],
                "showLegend": True,
                "showXAxisLabels": True,
                "showYAxisLabels": True,
                "xAxisVal": "timestamp",
            },
        },
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": {
            "direction": "row",
            "first": _SCENE,
            "second": _JOINTS,
            "splitPercentage": 70,
        },
    }
