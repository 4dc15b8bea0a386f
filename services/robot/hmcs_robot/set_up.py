"""What the settings and a task make of a robot."""

from __future__ import annotations

import numpy as np

from hmcs.arms.control import Tuning
from hmcs.arms.limits import Limits
from hmcs.arms.state import Pose
from hmcs.supervision import Policy
from hmcs.task import Task
from hmcs_robot.driver import ArmDriver
from hmcs_robot.robots import model_of
from hmcs_robot.settings import RobotSettings
from hmcs_robot.simulation import Scene, Simulation


def tuning_of(settings: RobotSettings) -> Tuning:
    """Return how the arm is controlled."""
    return Tuning(damping=settings.damping, correction_per_s=settings.correction_per_s)


def policy_of(settings: RobotSettings) -> Policy:
    """Return how patient its supervision is."""
    return Policy(
        longest_valid_ns=round(settings.command_valid_for_ms * 1e6),
        late_tick_ns=round(settings.late_tick_s * 1e9),
        hang_ns=round(settings.hang_s * 1e9),
        settle_ns=round(settings.settle_s * 1e9),
    )


def simulated(task: Task, settings: RobotSettings) -> Simulation:
    """Return the arm of a task, simulated; raises UserError as `Simulation` does."""
    start = Pose(np.array(task.robot.tool_start_m), np.array(task.robot.tool_orientation_xyzw))
    return Simulation(
        Scene(
            task.robot.name,
            start,
            task.workspace.obstacles,
            task.workspace.forbidden,
            model_of(task.robot),
            task.robot.start_pose,
        ),
        1.0 / settings.physics_rate_hz,
        engine=settings.engine,
        gui=settings.gui,
        reach_m=settings.search_m,
    )


def limits_of(task: Task, driver: ArmDriver, settings: RobotSettings) -> Limits:
    """Return what bounds an arm in a task."""
    return Limits(
        joints=driver.limits,
        speed_m_s=task.robot.speed_limit_m_s,
        angular_speed_rad_s=task.robot.angular_speed_limit_rad_s,
        workspace_lower_m=np.array(task.workspace.lower_m),
        workspace_upper_m=np.array(task.workspace.upper_m),
        acceleration_m_s2=settings.acceleration_limit_m_s2,
        angular_acceleration_rad_s2=settings.angular_acceleration_limit_rad_s2,
        braking_per_s=settings.braking_per_s,
    )
