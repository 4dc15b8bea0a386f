"""A joint controller of ROS that is none: `python fake_joint_controller.py KIND DELAY_S URDF LINK
Q1 … QN`, of an arm that begins at these joint positions.

It takes a JointTrajectory of one point (KIND joint_trajectory) or joint velocities (joint_velocity)
after a delay, and says where its joints are, 100 times a second. It faults, and ends, where a
joint would leave its range or be faster than it can be.
"""

from __future__ import annotations

import sys
import time
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np

from hmcs.arms.chain import chain_of
from hmcs.arms.urdf import read_urdf
from hmcs_ros2_bridge.fields import header
from hmcs_ros2_bridge.leading import MESSAGES
from hmcs_ros2_bridge.robot_settings import COMMAND_TOPICS, CommandKind
from hmcs_ros2_bridge.ros import Node, Topic

PERIOD_S = 0.01
LONGEST_STEP_S = 0.05
"""Of a loop that comes late."""
SLACK = 1.05
"""Of the speeds: a trajectory's pieces are told in steps."""
OUT_OF_RANGE, TOO_FAST = 3, 4
"""Exit codes."""
FILE = Path(__file__)


def main(kind: CommandKind, delay_s: float, urdf: Path, link: str, start: list[float]) -> int:
    """Be the controller until killed, or until a fault."""
    chain = chain_of(read_urdf(urdf), link)
    limits = chain.limits
    node = Node("fake_joints")
    pending: deque[tuple[float, Any]] = deque(maxlen=1000)
    topic = Topic(COMMAND_TOPICS[kind], MESSAGES[kind], "reliable")
    node.subscribe(topic, lambda message: pending.append((time.monotonic() + delay_s, message)))
    states = node.publisher(Topic("/joint_states", "sensor_msgs/JointState", "reliable"))
    looks = node.publisher(Topic("/robot_description", "std_msgs/String", "latched"))
    node.start()
    looks.put({"data": urdf.read_text(encoding="utf-8")})
    at, velocity = np.array(start), np.zeros(len(start))
    until_s = next_s = before_s = time.monotonic()
    while True:
        now_s = time.monotonic()
        while pending and pending[0][0] <= now_s:
            message = pending.popleft()[1]
            if kind == "joint_velocity":
                velocity, until_s = np.array(message.data), np.inf
            else:
                (point,) = message.points
                span_s = point.time_from_start.sec + point.time_from_start.nanosec * 1e-9
                assert list(message.joint_names) == list(chain.joint_names)
                velocity, until_s = (np.array(point.positions) - at) / span_s, now_s + span_s
        if now_s >= until_s:
            velocity = np.zeros(len(at))
        at = at + velocity * min(now_s - before_s, LONGEST_STEP_S)
        before_s = now_s
        if ((at < limits.lower) | (at > limits.upper)).any():
            return OUT_OF_RANGE
        if (np.abs(velocity) > SLACK * limits.speed).any():
            return TOO_FAST
        states.put(
            {
                "header": header(node.now_ns(), ""),
                "name": list(chain.joint_names)[::-1],
                "position": at.tolist()[::-1],
                "velocity": velocity.tolist()[::-1],
            }
        )
        next_s = max(next_s + PERIOD_S, time.monotonic() - PERIOD_S)
        time.sleep(max(next_s - time.monotonic(), 0.0))


if __name__ == "__main__":
    kind_named: Any = sys.argv[1]
    positions = [float(word) for word in sys.argv[5:]]
    raise SystemExit(
        main(kind_named, float(sys.argv[2]), Path(sys.argv[3]), sys.argv[4], positions)
    )
