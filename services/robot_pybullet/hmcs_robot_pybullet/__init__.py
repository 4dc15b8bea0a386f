"""PyBullet as the engine of a simulated robot, `engine: pybullet`; for CPython 3.11.

`engine` is what `hmcs_robot.engine` asks for, `arm` an arm loaded into PyBullet, `bodies` what
stands around it.
"""
