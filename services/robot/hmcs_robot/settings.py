"""Settings of the robot."""

from __future__ import annotations

from pydantic import Field

from hmcs.bus.settings import ServiceSettings


class RobotSettings(ServiceSettings):
    """Settings of the robot: a simulated arm that follows velocity commands."""

    task: str = "human-shapes"
    """Name of a task that comes along, or path of a task file: robot, workspace, obstacles."""
    engine: str = "auto"
    """What simulates the arm: `pybullet`, `mujoco`, or `auto`, the first of them that is installed.
    """
    gui: bool = False
    """Show the simulation in a window."""
    physics_rate_hz: float = Field(default=240.0, ge=120.0, le=2000.0)
    """Control cycles and physics steps a second."""
    state_rate_hz: float = Field(default=120.0, gt=0.0, le=2000.0)
    """RobotStates published a second; at most one a control cycle."""
    damping: float = Field(default=0.02, gt=0.0, le=1.0)
    """λ of the damped least squares."""
    correction_per_s: float = Field(default=10.0, ge=0.0, le=50.0)
    """Rate at which the tool is drawn to where the commands have led."""
    braking_per_s: float = Field(default=8.0, gt=0.0, le=20.0)
    """Speed allowed per distance left to a wall of the workspace or the end of a joint's range."""
    acceleration_limit_m_s2: float = Field(default=10.0, gt=0.0)
    """Of the tool while it follows and while it comes to a stand; after a collision, or a control
    cycle that came too late, it brakes as fast as its motors can."""
    angular_acceleration_limit_rad_s2: float = Field(default=20.0, gt=0.0)
    command_valid_for_ms: float = Field(default=80.0, gt=0.0, le=1000.0)
    """No command counts longer after its arrival, whatever its sender says."""
    late_tick_s: float = Field(default=0.05, gt=0.0)
    """A control cycle that comes so much later than the one before stops the arm."""
    hang_s: float = Field(default=0.1, gt=0.0)
    """A longer silence of the process that hears commands is its hang: the arm stops."""
    settle_s: float = Field(default=0.25, ge=0.0)
    """How long commands are refused after a hang, while what queued up meanwhile drains."""
    realtime_priority: int = Field(default=40, ge=0, le=98)
    """SCHED_FIFO priority of the control cycle where the user may have it, else a nicer place among
    the others; 0 leaves it as it is."""
    search_m: float = Field(default=0.2, gt=0.0)
    """Within this distance the nearest obstacle is looked for."""
