from __future__ import annotations

import json

import numpy as np
import pytest

from hmcs.bus.examples import example_of
from hmcs.bus.messages import Belief, FixtureState, Motion, RobotState
from hmcs.task import ForbiddenRegion, Workspace, load_task
from hmcs_ros2_bridge import scene
from hmcs_ros2_bridge.watching import ERROR, OK, STALE, Seen, diagnostics, joint_state, json_of

TASK = load_task("human-shapes")
