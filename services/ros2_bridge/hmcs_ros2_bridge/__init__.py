"""The bridge to ROS 2: three directions, each a process that takes only what it needs.

`python -m hmcs_ros2_bridge` lets ROS watch (`service`). `python -m hmcs_ros2_bridge.robot` is a
robot of the cell whose arm is moved by a ROS 2 controller. `python -m hmcs_input_device --source
ros2` lets a ROS operator drive (`operator`). `ros` alone touches rclpy; `fields`, `scene`,
`watching`, `tool_limits` and `hand` are pure.
"""
