"""MuJoCo's viewer as a window that shows the cell while it is simulated."""

from __future__ import annotations

import threading
import warnings

import glfw
import mujoco
from mujoco import viewer

from hmcs.errors import UserError

_CLOSES_WITHIN_S = 3.0


class Window:
    """A window of its own threads; raises UserError where none opens."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            # Where there is no display MuJoCo's viewer would end the process.
            there = glfw.init()
        if not there:
            raise UserError("no window could be opened: is there a display? Run without gui")
        before = set(threading.enumerate())
        self._viewer = viewer.launch_passive(model, data, show_left_ui=False, show_right_ui=False)
        self._threads = set(threading.enumerate()) - before

    def show(self) -> None:
        """Show what is simulated now."""
        self._viewer.sync()

    def close(self) -> None:
        """Close the window and wait for its threads: a process that ends before them crashes."""
        self._viewer.close()
        for thread in self._threads:
            thread.join(_CLOSES_WITHIN_S)
