"""Recordings of other programs as demonstrations: bags of ROS, MCAP files, LeRobot data sets.

One module for a format; `registry` finds by its content which one a file has.
"""
