"""A plain ROS 2 node: `python ros_talker.py` publishes TwistStamped on /plain at 100 Hz.

Its stamp is this machine's monotonic clock, which all processes share.
"""

from __future__ import annotations

import threading
import time
from pathlib import Path

import numpy as np

from hmcs_ros2_bridge.fields import header, twist
from hmcs_ros2_bridge.ros import Node, Topic

PLAIN = Topic("/plain", "geometry_msgs/TwistStamped", "reliable")
PERIOD_S = 0.01
FILE = Path(__file__)


def main() -> None:
    """Talk until killed."""
    node = Node("talker")
    put = node.publisher(PLAIN).put
    node.start()
    never = threading.Event()
    while not never.wait(PERIOD_S):
        put({"header": header(time.monotonic_ns(), ""), "twist": twist(np.zeros(6))})


if __name__ == "__main__":
    main()
