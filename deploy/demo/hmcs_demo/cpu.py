"""Processor time of the stack: of every process, and of the router inside this one."""

from __future__ import annotations

import time
from collections.abc import Iterable

import psutil

from hmcs_local.processes import StackProcess


class CpuMeter:
    """Counts from its making on; processes that come later count from their own start."""

    def __init__(self, processes: Iterable[StackProcess]) -> None:
        self._before_s = {process.pid: _process_s(process) for process in processes}
        self._ended_s: dict[int, float] = {}
        self._router_s = _router_s()
        self._began_s = time.monotonic()

    def note_end(self, process: StackProcess) -> None:
        """Take a process' last count, just before it is ended."""
        self._ended_s[process.pid] = _process_s(process)

    def cores(self, processes: Iterable[StackProcess]) -> float:
        """Return processor time by time, of the router and of all these processes."""
        used_s = _router_s() - self._router_s
        for process in processes:
            now_s = self._ended_s.get(process.pid)
            now_s = _process_s(process) if now_s is None else now_s
            used_s += now_s - self._before_s.get(process.pid, 0.0)
        return used_s / (time.monotonic() - self._began_s)


def _process_s(process: StackProcess) -> float:
    times = psutil.Process(process.pid).cpu_times()
    return float(times.user + times.system)


def _router_s() -> float:
    """All threads of this process but the calling one: the router's, and the bus' own."""
    return time.process_time() - time.thread_time()
