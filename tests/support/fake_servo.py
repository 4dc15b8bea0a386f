"""A MoveIt Servo that is none: `python fake_servo.py DELAY_S X Y Z`, a gantry of three slides.

It takes a TwistStamped after a delay, keeps its slides within their ranges and speeds, stops by
itself where commands stay out, and says where its tool and its joints are, 100 times a second.
"""

from __future__ import annotations

import sys
import time
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np

from hmcs_ros2_bridge.fields import header, pose, twist_in
from hmcs_ros2_bridge.ros import Node, Topic

PERIOD_S = 0.01
RANGE_M, FASTEST_M_S = 0.3, 0.5
COMMANDS_OUT_S = 0.2
"""A silence of its commands after which it stops by itself, as Servo's
incoming_command_timeout."""
DESCRIPTION = "<robot name='gantry'><link name='base'/></robot>"


def main(delay_s: float, start: np.ndarray[Any, Any]) -> None:
    """Be the servo until killed."""
    node = Node("fake_servo")
    pending: deque[tuple[float, Any]] = deque(maxlen=1000)
    topic = Topic("/servo_node/delta_twist_cmds", "geometry_msgs/TwistStamped", "reliable")
    node.subscribe(topic, lambda message: pending.append((time.monotonic() + delay_s, message)))
    poses = node.publisher(Topic("/tool_pose", "geometry_msgs/PoseStamped", "sensor"))
    joints = node.publisher(Topic("/joint_states", "sensor_msgs/JointState", "reliable"))
    looks = node.publisher(Topic("/robot_description", "std_msgs/String", "latched"))
    node.start()
    looks.put({"data": DESCRIPTION})
    slides, velocity, heard_s = np.zeros(3), np.zeros(3), time.monotonic()
    next_s = time.monotonic()
    while True:
        now_s = time.monotonic()
        while pending and pending[0][0] <= now_s:
            velocity, heard_s = twist_in(pending.popleft()[1].twist)[:3], now_s
        if now_s - heard_s > COMMANDS_OUT_S:
            velocity = np.zeros(3)
        speed = np.clip(velocity, -FASTEST_M_S, FASTEST_M_S)
        slides = np.clip(slides + speed * PERIOD_S, -RANGE_M, RANGE_M)
        stamp = header(node.now_ns(), "base_link")
        poses.put({"header": stamp, "pose": pose(start + slides, (1.0, 0.0, 0.0, 0.0))})
        joints.put(
            {
                "header": stamp,
                "name": ["slide_x", "slide_y", "slide_z"],
                "position": slides.tolist(),
                "velocity": speed.tolist(),
            }
        )
        next_s = max(next_s + PERIOD_S, time.monotonic() - PERIOD_S)
        time.sleep(max(next_s - time.monotonic(), 0.0))


FILE = Path(__file__)

if __name__ == "__main__":
    main(float(sys.argv[1]), np.array([float(word) for word in sys.argv[2:5]]))
