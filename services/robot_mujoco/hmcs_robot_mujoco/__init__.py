"""MuJoCo as the engine of a simulated robot, `engine: mujoco`.

`engine` is what `hmcs_robot.engine` asks for. `loading` makes MuJoCo's model of a URDF and of what
stands around the arm, `distances` finds what is near, `motors` turns velocities into torques.
"""
