"""Becomes a command that dies with the process that started it. Standard library only.

Run as `python -S -E guard.py PARENT_PID COMMAND…`: on Linux the kernel is asked to kill this
process when its parent is gone, however it went; then the command takes its place and keeps that.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys

_PR_SET_PDEATHSIG = 1


def main() -> None:
    """Bind this process to its parent and become the command."""
    parent, command = int(sys.argv[1]), sys.argv[2:]
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        return
    os.execvp(command[0], command)


if __name__ == "__main__":
    main()
