"""`python -m hmcs_robot`: the robot as a process."""

from hmcs.bus.service import run
from hmcs_robot.service import Robot

raise SystemExit(run(Robot))
