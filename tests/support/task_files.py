"""A small task file that is right, and how files are checked."""

from __future__ import annotations

from collections.abc import Callable

from hmcs.task import Problem

Check = Callable[[str], list[Problem]]
"""Returns what is wrong with a text as a task file."""

GOOD = """\
format: hmcs-task/1
name: small
dead_zone_m: 0.01
gestemes:
  - {name: up}
  - {name: down}
states:
  - name: rise
    gestemes: [up]
    next: [fall]
  - name: fall
    gestemes: [down]
    next: {rise: 0.5, fall: 0.5}
start: [rise]
workspace:
  lower_m: [-1, -1, 0]
  upper_m: [1, 1, 1]
  obstacles:
    - {name: ball, shape: sphere, position_m: [0, 0, 0], radius_m: 0.1}
robot:
  model: puma560
  tool_start_m: [0, 0, 0.5]
  tool_orientation_xyzw: [0, 0, 0, 1]
"""
