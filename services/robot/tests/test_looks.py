"""What an arm tells those who draw it."""

from __future__ import annotations

import re

import numpy as np

from hmcs_robot.arm import Arm
from hmcs_robot.looks import looks_of
from hmcs_robot.robots import ROBOTS


def test_every_mesh_of_an_arm_is_told_and_every_joint_named(robot: str, arm: Arm) -> None:
    looks = looks_of(ROBOTS[robot].urdf, arm.joint_names)
    named = set(re.findall(r'filename="([^"]+)"', looks.urdf))
    assert named <= set(looks.files)
    assert len(looks.joints) == len(arm.joints) == len(np.array(ROBOTS[robot].home))
    for joint in looks.joints:
        assert f'name="{joint}"' in looks.urdf
