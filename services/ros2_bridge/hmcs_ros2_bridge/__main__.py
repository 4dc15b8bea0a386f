"""`python -m hmcs_ros2_bridge`: what ROS 2 watches, as a process."""

from hmcs.bus.service import run
from hmcs_ros2_bridge.service import Ros2Bridge

raise SystemExit(run(Ros2Bridge))
